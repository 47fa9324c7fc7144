"""Kernels read and write inside of their arrays."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__)

ON_THE_EDGE = "test_a_point_outside_of_the_limits_is_not_detected_within_them[place5-family0]"
"""A strong point at three times the greatest speed, which hides the target in an eighth of the
draws of its place (docs/explanation/limits.md)."""


@pytest.mark.slow
def test_kernels_stay_within_their_arrays(tmp_path):
    """The tests of this folder run again with kernels that check every index.

    Such kernels round differently. `ON_THE_EDGE` ends otherwise by that, and must not raise an
    `IndexError`; all others pass.
    """
    others = sorted(str(one) for one in HERE.parent.glob("test_*.py") if one != HERE)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *others],
        env=os.environ | {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)},
        cwd=HERE.parents[4],
        capture_output=True,
        text=True,
        check=False,
    )
    failed = {line.split("::")[-1] for line in done.stdout.splitlines() if line[:6] == "FAILED"}
    assert failed <= {ON_THE_EDGE}, done.stdout[-4000:]
    assert " passed in " in done.stdout, done.stdout[-4000:]
    assert "IndexError" not in done.stdout, done.stdout[-4000:]

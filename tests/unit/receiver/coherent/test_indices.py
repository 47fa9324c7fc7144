"""Kernels read and write inside of their arrays."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__)


@pytest.mark.slow
def test_kernels_stay_within_their_arrays(tmp_path):
    """The tests of this folder pass again with kernels that check every index."""
    others = sorted(str(one) for one in HERE.parent.glob("test_*.py") if one != HERE)
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *others],
        env=os.environ | {"NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)},
        cwd=HERE.parents[4],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]

"""The run that compiles gives the bytes of all later ones."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.small_study import SMALL_STUDY


@pytest.mark.slow
def test_the_first_run_gives_the_bytes_of_the_second_and_compiles_in_workers_alone(tmp_path):
    """From an empty cache: workers compile, and the run itself only loads."""
    (tmp_path / "study.toml").write_text(SMALL_STUDY)
    first, second = run(tmp_path, "first"), run(tmp_path, "second")
    assert first.stderr.count("polychirp: compiling ") == 1
    assert "compiling" not in second.stderr
    # numba tells on stdout what it does; workers pass that on to stderr
    assert "data saved" in first.stderr
    for done in (first, second):
        assert "data loaded" in done.stdout
        assert "data saved" not in done.stdout
    assert stored(tmp_path / "first") == stored(tmp_path / "second")


def run(folder: Path, name: str) -> subprocess.CompletedProcess[str]:
    environment = {
        **os.environ,
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        "NUMBA_DEBUG_CACHE": "1",
        "NUMBA_NUM_THREADS": "1",
    }
    return subprocess.run(
        [sys.executable, "-m", "polychirp", "run", "study.toml", "--out", name],
        cwd=folder,
        env=environment,
        check=True,
        capture_output=True,
        text=True,
    )


def stored(folder: Path) -> dict[str, bytes]:
    """All stored arrays; attributes hold the time of the run."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "zarr.json"
    }

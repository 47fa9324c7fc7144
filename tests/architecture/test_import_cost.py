"""Importing polychirp does nothing but make names available."""

import json
import subprocess
import sys
import time
from pathlib import Path

SOURCE = Path(__file__).parents[2] / "src" / "polychirp"
HEAVY = {"matplotlib", "numba", "pydantic", "rich", "scipy", "trimesh", "zarr"}
PATIENCE = 0.5
"""Seconds a person takes for "at once"."""


def shortest_time(*arguments: str) -> float:
    """Seconds of the fastest of three interpreters: the one least disturbed by other work."""
    times = []
    for _ in range(3):
        start = time.perf_counter()
        subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    return min(times)


def test_importing_the_package_is_instant():
    assert shortest_time("-c", "import polychirp") < PATIENCE


def test_importing_the_package_loads_no_heavy_library():
    program = "import json, sys, polychirp; print(json.dumps(sorted(sys.modules)))"
    listing = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    ).stdout
    loaded = {name.partition(".")[0] for name in json.loads(listing)}
    assert "polychirp" in loaded
    assert loaded & HEAVY == set()


def test_the_command_line_explains_itself_at_once():
    assert shortest_time("-m", "polychirp", "--help") < PATIENCE

"""The kernels of `bench.gpu` give what the channel's own kernels give, by numba's simulator.

The simulator runs each thread of a GPU in Python. It is switched on by the environment before numba
is imported, so that the comparison runs in a process of its own.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

PROGRAM = """
import json, warnings
warnings.simplefilter("ignore")
from bench.gpu import rows
from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.scene import Actor, Plate
from polychirp.testing.shapes import around, box, mesh_of, sphere

rows.REPEATS = 1
ball = Actor(name="ball", kind="object", mesh=mesh_of(sphere(0.3, 0.15)), pose=Pose(x=5.0, z=0.5))
near = Actor(name="box", kind="object", mesh=mesh_of(box((0.1, 0.1, 0.1), 0.1)),
    pose=Pose(x=3.0, y=0.1, z=0.5))
road = Actor(name="road", kind="road",
    plates=(Plate(centre=(0, 0, 0), half_u=(20, 0, 0), half_v=(0, 20, 0), material="asphalt",
    part="road"),))
scene = around([ball, near, road], [(0.0, 0.0, 0.5), (0.2, 0.4, 0.5)])
noted = rows.noted_calls(Composite(), scene)
made = [rows.state_row(noted["states"]), rows.wave_row(noted["waves"]),
    rows.term_row(noted["terms"]), rows.hit_row(sphere(0.3, 0.1), 12)]
print(json.dumps([vars(row) for row in made]))
"""


@pytest.fixture(scope="module")
def rows():
    """Rows of a ball in the shadow of a box before two radars."""
    pytest.importorskip("numba.cuda", reason="this numba has no simulator of a GPU")
    switches = {"NUMBA_ENABLE_CUDASIM": "1", "NUMBA_DISABLE_JIT": "1", "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=ROOT,
        env=os.environ | switches,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {row["name"]: row for row in json.loads(done.stdout)}


@pytest.mark.parametrize(
    "name", ["shadow rays", "fields on facets", "sums of terms", "closest hits"]
)
def test_a_kernel_for_gpus_gives_what_that_for_processors_gives(rows, name):
    row = rows[name]
    assert row["work"] > 100
    assert row["error"] < 1e-12

"""What a mechanism adds to each pair."""

import numpy as np
import pytest

from polychirp.channel.tracers.composite import Composite
from polychirp.frames import Pose
from polychirp.model.mesh import Plate
from polychirp.model.radar import Radar
from polychirp.model.scene import Actor, Scene
from tools.experiments.mechanisms import compare_mechanisms


def scene(*bodies):
    cars = (
        Actor(name="a", kind="vehicle", pose=Pose(z=0.5)),
        Actor(name="b", kind="vehicle", pose=Pose(x=12.0, z=0.5, yaw=np.pi)),
    )
    radars = (Radar(name="a"), Radar(name="b"))
    return Scene(time=0.0, actors=(*cars, *bodies), radars=radars, carriers=(0, 1))


def test_a_mirror_adds_what_its_image_carries():
    """A metal road: as strong as the direct path but for its length and the antennas' pattern.

    Within 2 %: the plate ends 90 m away, which ripples.
    """
    plate = Plate(
        centre=(6, 0, 0), half_u=(90, 0, 0), half_v=(0, 90, 0), material="metal", part="road"
    )
    road = Actor(name="road", kind="road", plates=(plate,))
    world = scene(road)
    found = compare_mechanisms(world, Composite())
    gain = world.radars[0].array.pattern.gain(np.array([[6.0, 0, -0.5], [1.0, 0, 0]]))
    image = (gain[0] / gain[1]) ** 2 * 144 / 145
    direct = found.share["mirrors"][0, 1] * found.power[0, 1] / image
    alone = compare_mechanisms(scene(), Composite()).power[0, 1]
    assert direct == pytest.approx(alone, rel=2e-2)


def test_what_is_not_there_adds_nothing():
    found = compare_mechanisms(scene(), Composite())
    for share in found.share.values():
        assert share[0, 1] == 0.0
        assert np.isnan(share[0, 0])
    assert found.num_paths.tolist() == [[0, 1], [1, 0]]

"""The clean twin of an interfered frame is that of the same street without other radars."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.frames import Pose
from polychirp.model.front_end import Digitiser, FrontEnd
from polychirp.study.mitigation.engine_frames import frame_of_study
from polychirp.study.spec import Study, StudyRadar
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.waveform import Triangular

STREET = Street(
    vehicles=(
        Vehicle(name="ego", x=0.0, y=0.0),
        Vehicle(name="oncoming", x=30.0, y=3.5, heading=np.pi),
    ),
    points=(Point(name="post", x=15.0, y=0.0, z=0.5, rcs=1.0),),
)


def study(*, power, front_end):
    front = StudyRadar(
        name="front",
        vehicle="ego",
        mount=Pose(x=2.5, z=0.5),
        waveform=Triangular(),
        front_end=front_end,
    )
    other = replace(front, name="other", vehicle="oncoming", transmit_power=power, start_time=1e-6)
    return Study(
        name="twin",
        street=STREET,
        radars=(front, other),
        victims=("front",),
        num_sweeps=2,
        tracer=FreeSpace(),
    )


@pytest.mark.parametrize("margin", [1.0, 1e-4])
def test_a_digitiser_that_clips_reads_the_clean_twin_without_interference(margin):
    """With a full scale of the interference's power, and of a ten thousandth of it."""
    plain = frame_of_study(study(power=1e-2, front_end=FrontEnd()))
    power = float(np.max(np.abs(plain.parts.interference) ** 2))
    front_end = FrontEnd(digitiser=Digitiser(full_scale=margin * power, bits=10))
    loud = frame_of_study(study(power=1e-2, front_end=front_end))
    silent = frame_of_study(study(power=0.0, front_end=front_end))
    assert np.abs(loud.parts.interference).max() > 0.0
    np.testing.assert_allclose(loud.clean, silent.frame.samples, rtol=0.0, atol=1e-12)


def test_without_a_digitiser_the_interference_is_taken_away():
    one = frame_of_study(study(power=1e-2, front_end=FrontEnd()))
    np.testing.assert_array_equal(one.clean, one.frame.samples - one.parts.interference)

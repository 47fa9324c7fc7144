"""Frames of virtual arrays, and the order of their channels."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.errors import CapabilityError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import PARTS, IfFrame, IfParts, SampleTimes
from polychirp.receiver.mimo import virtual_array, virtual_parts
from polychirp.receiver.signal_model.transmit_codes import code_blocks, virtual_position
from polychirp.rng import Streams
from polychirp.waveform import (
    DiverseTriangular,
    DopplerDivision,
    PhaseCoded,
    Sawtooth,
    TimeDivision,
    Triangular,
    coded,
)


def frame(waveform, coding, *, num_sweeps=12, num_elements=3, **fields):
    """Samples that say which channel, ramp and sample they are."""
    ramps = waveform.schedule(num_sweeps=num_sweeps, streams=Streams(seed=1))
    schedule = coded(ramps, coding, num_elements=num_elements)
    times = SampleTimes(
        first=ramps.start_time + 1e-5, num_samples=np.full(ramps.num_ramps, 4), rate=1e6
    )
    array = AntennaArray(**{"num_channels": 2, "num_transmitters": num_elements} | fields)
    shape = (array.num_channels, ramps.num_ramps, 4)
    samples = np.arange(np.prod(shape)).reshape(shape) + 0.5j
    return IfFrame(samples=samples, times=times, schedule=schedule, array=array)


def test_turns_become_channels_one_block_after_the_other():
    found = frame(Sawtooth(), TimeDivision())
    virtual = virtual_array(found)
    assert virtual.samples.shape == (6, 4, 4)
    for element in range(3):
        own = found.samples[:, element::3]
        np.testing.assert_array_equal(virtual.samples[2 * element : 2 * element + 2], own)
    np.testing.assert_array_equal(virtual.schedule.start_time, found.schedule.start_time[::3])
    np.testing.assert_array_equal(virtual.schedule.sweep, np.arange(4))
    np.testing.assert_array_equal(virtual.times.first, found.times.first[::3])


def test_triangles_keep_both_their_ramps():
    found = frame(Triangular(), TimeDivision())
    virtual = virtual_array(found)
    assert virtual.schedule.num_ramps == 8
    np.testing.assert_array_equal(np.sign(virtual.schedule.slope), [1, -1] * 4)
    np.testing.assert_array_equal(virtual.schedule.sweep, np.repeat(np.arange(4), 2))
    np.testing.assert_array_equal(virtual.samples[2, :2], found.samples[0, 2:4])


@pytest.mark.parametrize("coding", [TimeDivision(), DopplerDivision(), PhaseCoded()], ids=repr)
def test_channels_stand_where_the_array_of_the_frame_says(coding):
    """Receiving elements far apart and transmitting ones near: channels are put in order."""
    found = frame(Sawtooth(), coding, spacing=6e-3, transmit_spacing=2e-3)
    virtual = virtual_array(found)
    places = virtual_position(found.array)[..., 1]
    np.testing.assert_allclose(np.sort(places.ravel()), virtual.array.position[:, 1], atol=1e-15)
    one_each = virtual_array(frame(Sawtooth(), coding)).samples
    order = np.argsort(places.ravel())
    np.testing.assert_array_equal(virtual.samples, one_each[order])


def test_a_frame_from_one_element_stays_as_it_is():
    found = frame(Triangular(), TimeDivision(), num_elements=1)
    virtual = virtual_array(found)
    np.testing.assert_array_equal(virtual.samples, found.samples)
    assert virtual.array == found.array


def test_the_shortest_block_is_found():
    assert code_blocks(frame(Sawtooth(), PhaseCoded()).schedule).ramps.shape == (3, 4, 1)
    bands = DopplerDivision(num_bands=6)
    assert code_blocks(frame(Triangular(), bands).schedule).ramps.shape == (2, 6, 2)


def test_parts_are_decoded_like_their_sum():
    found = frame(Sawtooth(), PhaseCoded())
    random = np.random.default_rng(1)
    parts = IfParts(samples=random.normal(size=(len(PARTS), *found.samples.shape)))
    whole = virtual_array(found.with_samples(parts.total()), range_rate=3.0).samples
    split = virtual_parts(found, parts, range_rate=3.0)
    np.testing.assert_allclose(split.total(), whole, atol=1e-12)


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (frame(Sawtooth(), TimeDivision(), num_sweeps=13), "divides 13 sweeps"),
        (frame(Sawtooth(), PhaseCoded(), num_sweeps=6), "divides 6 sweeps"),
        (frame(DiverseTriangular(), TimeDivision()), "whose sweeps are equal"),
        (frame(Sawtooth(), TimeDivision(), transmit_spacing=4e-3), "a transmit_spacing of"),
        (
            frame(Sawtooth(), TimeDivision(), spacing=2e-3, transmit_spacing=2e-3),
            "at equal distances",
        ),
    ],
)
def test_what_no_virtual_line_can_be_made_of_is_refused(found, message):
    with pytest.raises(CapabilityError, match=message):
        virtual_array(found)


def test_weights_that_change_within_a_triangle_are_refused():
    found = frame(Triangular(), TimeDivision())
    weight = np.roll(found.schedule.transmit_weight, 1, axis=0)
    with pytest.raises(CapabilityError, match="change within a sweep"):
        code_blocks(replace(found.schedule, transmit_weight=weight))


def test_equal_weights_are_no_code():
    schedule = frame(Sawtooth(), TimeDivision()).schedule
    with pytest.raises(CapabilityError, match="not orthogonal"):
        code_blocks(replace(schedule, transmit_weight=np.ones((12, 3))))

"""Whatever a spec holds, its text reads back as the same spec."""

import math
import tomllib

from hypothesis import given
from hypothesis import strategies as st

from polychirp.config.dump import dump
from polychirp.config.load import build
from polychirp.frames import Pose
from polychirp.model.antenna import AntennaArray, ArrayErrors
from polychirp.study.spec import StudyRadar
from polychirp.waveform import (
    DiverseTriangular,
    DopplerDivision,
    FixedTriangular,
    PhaseCoded,
    Sawtooth,
    TimeDivision,
    Triangular,
)

positive = st.floats(1e-9, 1e12)
frequency = st.floats(1e9, 1e11)
short = st.floats(1e-9, 1e3)


@st.composite
def limits(draw, values):
    low, high = sorted((draw(values), draw(values)))
    return low, high


waveforms = st.one_of(
    st.builds(
        Sawtooth,
        start_frequency=frequency,
        bandwidth=positive,
        ramp_duration=short,
        direction=st.sampled_from(["up", "down"]),
    ),
    st.builds(Triangular, bandwidth=positive, ramp_duration=short, idle=short),
    st.builds(
        DiverseTriangular,
        bandwidth=limits(positive),
        ramp_duration=limits(short),
        start_frequency_spread=positive,
        random_order=st.booleans(),
    ),
    st.builds(FixedTriangular, bandwidth=limits(positive), ramp_duration=limits(short)),
)
codings = st.one_of(
    st.none(),
    st.builds(TimeDivision),
    st.builds(DopplerDivision, num_bands=st.none() | st.integers(2, 8)),
    st.builds(PhaseCoded),
)
degrees = st.integers(-180, 180).map(math.radians)
arrays = st.builds(
    AntennaArray,
    num_channels=st.just(2),
    num_transmitters=st.integers(1, 3),
    transmit_spacing=st.none() | st.floats(1e-9, 1e6),
    channel_gains=st.sampled_from([(), (1.0, 0.1)]),
    channel_phases=st.just(()) | st.tuples(degrees, degrees),
)
text = st.text(st.characters(exclude_categories=["Cs"]), min_size=1)


@given(waveform=waveforms)
def test_a_waveform_reads_back_as_itself(waveform):
    assert build(type(waveform), tomllib.loads(dump(waveform))) == waveform


@given(
    waveform=waveforms,
    coding=codings,
    array=arrays,
    name=text,
    start_time=st.floats(-1.0, 1.0),
    clock_offset=st.floats(-1e-4, 1e-4).map(lambda value: round(value, 9)),
    x=st.floats(-1e3, 1e3),
    yaw=st.integers(-180, 180).map(math.radians),
)
def test_a_radar_reads_back_as_itself(
    waveform, coding, array, name, start_time, clock_offset, x, yaw
):
    """Degrees and ppm scale by rounding factors, so draws are what those units can name."""
    radar = StudyRadar(
        name=name,
        vehicle=name,
        waveform=waveform,
        coding=coding,
        array=array,
        array_errors=None if coding is None else ArrayErrors(phase=abs(yaw)),
        start_time=start_time,
        clock_offset=math.copysign(float(f"{abs(clock_offset) * 1e6:.3f}") * 1e-6, clock_offset),
        mount=Pose(x=x, yaw=yaw),
    )
    assert build(StudyRadar, tomllib.loads(dump(radar))) == radar

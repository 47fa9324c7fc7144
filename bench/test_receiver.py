"""Time of one paper frame from samples to detections, of CFAR and of azimuths.

    OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 pytest bench/test_receiver.py

The bars: 24 ms, half the length of the frame, for ten points; 50 ms for equal chirps of twelve
virtual channels, 512 samples and 256 chirps of each element; 5 ms for OS-CFAR on 256 × 128 cells;
20 µs per detection for root-MUSIC in batches.
"""

import time
from dataclasses import replace

import numpy as np
import pytest

from polychirp.model.antenna import AntennaArray
from polychirp.model.radar import Converter
from polychirp.receiver.angle.doa import root_music
from polychirp.receiver.coherent import rate_blocks
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.coherent.coherent_map import MapLimits, coherent_map, map_axes
from polychirp.receiver.coherent.observation import Observation
from polychirp.receiver.coherent.points import Points, without
from polychirp.receiver.coherent.profiles import Profiles
from polychirp.receiver.coherent.residual import Residual
from polychirp.receiver.coherent.spectra import Spectra
from polychirp.receiver.detection.cfar import CfarWindow, ordered_statistic
from polychirp.receiver.mitigation.base import mitigated
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular, Sawtooth, TimeDivision, Triangular, coded
from tests.support.points import HandPoint, coded_frame, frame_of
from tests.support.schedules import drawn_chirps

FAMILIES = {
    "conventional": Triangular(bandwidth=1e9, ramp_duration=1e-3),
    "diverse": DiverseTriangular(),
}


def ten_points():
    """Points at 2.5 to 28 m and ±30 m/s, with a power range of 30 dB."""
    draw = np.random.default_rng(0)
    return [
        HandPoint(
            range=distance,
            range_rate=draw.uniform(-30.0, 30.0),
            azimuth=draw.uniform(-1.0, 1.0),
            power=10 ** draw.uniform(0.0, 3.0),
        )
        for distance in np.linspace(2.5, 28.0, 10)
    ]


@pytest.mark.benchmark(timer=time.process_time, min_rounds=3, warmup=True)
@pytest.mark.parametrize("family", FAMILIES)
def test_a_frame_of_ten_points(benchmark, family):
    ramps = FAMILIES[family].schedule(num_sweeps=16, streams=Streams(2))
    frame = frame_of(ramps, ten_points())
    assert benchmark(CoherentReceiver().detect, frame).num_detections >= 10


@pytest.mark.benchmark(timer=time.process_time, min_rounds=10, warmup=True)
@pytest.mark.parametrize("sums", ["groups of ramps", "every ramp"])
@pytest.mark.parametrize("family", FAMILIES)
def test_the_sums_of_the_map(benchmark, family, sums, monkeypatch):
    """With lines in place of the phasors of groups of ramps, and with the phasors themselves."""
    ramps = FAMILIES[family].schedule(num_sweeps=16, streams=Streams(2))
    frame = frame_of(ramps, ten_points())
    seen = Observation.of(frame, mitigated(None, frame))
    axes = map_axes(seen, MapLimits.of(CoherentReceiver()))
    profiles = Profiles.of(seen, Spectra.of(seen, seen.samples), axes)
    if sums == "every ramp":
        monkeypatch.setattr(rate_blocks, "MOST_LOSS", -1.0)
    benchmark(rate_blocks.powers, seen, profiles)


@pytest.mark.benchmark(timer=time.process_time, min_rounds=10, warmup=True)
@pytest.mark.parametrize("way", ["one pass with its transform", "without transform, the twin"])
@pytest.mark.parametrize("family", FAMILIES)
def test_the_residual_of_ten_points(benchmark, family, way):
    ramps = FAMILIES[family].schedule(num_sweeps=16, streams=Streams(2))
    frame = frame_of(ramps, ten_points())
    seen = Observation.of(frame, mitigated(None, frame))
    draw = np.random.default_rng(1)
    points = replace(
        Points.none(4),
        motion=np.column_stack(
            [draw.uniform(2, 28, 10), draw.uniform(-30, 30, 10), np.zeros((10, 2))]
        ),
        amplitude=draw.normal(size=(10, 4)) + 0j,
        floor=np.ones(10),
        sine=draw.uniform(-0.8, 0.8, 10),
        growth=np.zeros(10),
        power=np.ones(10),
    )
    if way == "one pass with its transform":
        benchmark(Residual.of, seen, points)
    else:
        benchmark(without, seen, seen.samples, points)


@pytest.mark.benchmark(timer=time.process_time, min_rounds=3, warmup=True)
def test_the_map_of_256_drawn_chirps(benchmark):
    converter = Converter(sample_rate=20e6, start=2e-6, margin=1e-6)
    frame = frame_of(drawn_chirps(256, seed=1), [], converter=converter)
    seen = Observation.of(frame, mitigated(None, frame))
    axes = map_axes(seen, MapLimits.of(CoherentReceiver()))
    benchmark(lambda: coherent_map(seen, Profiles.of(seen, Spectra.of(seen, seen.samples), axes)))


@pytest.mark.benchmark(timer=time.process_time, min_rounds=20, warmup=True)
@pytest.mark.parametrize("num_ramps", [258, 768])
def test_equal_chirps_of_three_elements_and_four_channels(benchmark, num_ramps):
    """Chirps in all, and of each element: 512 samples, read to the last range cell."""
    waveform = Sawtooth(start_frequency=76.5e9, bandwidth=150e6, ramp_duration=28e-6, idle=4e-6)
    ramps = waveform.schedule(num_sweeps=num_ramps, streams=Streams(2))
    points = [
        HandPoint(range=distance, range_rate=rate, azimuth=0.1 * rate / 10.0, power=power)
        for distance, rate, power in [(20, 3, 1), (55, -8, 0.1), (90, 9, 0.1), (300, 5, 0.1)]
    ]
    frame = coded_frame(
        coded(ramps, TimeDivision(), num_elements=3),
        points,
        array=AntennaArray(num_channels=4, num_transmitters=3),
        converter=Converter(sample_rate=20e6, start=2e-6, margin=0.45e-6),
    )
    assert frame.samples.shape == (4, num_ramps, 512)
    assert benchmark(RangeDoppler(greatest_range=600.0).detect, frame).num_detections >= 4


@pytest.mark.benchmark(timer=time.process_time, min_rounds=20, warmup=True)
def test_ordered_statistics_on_a_map(benchmark):
    power = np.random.default_rng(1).exponential(size=(256, 128))
    window = CfarWindow(guard=(2, 2), training=(4, 4), is_circular=(True, False))
    benchmark(ordered_statistic, power, window=window, false_alarm_probability=1e-4)


@pytest.mark.benchmark(timer=time.process_time, min_rounds=20, warmup=True)
def test_azimuths_of_a_thousand_detections(benchmark):
    draw = np.random.default_rng(2)
    snapshots = draw.normal(size=(1000, 4, 32)) + 1j * draw.normal(size=(1000, 4, 32))
    benchmark(root_music, snapshots, spacing=0.5)

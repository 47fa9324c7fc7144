"""A point written as a raw capture is found where it is; noise alone crosses as often as stated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binom

from polychirp.capture.dca1000 import open_raw
from polychirp.capture.parameters import CaptureParameters
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import IfFrame
from polychirp.receiver.detection.cfar import ordered_statistic
from polychirp.receiver.range_doppler.chain import RangeDoppler
from tests.support.dca1000 import write_raw

PARAMETERS = CaptureParameters(
    start_frequency=77e9,
    slope=20e12,
    idle_time=10e-6,
    ramp_end_time=50e-6,
    adc_start=6e-6,
    num_ramps=128,
    sample_rate=4e6,
    num_samples=128,
    num_transmitters=2,
    num_receivers=4,
    device="xwr16xx",
)


def point_echo(
    parameters: CaptureParameters, *, distance: float, range_rate: float, azimuth: float
) -> np.ndarray:
    """Samples ``(receiver, ramp, fast)`` of a point, from its distance to every element.

    y = tx · conj(rx): the phase is φ(t) − φ(t − τ) = 2π(f τ + b t' τ − b τ²/2), with the lengths
    to transmitter and receiver at the time of the sample. The transmitting elements are a whole
    receiving array apart; range is to the middle of all virtual elements, and refers to the middle
    of the frame.
    """
    times, schedule = parameters.times, parameters.schedule
    receivers = parameters.array.position[:, 1]
    turn = np.arange(128) % parameters.num_transmitters - 0.5 * (parameters.num_transmitters - 1)
    transmitters = turn * parameters.num_receivers * parameters.array.spacing
    middle = 0.5 * schedule.end_time[-1]
    out = distance + range_rate * (times.time - middle)  # (ramp, fast)
    x, y = out * np.cos(azimuth), out * np.sin(azimuth)
    to_transmitter = np.hypot(x, y - transmitters[:, None])
    to_receiver = np.hypot(x, y - receivers[:, None, None])
    delay = (to_transmitter + to_receiver) / SPEED_OF_LIGHT
    elapsed = times.time - schedule.start_time[:, None]
    cycles = parameters.start_frequency * delay + parameters.slope * (elapsed - delay / 2) * delay
    return np.exp(2j * np.pi * cycles)


def noise(shape: tuple[int, ...], *, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return (random.normal(size=shape) + 1j * random.normal(size=shape)) / np.sqrt(2)


@pytest.mark.parametrize("device", ["xwr14xx", "xwr16xx"])
@pytest.mark.parametrize(
    ("distance", "range_rate", "azimuth"),
    [(20.0, 3.0, 0.3), (20.0, -3.0, 0.3), (23.7, 6.5, -0.8), (8.2, 0.0, 0.0), (12.3, -7.2, 0.9)],
)
def test_a_point_is_found_at_its_range_speed_and_azimuth(
    tmp_path: Path, device, distance: float, range_rate: float, azimuth: float
):
    """A point 6 dB below the noise of a sample: 1024 samples × 8 channels raise it by 48 dB.

    The interpolation is good to 1 % of a cell, and noise at more than 35 dB to 1 % as well: 2 cm
    of 0.23 m, 5 mm/s of 0.25 m/s, doubled. Eight elements at 35 dB measure an azimuth to
    √(6/(8·63·3000·…)) < 0.002 of a sine; the wave front's bend over the array at 8 m adds less
    than 1e-3, and at sin 0.9 the arcsine widens both 1.6 times.
    """
    parameters = replace(PARAMETERS, device=device)
    echo = point_echo(parameters, distance=distance, range_rate=range_rate, azimuth=azimuth)
    path = tmp_path / "point.bin"
    samples = 2000.0 * (0.5 * echo + noise(echo.shape, seed=1))
    write_raw(path, [samples], device=device, is_complex=True)
    frame = open_raw(path, parameters).frame(0)
    receiver = RangeDoppler(greatest_range=parameters.greatest_range, false_alarm_probability=1e-7)
    found = receiver.detect(frame)
    assert found.num_detections == 1
    assert found.range[0] == pytest.approx(distance, abs=0.01)
    assert found.range_rate[0] == pytest.approx(range_rate, abs=0.01)
    assert found.azimuth[0] == pytest.approx(azimuth, abs=0.006)
    assert found.power[0] == pytest.approx((1000.0 / 32768.0) ** 2, rel=0.11)


def test_without_compensation_the_moving_point_would_be_elsewhere():
    """The transmitters' turn costs a phase of 2π f_d T between halves of the array.

    At 7 m/s and 60 µs that is 2π · 2 · 7/λ · 60e-6 = 1.36 rad: read as one array, the azimuth of
    a point straight ahead would be off by some degrees. With compensation it is not.
    """
    echo = point_echo(PARAMETERS, distance=20.0, range_rate=7.0, azimuth=0.0)
    frame = IfFrame(
        samples=echo + 0.1 * noise(echo.shape, seed=2),
        times=PARAMETERS.times,
        schedule=PARAMETERS.schedule,
        array=PARAMETERS.array,
    )
    receiver = RangeDoppler(greatest_range=60.0, false_alarm_probability=1e-7)
    spectra = receiver.spectra(frame)
    row, column = np.unravel_index(np.argmax(spectra.mean_power.power), spectra.amplitude.shape[1:])
    phase = np.angle(spectra.amplitude[:, row, column]).reshape(4, 2)  # (channel, turn)
    late = 4 * np.pi * 7.0 * 60e-6 * PARAMETERS.middle_frequency / SPEED_OF_LIGHT
    np.testing.assert_allclose(phase[:, 1] - phase[:, 0], late, atol=0.1)
    assert receiver.detect_in(spectra, frame).azimuth[0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("azimuth", [0.0, 0.4, -0.7])
@pytest.mark.parametrize(("share", "expected"), [(0.7, 0.7), (-0.9, -0.9), (1.3, -0.7)])
def test_a_point_faster_than_the_span_of_its_turns_is_unfolded_by_its_beam(
    share: float, expected: float, azimuth: float
):
    """Two transmitters in turns leave two range rates, a span apart; beyond, rates repeat."""
    span = PARAMETERS.speed_span
    assert span == pytest.approx(SPEED_OF_LIGHT / PARAMETERS.middle_frequency / (4 * 60e-6))
    echo = point_echo(PARAMETERS, distance=20.0, range_rate=share * span, azimuth=azimuth)
    frame = IfFrame(
        samples=echo + noise(echo.shape, seed=3),
        times=PARAMETERS.times,
        schedule=PARAMETERS.schedule,
        array=PARAMETERS.array,
    )
    receiver = RangeDoppler(greatest_range=60.0, false_alarm_probability=1e-7)
    found = receiver.detect(frame)
    assert found.range_rate[0] == pytest.approx(expected * span, abs=0.02)
    assert found.azimuth[0] == pytest.approx(azimuth, abs=0.01)


def test_a_short_frame_takes_a_smaller_window():
    """Eight sweeps of two transmitters make 8 rows, less than the receiver's usual window."""
    parameters = replace(PARAMETERS, num_ramps=16)
    echo = point_echo(PARAMETERS, distance=20.0, range_rate=0.0, azimuth=0.2)[:, :16]
    frame = IfFrame(
        samples=3.0 * echo + noise(echo.shape, seed=4),
        times=parameters.times,
        schedule=parameters.schedule,
        array=parameters.array,
    )
    receiver = RangeDoppler(greatest_range=60.0, false_alarm_probability=1e-4)
    assert receiver.detect(frame).range[0] == pytest.approx(20.0, abs=0.02)


@pytest.mark.parametrize("num_transmitters", [1, 2])
@pytest.mark.parametrize("probability", [1e-2, 1e-3])
def test_tapered_noise_crosses_as_often_as_stated_within_a_quarter(num_transmitters, probability):
    """Training cells two apart have the correlation 0.06 under the taper, of power 0.25².

    So the N cells count as some N/(1 + 2·0.06)² = 0.8 N independent ones, which at N ≥ 60 moves
    probabilities of 1e-3 by 15 % (by the law for means, (1 + α/N)^−N). The interval is the binomial
    one around ± 25 %, its width doubled because crossings come in groups of neighbours.
    """
    parameters = replace(PARAMETERS, num_transmitters=num_transmitters)
    receiver = RangeDoppler(greatest_range=1e4, false_alarm_probability=probability)
    crossings = cells = 0
    for seed in range(6):
        frame = IfFrame(
            samples=noise((4, 128, 128), seed=seed),
            times=parameters.times,
            schedule=parameters.schedule,
            array=parameters.array,
        )
        power = receiver.spectra(frame).mean_power.power
        found = ordered_statistic(
            power,
            window=receiver.training(frame.schedule),
            quantile=receiver.quantile,
            false_alarm_probability=probability,
            num_looks=4 * num_transmitters,
        )
        crossings += found.row.size
        cells += power.size
    slack = 2 * np.sqrt(binom.var(cells, probability)) * 3
    assert 0.75 * cells * probability - slack <= crossings <= 1.25 * cells * probability + slack

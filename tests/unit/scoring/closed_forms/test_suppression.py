"""Suppression by processing in phase, against sums over the instantaneous frequencies."""

from __future__ import annotations

import numpy as np
import pytest

from polychirp.scoring.closed_forms.suppression import (
    floor_of_crossings,
    suppression,
    suppression_of_chirps,
    suppression_of_slow_ramp,
    suppression_of_tone,
)

BAND = 20e6
"""Hz, of complex samples."""


def dwell(own, other, frame, *, points=4_000_000):
    """Time, s, in which the difference of two frequencies is within half the band."""
    time = (np.arange(points) + 0.5) * frame / points
    return np.mean(np.abs(own(time) - other(time)) < 0.5 * BAND) * frame


def chirps(bandwidth, duration, *, late=0.0):
    return lambda time: bandwidth * (((time - late) / duration) % 1.0)


def test_a_slow_ramp_is_suppressed_by_the_time_that_it_is_in_the_band():
    """One ramp crosses the other in the middle, of 1 GHz in 1 ms."""
    frame = 1e-3
    other = lambda time: 0.5e9 + 1.3e12 * (time - 0.5 * frame)  # noqa: E731
    measured = suppression(frame=frame, dwell=dwell(chirps(1e9, frame), other, frame), band=BAND)
    form = suppression_of_slow_ramp(bandwidth=1e9, frame=frame, slope_ratio=1.3)
    assert measured == pytest.approx(form, rel=1e-3)


@pytest.mark.parametrize("ratio", [1.004, 0.99, 1.0331])
def test_chirps_are_suppressed_by_the_time_that_they_are_in_the_band(ratio, compare):
    """Over random starts the mean time in the band is that without the ceiling.

    Each start has as many crossings as the ceiling says, or one less. Chirps are 100 times as long
    as the band at the chirp's slope, and so at the ends of both sequences a part of a crossing is
    on the other side of the band; the tolerance is that part.
    """
    bandwidth, duration, count = 2e9, 20e-6, 250
    frame = count * duration
    starts = np.random.default_rng(1).uniform(size=24) * duration / ratio
    dwells = [
        dwell(chirps(bandwidth, duration), chirps(bandwidth, duration / ratio, late=s), frame)
        for s in starts
    ]
    ceiling = suppression_of_chirps(
        bandwidth=bandwidth, frame=frame, slope_ratio=ratio, num_chirps=count
    )
    turns = count * abs(ratio - 1.0)
    without = ceiling * np.ceil(turns - 1e-6) / turns
    assert without == pytest.approx(bandwidth * frame)
    mean = suppression(frame=frame, dwell=float(np.mean(dwells)), band=BAND)
    compare(
        page="closed-forms",
        case=f"250 chirps, slopes as {ratio:g} to 1",
        quantity="suppression of chirps over B·T_CPI, mean over starts, dB",
        expected=0.0,
        measured=10 * np.log10(mean / without),
        tolerance=0.3,
        source="sum of the time in the band",
    )
    least = suppression(frame=frame, dwell=max(dwells), band=BAND)
    assert 10 * np.log10(least / ceiling) == pytest.approx(0.0, abs=0.3)


def test_a_tone_in_a_sequence_is_a_line_with_the_mean_of_its_form():
    """Line of 64 chirps by its sum: a tone of power 1 against a target of power 1."""
    bandwidth, duration, rate = 500e6, 20e-6, 25e6
    time = np.arange(round(duration * rate)) / rate
    slope = bandwidth / duration
    beat = slope * (time - 0.47 * duration)
    crossing = np.exp(1j * np.pi * slope * (time - 0.47 * duration) ** 2)
    crossing *= np.abs(beat) < 0.5 * rate
    line = np.abs(np.fft.fft(crossing)) ** 2 / time.size**2  # equal on all chirps, in phase
    form = suppression_of_tone(bandwidth=bandwidth, duration=duration)
    assert 1.0 / line.mean() == pytest.approx(form, rel=0.05)
    assert line.max() > 1.1 * line.mean()


def test_the_floor_is_the_mean_of_a_spectrum_with_a_crossing():
    """A crossing of 3 W in the middle of a chirp; the spectrum of a tone has its power as peak."""
    duration, rate, slope = 20e-6, 25e6, 15e12
    time = (np.arange(round(duration * rate)) - 250) / rate
    crossing = np.sqrt(3.0) * np.exp(1j * np.pi * slope * time**2)
    crossing *= np.abs(slope * time) < 0.5 * rate
    floor = np.mean(np.abs(np.fft.fft(crossing) / time.size) ** 2)
    form = floor_of_crossings([1.0, 2.0], dwell=rate / slope, duration=duration, band=rate)
    assert form == pytest.approx(floor, rel=0.05)

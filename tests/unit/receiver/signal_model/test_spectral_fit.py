"""Points fitted in the frequency domain, against the same fit over samples."""

import numpy as np
import pytest

from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.signal_model.point_signal import (
    beat_phase,
    fit_amplitudes,
    hann_weights,
)
from polychirp.receiver.signal_model.spectral_fit import (
    Band,
    _factorize,
    _smooth_below,
    _solve,
    band_of,
)
from polychirp.rng import Streams
from polychirp.waveform import DiverseTriangular
from tests.support.kernels import callable_from_python
from tests.support.points import HandPoint, frame_of
from tests.support.references.receiver import beat_errors

RAMPS = DiverseTriangular().schedule(num_sweeps=4, streams=Streams(3))
TIMES = sample_times(RAMPS, Converter())
POINTS = [
    HandPoint(range=5.0, range_rate=12.0, power=3e4),
    HandPoint(range=9.0, range_rate=-30.0, power=1e3),
    HandPoint(range=9.4, range_rate=-29.0, power=1e3),
    HandPoint(range=24.0, range_rate=25.0, power=10.0),
]
MOTION = np.array([[p.range, p.range_rate, 0.0] for p in POINTS])
SILENCE = np.full(RAMPS.num_ramps, 1e-6)


def band(present) -> Band:
    far = 2.0 * RAMPS.slope * 30.0 / 3e8
    lowest, highest = np.minimum(far, 0.0) - 2e4, np.maximum(far, 0.0) + 2e4
    return band_of(present, TIMES, lowest=lowest, highest=highest)


def holed(first, last):
    present = TIMES.is_sample.copy()
    present[:, first:last] = False
    return present


@pytest.mark.parametrize("present", [TIMES.is_sample, holed(400, 440)], ids=["whole", "holed"])
def test_the_fit_in_the_band_is_the_fit_over_samples(present):
    """Both are exact for a sum of points; 35 dB between them, two a few cells apart.

    What is left, of 3e4 in power, is the series' end, the table's interpolation and the ridge:
    −100 dB each.
    """
    frame = frame_of(RAMPS, POINTS, noise=0.0)
    phases = beat_phase(RAMPS, TIMES, motion=MOTION, time=0.0)
    own = band(present)
    spectra = own.spectra(frame.samples * present)
    fast, residual = own.fit(spectra, phases, SILENCE)
    slow, _ = fit_amplitudes(frame.samples * present, hann_weights(present), phases, TIMES.rate)
    strongest = np.abs(slow).max()
    assert np.abs(fast - slow).max() < 1e-5 * strongest
    assert np.abs(residual).max() < 1e-5 * np.abs(spectra).max()


@pytest.mark.parametrize("present", [TIMES.is_sample, holed(400, 440)], ids=["whole", "holed"])
def test_points_of_known_amplitudes_are_taken_out_as_from_samples(present):
    """−100 dB as above: as if they had not been in the samples."""
    phases = beat_phase(RAMPS, TIMES, motion=MOTION, time=0.0)
    own = band(present)
    frame = frame_of(RAMPS, POINTS, noise=0.0)
    amplitude, _ = fit_amplitudes(
        frame.samples * present, hann_weights(present), phases, TIMES.rate
    )
    spectra = own.spectra(frame.samples * present)
    left = own.subtract(spectra, phases, amplitude)
    assert np.abs(left).max() < 1e-5 * np.abs(spectra).max()
    again = own.subtract(left, phases, -amplitude)
    assert np.abs(again - spectra).max() < 1e-12 * np.abs(spectra).max()


@pytest.mark.parametrize("present", [TIMES.is_sample, holed(400, 440)], ids=["whole", "holed"])
def test_a_match_is_the_fit_of_a_point_alone(present):
    frame = frame_of(RAMPS, POINTS, seed=3)
    phases = beat_phase(RAMPS, TIMES, motion=MOTION, time=0.0)
    own = band(present)
    spectra = own.spectra(frame.samples * present)
    matched = own.match(spectra, phases)
    for p in range(len(POINTS)):
        # without its second pass, which asks for nothing more of one point
        alone, _ = own.fit(spectra, phases[p : p + 1], SILENCE)
        assert np.abs(matched[p] - alone[0]).max() < 1e-6 * np.abs(matched).max()


def test_a_wrong_beat_is_read_off_the_residual_as_over_samples():
    """20 Hz of a cell of 500 to 1000: first order, less what Hann's window bends, 3 %."""
    frame = frame_of(RAMPS, POINTS[:1], noise=0.0)
    phases = beat_phase(RAMPS, TIMES, motion=MOTION[:1], time=0.0)
    phases[..., 1] -= 20.0
    own = band(TIMES.is_sample)
    amplitude, residual = own.fit(own.spectra(frame.samples), phases, SILENCE)
    errors = own.beat_errors(residual, phases, amplitude)
    weight = hann_weights(TIMES.is_sample)
    slow, left = fit_amplitudes(frame.samples, weight, phases, TIMES.rate)
    twin = beat_errors(left, weight, phases, slow, TIMES.rate)
    assert errors == pytest.approx(20.0, rel=0.03)
    assert errors == pytest.approx(twin, rel=0.03)


def test_side_lobes_below_the_noise_are_not_removed():
    """A tenth of the noise's rms at most, and much less work."""
    frame = frame_of(RAMPS, POINTS[:1], noise=0.0)
    own = band(TIMES.is_sample)
    phases = beat_phase(RAMPS, TIMES, motion=MOTION[:1], time=0.0)
    _, residual = own.fit(own.spectra(frame.samples), phases, np.ones(RAMPS.num_ramps))
    left = np.hypot(*residual)
    assert 1e-4 < left.max() < 0.1


def test_white_noise_keeps_its_power_in_the_band():
    frame = frame_of(RAMPS, [], noise=4.0)
    power = np.sum(band(TIMES.is_sample).spectra(frame.samples) ** 2, axis=0)
    cells = power.size / 3.0  # two bins to a cell, Hann's window one and a half
    assert power.mean() == pytest.approx(4.0, rel=4.0 / np.sqrt(cells))


def test_transforms_have_lengths_that_are_quick():
    assert [_smooth_below(n) for n in (2, 7, 976, 1023, 1999)] == [2, 6, 972, 1000, 1944]


@pytest.mark.parametrize("size", [1, 2, 7, 30])
def test_linear_equations_are_solved_as_lapack_solves_them(size):
    """Rows are exchanged where an element of the diagonal is zero."""
    draw = np.random.default_rng(size)
    matrix, right = (
        draw.normal(size=(size, n)) + 1j * draw.normal(size=(size, n)) for n in (size, 3)
    )
    if size > 1:
        matrix[0, 0] = 0.0
    expected = np.linalg.solve(matrix, right)
    factors, order = matrix.copy(), np.zeros(size, dtype=np.int64)
    callable_from_python(_factorize)(factors, order)
    found = callable_from_python(_solve)(factors, order, right)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)

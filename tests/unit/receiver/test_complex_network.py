"""The complex network of the mitigation library, beside a slow way to apply its layers."""

import numpy as np
import pytest

from polychirp.errors import CapabilityError
from polychirp.receiver.mitigation import ComplexNetwork
from polychirp.receiver.mitigation.complex_network import compressed_planes, trained
from polychirp.receiver.mitigation.network_layers import SPREADS, logits
from polychirp.rng import Streams
from polychirp.study.mitigation.hand_frames import ChirpSequence, hand_frame
from polychirp.study.mitigation.published import tu_delft, with_disturbance
from polychirp.units import from_db


def convolved_slowly(x, kernel, spread):
    """Sums over all cells of a kernel, one by one; ``(in, frequency, slice)``."""
    rows, slices = x.shape[1:]
    out = np.zeros((len(kernel), rows, slices), dtype=complex)
    for place in np.ndindex(out.shape):
        n, row, k = place
        for i in range(len(x)):
            for a in (-1, 0, 1):
                for b in (-1, 0, 1):
                    at = k + spread * b
                    if 0 <= at < slices:
                        cell = x[i, (row + a) % rows, at]
                        out[place] += kernel[n, i, 3 * (a + 1) + b + 1] * cell
    return out


def logits_slowly(network, plane):
    x = plane[None]
    for n, kernel in enumerate(network.kernels):
        x = convolved_slowly(x, kernel, SPREADS[n])
        if n < len(network.biases):
            modulus = np.maximum(np.abs(x), 1e-12)
            x = x / modulus * np.maximum(modulus + network.biases[n][:, None, None], 0.0)
    return convolved_slowly(np.abs(x), network.readout, 1)[0].real + network.offset


def drawn_ramp(number=0):
    return tu_delft(Streams(9).of("network test", number))[:2]


def short_frame():
    victim = ChirpSequence(start_frequency=77e9, slope=1e13, num_ramps=2, interval=20e-6)
    return hand_frame(
        victim,
        num_samples=20,
        sample_rate=2e6,
        targets=[],
        interferers=[],
        noise=1.0,
        streams=Streams(0),
    )[0]


def test_the_layers_are_sums_over_neighbours():
    network, _ = trained()
    frame, _ = drawn_ramp()
    plane = compressed_planes(frame.samples[0, :, 1000:1100])[0]
    found = logits(network, plane[None])[0]
    assert found == pytest.approx(logits_slowly(network, plane), rel=1e-4, abs=1e-4)


def test_the_network_is_small_and_says_what_it_was_trained_on():
    network, trained_on = trained()
    assert 1600 <= network.num_weights <= 10_000
    assert "set v2" in trained_on


def test_neither_units_nor_a_common_phase_matter():
    frame, _ = drawn_ramp()
    plain = ComplexNetwork().lost(frame.samples[:, 0])
    turned = ComplexNetwork().lost(1e-6 * np.exp(1.3j) * frame.samples[:, 0])
    # 32-bit rounding moves few cells across the border beyond which they are kept
    assert np.mean(plain != turned) < 1e-3


def test_a_burst_that_no_training_frame_has_loses_most_of_its_power():
    """Signals of TU Delft of streams that are neither trained on nor in the benchmark."""
    for number in range(4):
        frame, parts = with_disturbance(*drawn_ramp(number), sinr=from_db(-12.7))
        cleaned = ComplexNetwork().mitigate(frame)
        before, after = (
            np.mean(np.abs(x) ** 2)
            for x in (parts.interference, cleaned.repair(parts.interference))
        )
        assert after < 0.1 * before


def test_echoes_under_a_burst_come_back():
    """Zeroed instead of filled, the masked cells alone would cost 5 % of a target and more."""
    for number in range(4):
        frame, parts = with_disturbance(*drawn_ramp(number), sinr=from_db(-12.7))
        left = ComplexNetwork().mitigate(frame).repair(parts.echo)
        spectrum, kept = (
            np.abs(np.fft.fft(x[0, 0] * np.hanning(4160))) for x in (parts.echo, left)
        )
        assert kept[spectrum.argmax()] == pytest.approx(spectrum.max(), rel=0.03)


def test_real_samples_stay_real():
    frame, _ = drawn_ramp()
    cleaned = ComplexNetwork().mitigate(frame.with_samples(2.0 * frame.samples.real))
    scale = np.abs(frame.samples).max()
    assert np.abs(cleaned.samples.imag).max() < 1e-9 * scale
    assert not np.allclose(cleaned.samples, 2.0 * frame.samples.real)


def test_ramps_that_are_too_short_are_refused():
    with pytest.raises(CapabilityError, match="windows of 32 samples"):
        ComplexNetwork().mitigate(short_frame())

"""Measures of mitigation on frames whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.receiver.mitigation.base import mitigated, with_weights
from polychirp.rng import Streams
from polychirp.study.mitigation.hand_frames import (
    Butterworth,
    ChirpSequence,
    HandInterferer,
    HandTarget,
    hand_frame,
)
from polychirp.study.mitigation.measures import (
    local_maxima,
    measured_frame,
    measures,
    range_rate_map,
)
from polychirp.study.mitigation.published import toth

VICTIM = ChirpSequence(start_frequency=77e9, slope=2e13, num_ramps=32, interval=30e-6)
OTHER = ChirpSequence(start_frequency=77.1e9, slope=1e13, num_ramps=32, interval=31e-6)


def made(*, amplitude=30.0, interferers=1):
    """A frame of 32 chirps with one target of 20 dB per sample."""
    return hand_frame(
        VICTIM,
        num_samples=256,
        sample_rate=10e6,
        targets=[HandTarget(range=15.0, range_rate=4.0, amplitude=10.0)],
        interferers=[HandInterferer(chirps=OTHER, start=0.0, amplitude=amplitude)] * interferers,
        noise=1.0,
        streams=Streams(3),
    )


def test_a_chirps_beat_is_the_derivative_of_its_phase():
    time = np.arange(2000) / 50e6
    cycles = OTHER.beat_cycles(VICTIM, -7e-6, time)
    beat = OTHER.beat(VICTIM, -7e-6, time)
    slope = np.diff(cycles, axis=1) * 50e6
    middle = 0.5 * (beat[:, 1:] + beat[:, :-1])
    inside = np.abs(np.diff(beat, axis=1)) < 1e6  # away from the starts of its chirps
    assert np.abs(slope - middle)[inside].max() < 1.0


def test_the_target_has_its_beat_and_the_parts_sum_to_the_frame():
    frame, parts = made()
    assert np.allclose(parts.samples.sum(axis=0), frame.samples)
    spectrum = np.abs(np.fft.fft(parts.echo[0, 0]))
    beat = 2 * 2e13 * 15.0 / 299_792_458.0
    assert spectrum.argmax() == round(beat / 10e6 * 256)


def test_the_clean_frame_has_no_error_and_the_snr_of_its_coherent_gain():
    """100 times 8192 samples over two Hann windows' noise bandwidth of 1.5 each: 55.6 dB at the
    peak; the mean of five cells of a Hann lobe (1 + 2/4) is 0.3 of it, −5.2 dB."""
    frame, parts = made(interferers=0)
    on = measured_frame(frame, parts)
    found = measures(on, mitigated(None, on.clean))
    assert len(on.objects) == 1
    expected = 10 * np.log10(100.0 * 8192 / 2.25 * 0.3)
    assert found["sinr_range"] == pytest.approx(expected, abs=1.5)
    assert found["sinr_velocity"] == pytest.approx(expected, abs=2.5)
    for name in ("evm", "phase_error", "floor_rise", "ghosts", "missed", "lost"):
        assert found[name] == pytest.approx(0.0, abs=1e-12)
    assert found["detection"] == 1.0


def test_interference_raises_the_floor_by_its_power():
    """Its mean power under the squares of both windows, as it spreads over all cells alike."""
    frame, parts = made()
    on = measured_frame(frame, parts)
    found = measures(on, mitigated(None, frame))
    hann = [np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 4 for n in (32, 256)]
    weight = np.outer(*hann) / np.outer(*hann).sum()
    rise = 10 * np.log10(1.0 + np.sum(weight * np.abs(parts.interference[0]) ** 2))
    assert found["floor_rise"] == pytest.approx(rise, abs=1.5)
    assert found["sinr_range"] < 45.0
    assert found["ghosts"] > 0


def test_a_lost_half_of_the_samples_halves_the_amplitude():
    """EVM 1/2 without phase error; all ramps lose the same samples."""
    frame, parts = made(interferers=0)
    on = measured_frame(frame, parts)
    weight = np.ones((32, 256))
    weight[:, ::2] = 0.0
    found = measures(on, with_weights(on.clean, weight))
    assert found["evm"] == pytest.approx(0.5, abs=0.01)
    assert found["phase_error"] < 0.01
    assert found["lost"] == 0.5


@pytest.mark.parametrize(("rate", "beat"), [(0, 60), (1, 60), (31, 60), (16, 1), (16, 127)])
def test_a_cell_at_the_end_of_a_cut_has_the_sinr_of_any_other(rate, beat):
    """The lobe of a Hann window, (1 + 2/4) of its peak over five cells, wraps over rates.

    Cut off at the ends it would be (1 + 1/4) over three cells, 1.4 dB too much. Of 20 frames, the
    mean of the cuts' noise is known to 0.2 dB.
    """
    draw = np.random.default_rng(8)
    frame, parts = made(interferers=0)
    place = np.arange(256)

    def sinr(rate, beat):
        turns = rate * np.arange(32)[:, None] / 32 + beat * place / 256
        echo = 10.0 * np.exp(2j * np.pi * turns)[None]
        found = []
        for _ in range(20):
            noise = draw.normal(size=(2, *echo.shape))
            own = np.stack([echo, 0 * echo, noise[0] + 1j * noise[1]])
            one = replace(parts, samples=own)
            on = measured_frame(frame.with_samples(own.sum(axis=0)), one)
            assert on.objects.tolist() == [[rate, beat - 1]]
            found.append(measures(on, mitigated(None, on.clean)))
        return [np.mean([one[name] for one in found]) for name in ("sinr_range", "sinr_velocity")]

    assert sinr(rate, beat) == pytest.approx(sinr(16, 60), abs=0.6)


def test_local_maxima_wrap_over_range_rate_and_not_over_range():
    power = np.zeros((4, 5))
    power[0, 2], power[3, 2], power[1, 0], power[1, 4] = 2.0, 3.0, 1.0, 1.0
    peaks = local_maxima(power, has_rates=True)
    assert peaks[3, 2]
    assert not peaks[0, 2]
    assert peaks[1, 0]
    assert peaks[1, 4]


def test_equal_streams_give_equal_frames_and_the_interferers_cross():
    first, parts, _ = toth(Streams(4), num_ramps=8)
    second, _, _ = toth(Streams(4), num_ramps=8)
    assert np.array_equal(first.samples, second.samples)
    share = np.mean(np.abs(parts.interference) > 0)
    assert 0.0 < share < 0.5


def test_a_filtered_burst_follows_the_gain_at_its_frequency():
    """A slow crossing has the gain of order 9 at its beat, (1 + (f/f_c)¹⁸)^(−1/2).

    The beat changes by 0.4 MHz/µs, a fortieth of the cutoff within the filter's response of some
    0.3 µs. The filter rings for two microseconds after the interferer's chirp begins.
    """
    slow = ChirpSequence(start_frequency=77.0e9, slope=1.96e13, num_ramps=1, interval=60e-6)
    victim = ChirpSequence(start_frequency=76.99e9, slope=2e13, num_ramps=1, interval=60e-6)
    _, parts = hand_frame(
        victim,
        num_samples=1000,
        sample_rate=20e6,
        targets=[],
        interferers=[HandInterferer(chirps=slow, start=0.0, amplitude=1.0)],
        noise=1.0,
        streams=Streams(1),
        filtering=Butterworth(order=9, cutoff=5e6),
    )
    beat = slow.beat(victim, 0.0, np.arange(1000) / 20e6)[0]
    gain = (1.0 + (np.abs(beat) / 5e6) ** 18) ** -0.5
    found = np.abs(parts["direct"][0, 0])
    inside, outside = np.abs(beat) < 4e6, np.abs(beat) > 7e6
    assert found[inside] == pytest.approx(gain[inside], abs=0.03)
    assert found[40:][outside[40:]].max() < 0.1
    assert outside[40:].any()


def test_the_whole_band_holds_an_echo_above_half_the_sample_rate():
    """2 b R/c is 0.7 of the sample rate; a map up to half of it has no object, and a method that
    removes the echo goes unpunished."""
    beat = 0.7 * 10e6
    frame, parts = hand_frame(
        VICTIM,
        num_samples=256,
        sample_rate=10e6,
        targets=[HandTarget(range=beat * 299_792_458.0 / (2 * 2e13), amplitude=10.0)],
        interferers=[],
        noise=1.0,
        streams=Streams(3),
    )
    assert len(measured_frame(frame, parts).objects) == 0
    on = measured_frame(frame, parts, whole_band=True)
    assert on.objects.tolist() == [[0, round(0.7 * 256) - 1]]
    assert measures(on, mitigated(None, on.clean))["detection"] == 1.0
    silent = on.clean.with_samples(parts.noise)
    assert measures(on, mitigated(None, silent))["evm"] == pytest.approx(1.0, abs=0.01)


def test_unequal_ramps_have_a_row_each_with_their_own_beat():
    """A target at 2 b R/c on ramps of two slopes, and on the other side of zero if they fall."""
    frame, parts = made(interferers=0)
    slope = np.where(np.arange(32) % 2 == 0, 2e13, -2e13)
    turned = replace(frame.schedule, slope=slope)
    beats = 0.25 * np.arange(256)
    samples = 10.0 * np.exp(1j * np.sign(slope)[:, None] * beats)[None]
    other = replace(frame, schedule=turned, samples=samples)
    found = range_rate_map(other, samples)
    assert found.shape == (1, 32, 127)
    expected = round(0.25 / (2 * np.pi) * 256) - 1
    assert np.all(np.abs(found[0]).argmax(axis=1) == expected)
    on = measured_frame(
        other, replace(parts, samples=np.stack([samples, 0 * samples, parts.noise]))
    )
    assert len(on.objects) == 32
    clean = measures(on, mitigated(None, on.clean))
    assert np.isnan(clean["sinr_velocity"])
    assert clean["detection"] == 1.0

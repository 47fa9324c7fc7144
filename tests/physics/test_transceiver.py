"""The transceiver model, effect by effect, against theory."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch

from polychirp.constants import BOLTZMANN, REFERENCE_TEMPERATURE
from polychirp.correlation.base import correlate
from polychirp.correlation.lobes import lobes
from polychirp.errors import InputError, PhysicsError
from polychirp.model.baseband import Baseband
from polychirp.model.front_end import Digitiser, IqImbalance
from polychirp.model.oscillator import PhaseNoise
from polychirp.model.transceiver import Link, Transceiver
from polychirp.rng import Streams
from polychirp.synthesis.sdr.transceiver import MARGIN_SAMPLES, link_for, transceived
from polychirp.units import from_db, to_db
from polychirp.waveform import Sawtooth
from polychirp.waveform.playing import played
from tests.support.front_end import image_rejection

IDEAL = Transceiver.ideal()
USUAL = Transceiver()
RATE = IDEAL.sample_rate
CARRIER = 4e9
COUNT = 13_000
STREAMS = Streams(seed=1)
STRAIGHT = Link(attenuation=1.0)


def tone(frequency, *, carrier=CARRIER, count=COUNT):
    """A whole number of periods, with its rise and fall smoothed away."""
    time = np.arange(count) / RATE
    rise = np.clip(np.minimum(time, time[::-1]) / 1e-6, 0.0, 1.0)
    return Baseband(
        samples=np.exp(2j * np.pi * frequency * time) * np.sin(0.5 * np.pi * rise) ** 2,
        sample_rate=RATE,
        centre_frequency=carrier,
    )


def chirp(bandwidth=100e6, carrier=CARRIER):
    wave = Sawtooth(
        start_frequency=carrier - bandwidth / 2, bandwidth=bandwidth, ramp_duration=100e-6
    )
    return played(
        wave.schedule(num_sweeps=1, streams=STREAMS), sample_rate=RATE, centre_frequency=carrier
    )


def through(signal, transmitter=IDEAL, receiver=IDEAL, link=STRAIGHT, *, tuned=CARRIER, seed=1):
    return transceived(
        signal,
        transmitter=transmitter,
        receiver=receiver,
        link=link,
        receive_frequency=tuned,
        streams=Streams(seed),
    )


def amplitude(record, frequency):
    """Of a tone in the middle of a record, V."""
    time = record.time
    inside = (time > 10e-6) & (time < 90e-6)
    turned = record.samples[inside] * np.exp(-2j * np.pi * frequency * time[inside])
    window = np.hanning(turned.size)
    return complex(turned @ window / window.sum())


def test_with_every_effect_off_samples_come_back_as_they_were():
    """But for what is at exactly half the sample rate, which no filter can pass."""
    signal = tone(20e6)
    record = through(signal, replace(IDEAL, transmit_power=1.0))
    inside = (record.time >= 0) & (record.time < signal.duration - 1e-12)
    np.testing.assert_allclose(record.samples[inside], signal.samples, atol=1e-7)
    assert np.abs(record.samples[~inside]).max() < 1e-3


def test_power_and_attenuation_are_as_told(compare):
    record = through(tone(10e6), replace(IDEAL, transmit_power=0.01), link=Link(attenuation=1e5))
    assert abs(amplitude(record, 10e6)) ** 2 == pytest.approx(1e-7, rel=1e-6)


@pytest.mark.parametrize("noise_figure", [1.0, from_db(8.0)])
def test_noise_has_the_power_of_its_band(noise_figure, compare):
    """k T₀ F B, B of the filter; 13 000 samples, of which 12 of 13 are independent: 0.04 dB rms."""
    receiver = replace(USUAL, noise_figure=noise_figure, phase_noise=None, converter=None)
    record = through(tone(1e6), IDEAL, receiver, Link(attenuation=1e30))
    power = BOLTZMANN * REFERENCE_TEMPERATURE * noise_figure * receiver.filter.noise_bandwidth
    compare(
        page="correlation",
        case=f"noise figure {float(to_db(noise_figure)):g} dB",
        quantity="noise of the transceiver, dBm",
        expected=float(to_db(power)) + 30,
        measured=float(to_db(record.power)) + 30,
        tolerance=0.16,
        source="k T₀ F B",
    )
    assert receiver.noise_power == pytest.approx(power)


def test_without_a_filter_noise_has_the_band_of_the_converter():
    receiver = replace(IDEAL, noise_figure=2.0)
    record = through(tone(1e6), IDEAL, receiver, Link(attenuation=1e30))
    power = BOLTZMANN * REFERENCE_TEMPERATURE * 2.0 * RATE
    assert float(to_db(record.power / power)) == pytest.approx(0.0, abs=0.16)


@pytest.mark.parametrize("snr", [from_db(30.0), 10.0, 1.0])
def test_a_link_for_an_snr_gives_it(snr):
    """Power behind the filter with noise over that without: signal and noise are independent."""
    signal = chirp()
    link = link_for(snr, signal, transmitter=USUAL, receiver=USUAL)
    quiet = replace(USUAL, noise_figure=None, converter=None)
    alone = through(signal, USUAL, quiet, link)
    assert alone.energy / signal.duration / USUAL.noise_power == pytest.approx(snr, rel=1e-3)


@pytest.mark.parametrize("place", ["transmitter", "receiver"])
def test_an_image_is_as_weak_as_the_imbalance_says(place, compare):
    imbalance = IqImbalance(gain=from_db(0.5), phase=math.radians(2.0))
    radios = {"transmitter": IDEAL, "receiver": IDEAL}
    radios[place] = replace(IDEAL, imbalance=imbalance)
    record = through(tone(20e6), **radios)
    compare(
        page="correlation",
        case=f"0.5 dB and 2°, {place}",
        quantity="image rejection of the transceiver, dB",
        expected=float(to_db(image_rejection(imbalance))),
        measured=float(to_db(abs(amplitude(record, 20e6) / amplitude(record, -20e6)) ** 2)),
        tolerance=0.01,
        source="|α/β|²",
    )


@pytest.mark.parametrize("bits", [8, 12, 14])
@pytest.mark.parametrize("place", ["transmitter", "receiver"])
def test_quantising_has_its_signal_to_noise_ratio(bits, place, compare):
    """6.02 b + 1.76 dB of a full-scale tone; one that shares no period with the samples."""
    time = np.arange(COUNT) / RATE
    full = Baseband(
        samples=0.99 * np.exp(2j * np.pi * 13.7183e6 * time),
        sample_rate=RATE,
        centre_frequency=CARRIER,
    )
    radios = {"transmitter": replace(IDEAL, transmit_power=1.0), "receiver": IDEAL}
    exact = through(full, **radios)
    change = (
        {"transmit_bits": bits}
        if place == "transmitter"
        else {"converter": Digitiser(full_scale=1.0, bits=bits)}
    )
    radios[place] = replace(radios[place], **change)
    error = through(full, **radios).samples - exact.samples
    # at the ends the ideal filter overshoots
    middle = slice(1000, 12_000)
    compare(
        page="correlation",
        case=f"{bits} bits, {place}",
        quantity="SNR of quantisation, dB",
        expected=6.0206 * bits + 1.7609,
        measured=float(to_db(1.0 / np.mean(np.abs(error[middle]) ** 2))),
        tolerance=0.25,
        source="6.02 b + 1.76 dB",
    )


@pytest.mark.parametrize("frequency", [1e6, 30e6, 50e6])
def test_holding_samples_droops_like_a_sinc(frequency):
    """And leaves its delay of half a sample out."""
    held = replace(IDEAL, hold=1.0, transmit_power=1.0)
    got = amplitude(through(tone(frequency), held), frequency)
    assert got == pytest.approx(np.sinc(frequency / RATE), abs=1e-6)


def test_holding_has_images_that_the_filter_takes():
    """A tone at f is at f − 130 MHz too, sinc(f/f_s − 1) of it, 36 dB less behind 120 MHz."""
    held = replace(IDEAL, hold=1.0, transmit_power=1.0, filter=USUAL.filter)
    wide = replace(IDEAL, sample_rate=4 * RATE)
    record = through(tone(30e6), held, wide)
    image = amplitude(record, 30e6 - RATE)
    bare = float(np.sinc(30e6 / RATE - 1.0))
    assert abs(image) < abs(bare) * 10 ** (-55 / 20)
    assert abs(amplitude(record, 30e6)) == pytest.approx(np.sinc(30e6 / RATE), abs=2e-3)


@pytest.mark.parametrize("frequency", [10e6, 59e6])
@pytest.mark.parametrize("place", ["transmitter", "receiver"])
def test_the_filter_passes_its_band(frequency, place):
    radios = {"transmitter": replace(IDEAL, transmit_power=1.0), "receiver": IDEAL}
    radios[place] = replace(radios[place], filter=USUAL.filter)
    assert abs(amplitude(through(tone(frequency), **radios), frequency)) == pytest.approx(
        1.0, abs=2e-3
    )


def test_what_is_sent_at_another_carrier_stays_outside():
    """250 MHz away, the receiver's filter leaves less than −55 dB of it."""
    receiver = replace(IDEAL, filter=USUAL.filter)
    record = through(tone(5e6, carrier=3.75e9), replace(IDEAL, transmit_power=1.0), receiver)
    assert float(to_db(record.power)) < -55.0


def test_carriers_that_differ_by_less_than_the_band_move_the_tone():
    sent = tone(5e6, carrier=CARRIER + 20e6)
    record = through(sent, replace(IDEAL, transmit_power=1.0))
    assert abs(amplitude(record, 25e6)) == pytest.approx(1.0, abs=1e-6)


def test_phase_noise_has_its_spectrum(compare):
    """L(f) of both carriers adds: 3 dB above one, Welch over 16 segments of half a percent."""
    noise = PhaseNoise(offset=(1e4, 1e6, 1e7), level=(1e-9, 1e-9, 1e-11))
    radio = replace(IDEAL, phase_noise=noise, transmit_power=1.0)
    signal = replace(tone(0.0, count=100 * COUNT // 10), start_time=0.0)
    record = through(signal, radio, radio)
    middle = record.samples[1000 : 1000 + 120_000]
    frequency, density = welch(middle / middle.mean(), fs=RATE, nperseg=8192, return_onesided=False)
    near = (np.abs(frequency) > 3e5) & (np.abs(frequency) < 9e5)
    compare(
        page="correlation",
        case="300 to 900 kHz",
        quantity="phase noise of both carriers, dBc/Hz",
        expected=float(to_db(2e-9)),
        measured=float(to_db(density[near].mean())),
        tolerance=0.5,
        source="L(f) of each",
    )


def test_a_delayed_link_gives_its_lag():
    record = through(chirp(), USUAL, USUAL, Link(attenuation=1e3, delay=25e-9))
    assert lobes(correlate(record, chirp(), oversampling=8)).lag == pytest.approx(25e-9, abs=2e-11)


def test_a_delayed_link_turns_the_carrier():
    """exp(−j2π(f_c + f)τ): 4.02 GHz for 0.1 ns are 0.402 cycles."""
    sent = replace(IDEAL, transmit_power=1.0)
    direct, late = (
        amplitude(through(tone(20e6), sent, link=Link(attenuation=1.0, delay=delay)), 20e6)
        for delay in (0.0, 0.1e-9)
    )
    assert late / direct == pytest.approx(np.exp(-2j * np.pi * 0.402), abs=1e-5)


@pytest.mark.parametrize("place", ["transmitter", "receiver"])
def test_a_clock_offset_moves_the_peak_as_its_carrier_does(place, compare):
    """δ f_c of carrier is a lag of ± δ f_c/slope; of the clock, T/2 · δ on top.

    A receiver that is fast by δ hears f(1 − δ) − δ f_c: a rising ramp comes later by
    δ (f_c + f)/β, mean f zero, and its own clock stretches it by δt, on average δT/2.
    """
    offset = 2e-6
    radios = {"transmitter": IDEAL, "receiver": IDEAL}
    radios[place] = replace(IDEAL, clock_offset=offset)
    found = lobes(correlate(through(chirp(), **radios), chirp(), oversampling=8))
    sign = 1.0 if place == "receiver" else -1.0
    compare(
        page="correlation",
        case=f"2 ppm, {place}",
        quantity="lag of a clock offset, ns",
        expected=sign * (offset * CARRIER / 1e12 + offset * 100e-6 / 2) * 1e9,
        measured=found.lag * 1e9,
        tolerance=0.02,
        source="δ f_c/β + δ T/2",
    )


@pytest.mark.parametrize("offset", [-9e-3, -1e-3, 9e-3])
def test_a_slow_or_fast_transmitter_plays_its_signal_to_the_end(offset):
    """A clock that is fast by δ plays for 1/(1 + δ) of the time, with the same power."""
    clocked = replace(IDEAL, clock_offset=offset)
    sent = tone(0.0, count=5 * COUNT)
    arriving = through(sent, clocked, tuned=CARRIER * (1 + offset))
    power = IDEAL.transmit_power / (1 + offset)
    assert arriving.energy == pytest.approx(sent.energy * power, rel=1e-5)
    spare = arriving.duration - sent.duration / (1 + offset)
    assert spare == pytest.approx(2 * MARGIN_SAMPLES / RATE, rel=0.02)


def test_equal_clock_offsets_cancel_but_for_nothing():
    fast = replace(IDEAL, clock_offset=5e-6)
    found = lobes(correlate(through(chirp(), fast, fast), chirp(), oversampling=8))
    assert found.lag == pytest.approx(0.0, abs=2e-12)
    assert found.peak == pytest.approx(1.0, abs=1e-4)


def test_the_peak_of_a_noisy_record_is_what_its_noise_leaves(compare):
    """√(SNR/(1 + SNR)) of the energy is the signal's, in a record as long as the signal."""
    radio = replace(IDEAL, noise_figure=2.0)
    signal = chirp()
    for snr in (1000.0, 10.0, 1.0):
        link = link_for(snr, signal, transmitter=radio, receiver=radio)
        record = through(signal, radio, radio, link)
        first = round(-record.start_time * RATE)
        cut = replace(record, samples=record.samples[first : first + COUNT], start_time=0.0)
        compare(
            page="correlation",
            case=f"SNR {float(to_db(snr)):g} dB",
            quantity="peak of a noisy record",
            expected=math.sqrt(snr / (1 + snr)),
            measured=lobes(correlate(cut, signal, oversampling=8)).peak,
            tolerance=0.02,
            source="√(SNR/(1+SNR))",
        )


def test_the_same_streams_give_the_same_record_and_others_do_not():
    first, again, other = (through(chirp(), USUAL, USUAL, seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.samples, again.samples)
    assert not np.array_equal(first.samples, other.samples)


def test_turning_one_effect_off_leaves_the_noise_of_the_others():
    """Streams have names: noise is the same whether there is phase noise or not."""
    quiet = replace(USUAL, phase_noise=None, converter=None)
    records = [
        through(tone(1e6), IDEAL, radio, Link(attenuation=1e30))
        for radio in (quiet, replace(quiet, transmit_bits=None, clock_offset=0.0))
    ]
    np.testing.assert_array_equal(records[0].samples, records[1].samples)


@pytest.mark.parametrize(
    ("change", "error", "sentence"),
    [
        ({"centre_frequency": 79e9}, PhysicsError, "outside the transceiver's 0.2 to 4.4 GHz"),
        ({"sample_rate": 100e6}, InputError, "plays 130 MS/s; resample the signal"),
        ({"samples": 2 * np.ones(10)}, InputError, "above magnitude 1; scale the signal down"),
    ],
)
def test_what_cannot_be_played_is_refused(change, error, sentence):
    with pytest.raises(error, match=sentence):
        through(replace(tone(1e6), **change))


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"sample_rate": 0.0}, "positive sample rate"),
        ({"lowest_carrier": 5e9}, "the lowest one first"),
        ({"transmit_bits": 1}, "cannot have 1 bits"),
        ({"hold": 1.5}, "use more than 0 and at most 1"),
        ({"noise_figure": 0.5}, "cannot be below 0 dB"),
        ({"clock_offset": 0.1}, "between −10 000 and 10 000 ppm"),
    ],
)
def test_a_transceiver_that_cannot_be_is_refused(fields, sentence):
    with pytest.raises(InputError, match=sentence):
        Transceiver(**fields)

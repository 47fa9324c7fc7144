"""Radios without hardware: the loop, and the adapters against stand-ins of their libraries."""

# SoapySDR names its methods, and what they take, in its own way.
# ruff: noqa: N802, N803, ARG002, ARG005

import inspect
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.errors import CapabilityError, InputError, ModelWarning, RunError
from polychirp.model.baseband import Baseband
from polychirp.radio.bands import band_warnings
from polychirp.radio.base import Abilities, Radio, measured
from polychirp.radio.loopback import LoopbackRadio
from polychirp.radio.pluto import PlutoRadio
from polychirp.radio.soapy import SoapyRadio

RATE = 20e6
CARRIER = 2.45e9


def signal(count=500, *, carrier=CARRIER, rate=RATE):
    turns = np.cumsum(np.linspace(-0.4, 0.4, count))
    return Baseband(
        samples=0.9 * np.exp(2j * np.pi * turns), sample_rate=rate, centre_frequency=carrier
    )


def place_of(record, sent):
    """Index at which ``sent`` begins in a record, and the normalised correlation there."""
    scores = np.abs(np.correlate(record.samples, sent.samples, mode="valid"))
    n = int(np.argmax(scores))
    piece = record.samples[n : n + sent.num_samples]
    return n, scores[n] / np.linalg.norm(piece) / np.linalg.norm(sent.samples)


# ── stand-ins ─────────────────────────────────────────────────────────────────


class FakeSoapyDevice:
    """Stand-in of SoapySDR.Device: the receiver receives the transmitted samples repeatedly."""

    def __init__(self, module):
        self.module = module
        self.settings = {}
        self.written = np.zeros(0, dtype=np.complex64)
        self.place = 0
        self.open = set()
        self.overflows = False
        self.is_silent = False

    def getNumChannels(self, direction):
        return 1

    def getFrequencyRange(self, direction, channel):
        return [SimpleNamespace(minimum=lambda: 70e6, maximum=lambda: 6e9)]

    def getSampleRateRange(self, direction, channel):
        return [SimpleNamespace(minimum=lambda: 1e6, maximum=lambda: 61.44e6)]

    def setSampleRate(self, direction, channel, rate):
        self.settings["rate", direction] = rate

    def getSampleRate(self, direction, channel):
        return self.settings["rate", direction]

    def setFrequency(self, direction, channel, frequency):
        self.settings["frequency", direction] = frequency

    def setGain(self, direction, channel, gain):
        self.settings["gain", direction] = gain

    def setupStream(self, direction, kind, channels):
        assert (kind, channels) == ("CF32", [0])
        return direction

    def activateStream(self, stream):
        self.open.add(stream)

    def deactivateStream(self, stream):
        self.open.remove(stream)

    def closeStream(self, stream):
        assert stream not in self.open

    def writeStream(self, stream, buffs, numElems, flags=0, timeNs=0, timeoutUs=100000):
        """Takes at most 300 at once, as drivers do."""
        taken = min(numElems, 300)
        if self.written.size < 3000:
            self.written = np.concatenate([self.written, buffs[0][:taken]])
        return SimpleNamespace(ret=taken)

    def readStream(self, stream, buffs, numElems, flags=0, timeoutUs=100000):
        if self.overflows:
            return SimpleNamespace(ret=self.module.SOAPY_SDR_OVERFLOW)
        if self.is_silent or self.written.size < 3000:
            return SimpleNamespace(ret=0 if self.is_silent else self._wait())
        given = min(numElems, 256)
        index = (self.place + np.arange(given)) % 1500  # three whole periods of 500
        buffs[0][:given] = 0.5 * self.written[index]
        self.place += given
        return SimpleNamespace(ret=given)

    def _wait(self):
        import time

        time.sleep(1e-3)
        return 1


def fake_soapy(**fields):
    module = SimpleNamespace(
        SOAPY_SDR_TX=0, SOAPY_SDR_RX=1, SOAPY_SDR_CF32="CF32", SOAPY_SDR_OVERFLOW=-4
    )
    device = FakeSoapyDevice(module)
    for name, value in fields.items():
        setattr(device, name, value)
    module.Device = lambda arguments: device
    return module, device


class FakePluto:
    """Stand-in of adi.Pluto: attributes, a repeated buffer, integers of 12 bits."""

    def __init__(self):
        self.sent = None
        self.rx_buffer_size = 0
        self.calls = []

    def tx(self, samples):
        assert self.tx_cyclic_buffer
        self.sent = samples
        self.calls.append("tx")

    def rx(self):
        turn = 37 + 11 * self.calls.count("rx")
        self.calls.append("rx")
        count = -(-self.rx_buffer_size // self.sent.size) + 2
        samples = np.tile(self.sent, count)[turn : turn + self.rx_buffer_size]
        return np.rint(samples / 2**14 * 2**10).astype(np.complex64)

    def tx_destroy_buffer(self):
        self.calls.append("stop")

    def rx_destroy_buffer(self):
        self.calls.append("new")


def fake_adi():
    device = FakePluto()
    return SimpleNamespace(Pluto=lambda address: device), device


# ── the seam ──────────────────────────────────────────────────────────────────


def radios():
    soapy, _ = fake_soapy()
    adi, _ = fake_adi()
    return [LoopbackRadio(), SoapyRadio("driver=fake", module=soapy), PlutoRadio(module=adi)]


@pytest.mark.filterwarnings("ignore::polychirp.errors.ModelWarning")
@pytest.mark.parametrize("number", range(3), ids=["loopback", "soapy", "pluto"])
def test_a_radio_records_what_it_plays_whole_from_anywhere(number):
    """The correlation of 16 or 12 bits is above 0.999."""
    radio = radios()[number]
    assert isinstance(radio, Radio)
    sent = signal()
    record = measured(radio, sent, repetitions=2, i_hold_a_licence=True)
    assert record.num_samples == 3 * sent.num_samples
    assert (record.sample_rate, record.centre_frequency) == (RATE, CARRIER)
    begin, height = place_of(record, sent)
    assert height > 0.999
    assert begin % sent.num_samples <= record.num_samples - sent.num_samples


def test_nothing_radiates_without_a_statement_about_the_licence():
    adi, device = fake_adi()
    with pytest.raises(InputError, match=r"nothing was transmitted: .* with --i-hold-a-licence"):
        measured(PlutoRadio(module=adi), signal())
    assert "tx" not in device.calls


def test_a_transmission_warns_of_other_services_in_the_band():
    adi, _ = fake_adi()
    radio = PlutoRadio(module=adi)
    with pytest.warns(ModelWarning, match=r"3.49 to 3.51 GHz is used by mobile networks"):
        measured(radio, signal(carrier=3.5e9), i_hold_a_licence=True)


def test_a_loop_back_radiates_nothing_and_needs_no_licence():
    measured(LoopbackRadio(), signal(carrier=79e9))


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        (4.19e9, 4.21e9, ["mobile networks", "radio altimeters of aircraft, on which lives"]),
        (76e9, 77e9, ["type-approved radars only"]),
        (433.1e6, 434.7e6, ["without a licence at low power"]),
        (5.0e9, 5.05e9, ["licence nearly everywhere"]),
        (1.5754e9, 1.5755e9, ["satellite navigation"]),
    ],
)
def test_every_band_has_its_sentence(low, high, words):
    sentences = list(band_warnings(low, high))
    assert len(sentences) == len(words)
    assert all(word in sentence for word, sentence in zip(words, sentences, strict=True))


@pytest.mark.parametrize(
    ("sent", "error", "sentence"),
    [
        (signal(carrier=4e9), CapabilityError, "tunes 0.325 to 3.8 GHz, not 4 GHz"),
        (signal(rate=130e6), CapabilityError, "takes up to 61.44 MS/s, not 130"),
        (
            Baseband(samples=np.array([1.5]), sample_rate=RATE, centre_frequency=CARRIER),
            InputError,
            "magnitude 1.5, above 1; scale the signal down",
        ),
    ],
)
def test_what_a_radio_cannot_do_is_refused_before_it_plays(sent, error, sentence):
    adi, device = fake_adi()
    with pytest.raises(error, match=sentence):
        measured(PlutoRadio(module=adi), sent, i_hold_a_licence=True)
    assert "tx" not in device.calls


def test_a_pluto_records_at_the_rate_that_is_asked_for():
    """It has one rate for both directions: a signal that it plays keeps its own."""
    adi, device = fake_adi()
    radio = PlutoRadio(module=adi)
    radio.play(signal(rate=5e6))
    assert device.sample_rate == 5e6
    wanted = {"num_samples": 100, "centre_frequency": CARRIER}
    with pytest.raises(CapabilityError, match=r"plays at 5 MS/s cannot record at 10 MS/s"):
        radio.record(sample_rate=10e6, **wanted)
    assert radio.record(sample_rate=5e6, **wanted).sample_rate == 5e6
    radio.stop()
    assert radio.record(sample_rate=10e6, **wanted).sample_rate == device.sample_rate == 10e6


def test_a_pluto_that_cannot_have_a_rate_says_so():
    """Below 521 kS/s its converters have no rate; the driver may then keep another one."""

    class StubbornPluto(FakePluto):
        sample_rate = property(lambda _: 2.5e6, lambda _self, _rate: None)

    radio = PlutoRadio(module=SimpleNamespace(Pluto=lambda address: StubbornPluto()))
    with pytest.raises(CapabilityError, match=r"works at 2\.5 MS/s, not at the requested 0\.1 MS"):
        radio.record(num_samples=10, sample_rate=1e5, centre_frequency=CARRIER)


@pytest.mark.filterwarnings("ignore::polychirp.errors.ModelWarning")
def test_a_radio_is_silent_after_a_failure():
    soapy, device = fake_soapy(overflows=True)
    radio = SoapyRadio(module=soapy)
    with pytest.raises(RunError, match="lost samples, because this computer was too slow"):
        measured(radio, signal(), i_hold_a_licence=True)
    assert device.open == set()


# ── adapters ──────────────────────────────────────────────────────────────────


@pytest.mark.filterwarnings("ignore::polychirp.errors.ModelWarning")
def test_soapy_tunes_both_ways_and_closes_its_streams():
    soapy, device = fake_soapy()
    radio = SoapyRadio("driver=fake", transmit_gain=10.0, receive_gain=20.0, module=soapy)
    measured(radio, signal(), i_hold_a_licence=True)
    assert device.settings == {
        ("rate", 0): RATE,
        ("rate", 1): RATE,
        ("frequency", 0): CARRIER,
        ("frequency", 1): CARRIER,
        ("gain", 0): 10.0,
        ("gain", 1): 20.0,
    }
    assert device.open == set()
    # what the driver refused at the end of a write comes next: the signal has no gaps
    np.testing.assert_array_equal(
        device.written[:1000], np.tile(signal().samples, 2).astype(np.complex64)
    )


@pytest.mark.filterwarnings("ignore::polychirp.errors.ModelWarning")
def test_a_driver_without_samples_ends_with_an_error():
    soapy, _ = fake_soapy(is_silent=True)
    with pytest.raises(RunError, match="the radio gives no samples"):
        measured(SoapyRadio(module=soapy), signal(), i_hold_a_licence=True)


def test_a_driver_with_another_rate_is_refused():
    soapy, device = fake_soapy()
    device.getSampleRate = lambda direction, channel: 19e6
    radio = SoapyRadio(module=soapy)
    with pytest.raises(CapabilityError, match="works at 19 MS/s, not at the requested 20 MS/s"):
        radio.play(signal())


def test_a_device_without_a_transmitter_is_refused():
    soapy, device = fake_soapy()
    device.getNumChannels = lambda direction: 0
    with pytest.raises(CapabilityError, match="cannot transmit; choose another"):
        SoapyRadio("driver=rtlsdr", module=soapy)


def test_the_stand_in_has_the_signatures_of_the_real_one():
    soapy = pytest.importorskip("SoapySDR", reason="SoapySDR is not installed")
    names = [name for name in vars(FakeSoapyDevice) if name[0].islower()]
    assert set(names) <= set(dir(soapy.Device))
    for name in ("readStream", "writeStream"):
        ours, theirs = (
            list(inspect.signature(getattr(owner, name)).parameters)
            for owner in (FakeSoapyDevice, soapy.Device)
        )
        assert ours == theirs


def test_no_device_is_one_sentence():
    soapy, _ = fake_soapy()

    def nothing(arguments):
        raise RuntimeError("no match")

    soapy.Device = nothing
    with pytest.raises(CapabilityError, match=r"finds no device 'driver=x' \(no match\)"):
        SoapyRadio("driver=x", module=soapy)
    with pytest.raises(CapabilityError, match=r"no radio answers at 'ip:1' \(no match\)"):
        PlutoRadio("ip:1", module=SimpleNamespace(Pluto=nothing))


@pytest.mark.parametrize(
    ("name", "make", "sentence"),
    [
        ("SoapySDR", SoapyRadio, "SoapySDR is not installed; install it with the operating system"),
        ("adi", PlutoRadio, "pyadi-iio is not installed; install it with: pip install"),
    ],
)
def test_a_missing_package_is_one_sentence(monkeypatch, name, make, sentence):
    monkeypatch.setitem(__import__("sys").modules, name, None)
    with pytest.raises(CapabilityError, match=sentence):
        make()


@pytest.mark.filterwarnings("ignore::polychirp.errors.ModelWarning")
def test_a_pluto_discards_samples_from_before_it_was_tuned():
    adi, device = fake_adi()
    measured(PlutoRadio(module=adi), signal(), i_hold_a_licence=True)
    assert device.calls == ["stop", "tx", "new", "rx", "rx", "rx", "rx", "rx", "stop"]
    assert (device.tx_lo, device.rx_lo, device.sample_rate) == (2_450_000_000,) * 2 + (20_000_000,)
    assert device.gain_control_mode_chan0 == "manual"
    assert device.tx_hardwaregain_chan0 == -30.0


# ── the loop ──────────────────────────────────────────────────────────────────


def test_a_loop_back_begins_at_another_sample_for_every_seed():
    sent = signal()
    begins = {place_of(measured(LoopbackRadio(seed=n), sent), sent)[0] for n in range(5)}
    assert len(begins) > 3


def test_a_loop_back_has_sixteen_bits():
    """Integers of 2⁻¹⁵, the strongest 3 dB below full scale."""
    record = measured(LoopbackRadio(), signal())
    words = record.samples.view(float) * 2**15
    np.testing.assert_array_equal(words, np.rint(words))
    assert np.abs(words).max() == pytest.approx(2**14.5, rel=1e-3)


@pytest.mark.parametrize("ratio", [0.5, 0.8, 2.0])
def test_a_loop_back_records_as_many_samples_as_asked_at_any_rate(ratio):
    """The record of three periods begins within the first, and holds two whole ones."""
    sent = replace(signal(carrier=0.0), samples=0.5 * np.exp(0.2j * np.pi * np.arange(500)))
    for seed in range(5):
        radio = LoopbackRadio(seed=seed)
        radio.play(sent)
        count = round(3 * ratio * sent.num_samples)
        record = radio.record(num_samples=count, sample_rate=ratio * RATE, centre_frequency=0.0)
        assert record.num_samples == count
        steps = record.samples[1:] / record.samples[:-1]
        np.testing.assert_allclose(steps[20:-20], np.exp(0.2j * np.pi / ratio), atol=1e-2)


@pytest.mark.parametrize("delay", [3, 400, 1300])
def test_a_loop_back_over_a_long_cable_has_played_before_it_records(delay):
    """The signal repeats without a gap from the first sample on, however late it arrives."""

    def long_cable(played):
        return replace(played, start_time=played.start_time + delay / RATE)

    for seed in range(5):
        record = measured(LoopbackRadio(seed=seed, channel=long_cable), signal())
        assert record.num_samples == 1500
        np.testing.assert_array_equal(record.samples[:1000], record.samples[500:])
        assert place_of(record, signal())[1] == pytest.approx(1.0, abs=1e-6)


def test_a_loop_back_through_filters_records_no_rest_before_the_signal_arrives():
    """The channel's record begins with the zeros in which its filters settle."""

    def cable(played):
        padded = np.pad(played.samples, 64)
        return replace(played, samples=padded, start_time=(100 - 64) / RATE)

    for seed in range(20):
        record = measured(LoopbackRadio(seed=seed, channel=cable), signal())
        assert np.abs(record.samples).min() > 0.5


@pytest.mark.parametrize("full_scale", [0.0, -1.0, float("nan")])
def test_a_full_scale_that_is_none_is_refused(full_scale):
    with pytest.raises(InputError, match="V is not positive; leave it out"):
        LoopbackRadio(full_scale=full_scale)


def test_a_loop_back_that_plays_nothing_has_nothing_to_record():
    with pytest.raises(RunError, match="plays nothing"):
        LoopbackRadio().record(num_samples=1, sample_rate=1.0, centre_frequency=0.0)


def test_a_recording_needs_at_least_one_repetition():
    with pytest.raises(InputError, match="repetitions must be 1 or more, not 0"):
        measured(LoopbackRadio(), signal(), repetitions=0)


def test_abilities_name_the_radio():
    limits = Abilities(name="x", lowest_carrier=1.0, highest_carrier=2.0, highest_rate=3.0)
    assert limits.radiates

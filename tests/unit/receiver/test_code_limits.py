"""Frames that cannot be decoded are refused with the reason and what would work."""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.correlation.theory import expected
from polychirp.errors import CapabilityError, InputError, PhysicsError
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp_code import RampCode
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.estimation.cramer_rao import cramer_rao_bound
from polychirp.receiver.mitigation import Blanking, Burg, Nulling
from polychirp.receiver.mitigation.burst_detectors import (
    AmplitudeSteps,
    MedianThreshold,
    StftCfar,
)
from polychirp.receiver.overview.range_azimuth import range_azimuth_map
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import (
    AutoReceiver,
    reason_of_choice,
    receiver_for,
    refuse_unreadable,
    refuse_unsampled,
)
from polychirp.report.figures.spectrogram import spectrogram
from polychirp.rng import Streams
from polychirp.waveform import Noise, PhaseCodedRamp, Pmcw, Sawtooth
from tests.support.points import HandPoint, frame_of

CARRIER = Pmcw(order=7).schedule(num_sweeps=8, streams=Streams(1))
CODED_CHIRPS = PhaseCodedRamp().schedule(num_sweeps=8, streams=Streams(1))
GOOD = Converter(sample_rate=500e6, start=254e-9, margin=0.0)


WIDE = IfFilter(passband=250e6, stopband=300e6)


def of(converter, if_filter=WIDE):
    return Radar(name="front", converter=converter, if_filter=if_filter)


def test_the_receiver_is_chosen_because_of_the_code():
    assert receiver_for(AutoReceiver(), CARRIER).kind == "decoding"
    assert reason_of_choice(CARRIER) == "its ramps carry a code"
    refuse_unreadable(AutoReceiver(), CARRIER)
    refuse_unsampled(AutoReceiver(greatest_range=30.0), CARRIER, of(GOOD))


@pytest.mark.parametrize("receiver", [RangeDoppler(), CoherentReceiver()])
def test_receivers_without_a_decoder_refuse_a_code(receiver):
    with pytest.raises(CapabilityError, match=r"carry a code, .* 'auto' and 'decoding' read it"):
        refuse_unreadable(receiver, CARRIER)


def test_the_decoder_refuses_ramps_without_a_code():
    plain = Sawtooth().schedule(num_sweeps=4, streams=Streams(1))
    with pytest.raises(CapabilityError, match="carry no code; the receiver 'auto' reads it"):
        refuse_unreadable(Decoding(), plain)


def test_the_decoder_refuses_unequal_intervals():
    late = CARRIER.with_late_sweeps(np.array([0, 0, 1e-6, 0, 0, 0, 0, 0]))
    with pytest.raises(CapabilityError, match="from equal intervals"):
        refuse_unreadable(Decoding(), late)


@pytest.mark.parametrize(
    ("change", "greatest", "error", "sentence"),
    [
        ({"sample_rate": 499e6}, 30.0, CapabilityError, "set converter.sample_rate to '5"),
        ({"margin": 400e-9}, 30.0, CapabilityError, "fewer than the 127 of a period"),
        ({}, 60.0, PhysicsError, "echoes repeat after 38.07 m"),
        ({"start": 0.1e-6}, 30.0, PhysicsError, "set converter.start to '201 ns' or more"),
    ],
)
def test_samples_that_cannot_be_correlated_are_refused(change, greatest, error, sentence):
    with pytest.raises(error, match=sentence):
        refuse_unsampled(Decoding(greatest_range=greatest), CARRIER, of(replace(GOOD, **change)))


@pytest.mark.parametrize(
    ("schedule", "enough", "sentence"),
    [
        (
            CARRIER,
            199.9e6,
            r"passes 180 MHz, and the chips of its carrier need 199.8 MHz on either",
        ),
        (CODED_CHIRPS, 6.2e6, r"its beats with their code need 6.136 MHz .* to '6.2 MHz' or more"),
    ],
    ids=["carrier", "chirps"],
)
def test_a_filter_that_takes_the_code_away_is_refused(schedule, enough, sentence):
    """0.4 of 499.5 MHz; 20 MHz/µs and 30 m have beats of 4.003 MHz, and chips of 0.47 µs 2.133."""
    receiver = Decoding(greatest_range=30.0)
    refuse_unsampled(receiver, schedule, of(GOOD, IfFilter(passband=enough, stopband=3e8)))
    narrow = IfFilter(passband=0.9004502251 * enough, stopband=3e8)
    with pytest.raises(PhysicsError, match=sentence):
        refuse_unsampled(receiver, schedule, of(GOOD, narrow))


def test_echoes_of_an_almost_perfect_code_repeat_after_half_its_length():
    plan = Pmcw(code="almost-perfect", order=6).schedule(num_sweeps=2, streams=Streams(1))
    assert plan.code.repetition[0] == pytest.approx(0.5 * plan.code.period[0])
    assert CARRIER.code.repetition[0] == pytest.approx(CARRIER.code.period[0])


def test_a_code_longer_than_its_ramp_is_refused():
    with pytest.raises(InputError, match="longer than its ramp of 30 µs; use fewer"):
        PhaseCodedRamp(chip_duration=1e-6)
    code = RampCode(value=np.ones((1, 300)), row=np.zeros(8), chip_duration=np.full(8, 1e-8))
    with pytest.raises(InputError, match="shorter than its code of 300 chips"):
        replace(CARRIER, code=code)


def test_a_clock_stretches_chips_with_their_ramps():
    late = CARRIER.as_clocked(clock_offset=1e-3)
    share = late.code.chip_duration / late.duration
    np.testing.assert_allclose(share, CARRIER.code.chip_duration / CARRIER.duration, rtol=1e-12)


@pytest.mark.parametrize(
    ("value", "sentence"),
    [([[2.0]], "above 1"), ([[np.nan]], "above 1"), (np.ones((1, 0)), "no chip")],
)
def test_chips_without_sense_are_refused(value, sentence):
    with pytest.raises(InputError, match=sentence):
        RampCode(value=value, row=[0], chip_duration=[1e-9])


@pytest.mark.parametrize("receiver", [RangeDoppler(), CoherentReceiver(), PaperReceiver()])
@pytest.mark.parametrize("read", [lambda one, frame: one.detect(frame), range_azimuth_map])
def test_frames_with_a_code_are_not_read_without_a_decoder(receiver, read):
    frame = frame_of(CODED_CHIRPS, [], converter=Converter(sample_rate=10e6, start=2e-6))
    with pytest.raises(CapabilityError, match=rf"code, which the receiver '{receiver.kind}' does"):
        read(receiver, frame)


def test_mitigation_by_tones_is_refused_for_codes():
    for fit in (None, Blanking(), Nulling()):
        refuse_unreadable(Decoding(mitigation=fit), CARRIER)
    with pytest.raises(CapabilityError, match=r"'burg' takes echoes for tones, .* 'blanking' or"):
        refuse_unreadable(AutoReceiver(mitigation=Burg()), CARRIER)


def test_equations_of_ramps_refuse_a_code():
    times = sample_times(CARRIER, GOOD)
    with pytest.raises(CapabilityError, match="code, which the Cramér–Rao bound leaves out; use"):
        cramer_rao_bound(
            CARRIER, times, AntennaArray(), motion=np.array([9.0, 0.0, 0.0]), azimuth=0.0,
            snr=1.0, time=0.0,
        )  # fmt: skip
    with pytest.raises(CapabilityError, match="no closed form here holds for ramps with a code"):
        expected(CARRIER, CARRIER, np.zeros(1))


def test_the_spectrogram_of_ramps_refuses_a_code():
    with pytest.raises(CapabilityError, match=r"shows no chips, .* 'spectrogram' shows"):
        spectrogram(CARRIER, title="")


@pytest.mark.parametrize("waveform", [PhaseCodedRamp(num_chips=200_000), Noise(num_chips=200_000)])
def test_more_drawn_chips_than_memory_holds_are_refused_before_they_are_drawn(waveform):
    with pytest.raises(InputError, match="200000 chips that is drawn for each of 256 sweeps"):
        waveform.schedule(num_sweeps=256, streams=Streams(1))


def test_two_sweeps_with_a_code_are_too_few_to_tell_the_noise():
    """It is estimated in other range rates, of which three sweeps have two."""
    with pytest.raises(CapabilityError, match="the frame has 2 ramps, fewer than 3"):
        refuse_unreadable(Decoding(), Pmcw(order=7).schedule(num_sweeps=2, streams=Streams(1)))
    refuse_unreadable(Decoding(), Pmcw(order=7).schedule(num_sweeps=3, streams=Streams(1)))


@pytest.mark.parametrize("detector", [AmplitudeSteps(), StftCfar()])
@pytest.mark.parametrize("schedule", [CARRIER, CODED_CHIRPS])
def test_detectors_that_take_chips_for_bursts_are_refused(detector, schedule):
    """Of clean coded chirps they hit 60 % and 9 % of the samples, of clean noise 6 % and 4 %."""
    receiver = Decoding(mitigation=Blanking(detector=detector))
    with pytest.raises(CapabilityError, match=r"chips for bursts.* use 'median-threshold'"):
        refuse_unreadable(receiver, schedule)


@pytest.mark.parametrize("seed", range(3))
def test_a_detector_named_in_the_mitigation_does_not_predict_chips(seed):
    """It is the default one, and leaves a clean frame of a strong echo as it is."""
    converter = Converter(sample_rate=20e6, start=3e-6, margin=1e-6)
    schedule = PhaseCodedRamp(bandwidth=200e6, ramp_duration=40e-6).schedule(
        num_sweeps=16, streams=Streams(seed)
    )
    point = HandPoint(range=9.0, azimuth=0.2, power=1e5)
    frame = frame_of(schedule, [point], converter=converter, seed=seed)
    default, named = (
        Decoding(greatest_range=30.0, mitigation=Blanking(detector=detector)).reading(frame)
        for detector in (None, MedianThreshold())
    )
    assert np.array_equal(named.frame.samples, default.frame.samples)
    plain = Decoding(greatest_range=30.0).reading(frame)
    change = np.sum(np.abs(named.frame.samples - plain.frame.samples) ** 2)
    assert change < 1e-3 * np.sum(np.abs(plain.frame.samples) ** 2)

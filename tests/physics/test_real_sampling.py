"""Converters that take the branch I alone: the image, its noise, and interference from both sides.

The reference mixes real voltages at their radio frequencies, which are chosen so low that a few
hundred million samples per second represent them, and filters the product by a plain sum.
"""

from dataclasses import replace

import numpy as np
import pytest

from polychirp.cli.init import template
from polychirp.config.load import load_study
from polychirp.errors import CapabilityError, InputError, ModelWarning
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.front_end import (
    Digitiser,
    FrontEnd,
    GainControl,
    HighPass,
    IqImbalance,
    Offset,
)
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.paths import Bounce
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver
from polychirp.rng import Streams
from polychirp.study.check import check
from polychirp.synthesis.impairments.front_end import reading
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.waveform import Triangular
from tests.physics.test_chirp_sequences import RADAR, trial

FILTER = IfFilter(passband=0.4e6, stopband=0.9e6)
CONVERTER = Converter(sample_rate=2e6, start=12e-6, margin=12e-6)
REAL = replace(CONVERTER, sampling="real")


def radar(converter=REAL, name="victim", **fields) -> Radar:
    array = AntennaArray(num_channels=1, pattern=ISOTROPIC)
    return Radar(name=name, array=array, if_filter=FILTER, converter=converter, **fields)


def ramps(start=60e6, slope=0.4e12, late=0.0, duration=60e-6) -> RampSchedule:
    return RampSchedule(
        start_time=[late],
        duration=[duration],
        start_frequency=[start],
        slope=[slope],
        start_phase=[0.1],
        sweep=[0],
    )


def received(victim: Radar, plans, *paths, seed=1):
    others = [radar(name=f"other {n}") for n in range(1, len(plans))]
    car = Actor(name="car", kind="vehicle", pose=Pose())
    scene = Scene(time=0.0, actors=(car,), radars=(victim, *others), carriers=(0,) * len(plans))
    return synthesize(
        Stretch(),
        scene,
        plans,
        [paths_of(*paths, frequency=60e6)],
        victim=0,
        interferers=None,
        streams=Streams(seed=seed),
    )


def voltage(plan: RampSchedule, time):
    """Real voltage of amplitude 1 that a radar sends on its only ramp; 0 before and after."""
    into = time - plan.start_time[0]
    cycles = plan.start_phase[0] + plan.start_frequency[0] * into + 0.5 * plan.slope[0] * into**2
    is_sent = (into >= 0) & (into < plan.duration[0])
    return np.where(is_sent, np.cos(2 * np.pi * cycles), 0.0)


@pytest.mark.parametrize(
    ("start", "slope"),
    [(60e6, 0.4e12), (59.8e6, 0.4e12), (58.4e6, 0.45e12), (84e6, -0.4e12)],
    ids=["in step", "beat below", "crossing slowly", "crossing fast"],
)
def test_samples_are_those_of_a_real_mixer(start, slope):
    """An echo and an interferer: LO times received voltage, filtered; the sum frequency is lost."""
    own, other = ramps(), ramps(start=start, slope=slope, late=0.7e-6)
    echo = HandPath(delay=0.9e-6, gain=0.5, bounces=(Bounce.SCATTERING,))
    direct = HandPath(delay=0.3e-6, gain=0.8, transmitter=1)
    frame, parts = received(radar(), [own, other], echo, direct)
    victim = radar()
    rate = 0.8e9
    time = np.arange(0.0, 60e-6, 1.0 / rate)
    level = np.sqrt(victim.transmit_power * victim.transmit_gain * victim.receive_gain)
    arriving = level * (0.5 * voltage(own, time - 0.9e-6) + 0.8 * voltage(other, time - 0.3e-6))
    product = 2.0 * voltage(own, time) * arriving
    moments = sample_times(own, REAL).time[0]
    expected = [
        2.0 * np.sum(FILTER.impulse_response(moment - time) * product) / rate for moment in moments
    ]
    seen = parts.total("echo", "direct")[0, 0]
    assert np.all(seen.imag == 0.0)
    # 90 dB of the stop band at the sum frequency, and the sum instead of the integral
    np.testing.assert_allclose(seen.real, expected, rtol=0, atol=1e-4 * np.abs(expected).max())
    assert np.abs(frame.samples).max() > 0.1 * np.abs(expected).max()


def test_real_samples_are_a_beat_and_its_image():
    """y + ȳ of each part, from the same streams: complex samples do not change by the option."""
    own, other = ramps(), ramps(start=59.9e6, late=1e-6)
    paths = (
        HandPath(delay=0.9e-6, bounces=(Bounce.SCATTERING,)),
        HandPath(delay=0.3e-6, transmitter=1),
    )
    whole = received(radar(CONVERTER), [own, other], *paths)[1]
    half = received(radar(REAL), [own, other], *paths)[1]
    np.testing.assert_array_equal(half.samples, whole.samples + whole.samples.conj())


def test_the_noise_of_both_sides_adds_up(compare):
    """Power of noise at positive beats over that of complex samples: 2, of 200 × 73 samples."""
    own = RampSchedule(
        start_time=np.arange(400) * 70e-6,
        duration=np.full(400, 60e-6),
        start_frequency=np.full(400, 60e6),
        slope=np.full(400, 0.4e12),
        start_phase=np.zeros(400),
        sweep=np.arange(400),
    )
    power = []
    for converter in (CONVERTER, REAL):
        frame, _ = received(radar(converter), [own])
        spectrum = np.fft.fft(frame.samples[0] * np.hanning(73), axis=1)
        power.append(np.mean(np.abs(spectrum[:, 3:15]) ** 2))
    compare(
        page="impairments",
        case="real samples",
        quantity="noise at an echo's beat over that of complex samples",
        expected=2.0,
        measured=float(power[1] / power[0]),
        tolerance=0.12,  # 400 × 12 cells, of which neighbours are alike: 2.5 % each
        source="noise of both sides, 3 dB",
    )


def test_targets_are_found_as_with_complex_samples_with_3_db_less():
    """The car and the pedestrian of 6 drawn streets; at 14 MS/s beats to 7 MHz fit."""
    ratio = []
    for seed in range(6):
        plain = trial(seed).victim("front").score
        real = trial(seed, converter=replace(RADAR.converter, sampling="real"))
        score = real.victim("front").score
        assert score.is_detected.all()
        assert np.abs(score.range_error).max() < 0.05
        assert np.abs(score.range_rate_error).max() < 0.06
        ratio.extend(score.snr / plain.snr)
    assert np.mean(ratio) == pytest.approx(0.5, rel=0.08)


def test_interference_on_the_other_side_of_the_victims_slope_is_received_as_well():
    """An interferer 250 kHz above the victim's ramps: complex samples have it at ranges below 0."""
    count = 64
    own = RampSchedule(
        start_time=np.arange(count) * 70e-6,
        duration=np.full(count, 60e-6),
        start_frequency=np.full(count, 77e9),
        slope=np.full(count, 0.4e12),
        start_phase=np.zeros(count),
        sweep=np.arange(count),
    )
    above = replace(own, start_frequency=own.start_frequency + 250e3)
    path = HandPath(delay=0.0, gain=1e-5, transmitter=1)
    reader = RangeDoppler(greatest_range=200.0)
    level = {}
    for converter in (CONVERTER, REAL):
        frame, _ = received(radar(converter), [own, above], path)
        map_ = reader.spectra(frame).mean_power
        level[converter.sampling] = map_.power.max() / np.median(map_.power)
        place = map_.range[np.unravel_index(np.argmax(map_.power), map_.power.shape)[1]]
    assert level["complex"] < 30.0
    assert level["real"] > 1e4
    assert place == pytest.approx(250e3 * 299_792_458 / 0.8e12, rel=0.1)


# ── stages behind the filter ────────────────────────────────────────────────────────────────────


def test_offset_and_digitiser_act_on_the_branch_that_is_sampled():
    """Codes are those of Re y plus the offset's real part, and the samples twice these voltages."""
    front_end = FrontEnd(
        high_pass=HighPass(corners=(5e3,)),
        offset=Offset(power=1e-12, phase=2.0),
        digitiser=Digitiser(full_scale=1e-10, bits=6, gain_control=GainControl()),
    )
    victim = radar(front_end=front_end)
    echo = HandPath(delay=0.9e-6, gain=1e-5, bounces=(Bounce.SCATTERING,))
    frame, parts = received(victim, [ramps()], echo)
    read = reading(victim, parts, frame.times)
    np.testing.assert_allclose(frame.samples, 2.0 * read.samples, rtol=0, atol=1e-20)
    step = 2e-5 / 2**6 / np.sqrt(read.gain[0])
    codes = frame.samples.real / (2.0 * step)
    np.testing.assert_allclose(codes, np.rint(codes), atol=1e-6)
    assert np.all(frame.samples.imag == 0.0)


def test_an_imbalance_without_the_branch_q_is_refused():
    with pytest.raises(InputError, match="which has no I/Q imbalance"):
        radar(front_end=FrontEnd(imbalance=IqImbalance(phase=0.1)))


def test_another_sampling_is_refused():
    with pytest.raises(InputError, match="'half' is not complex or real"):
        Converter(sampling="half")


# ── studies ─────────────────────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    "changes",
    [
        {"receiver": CoherentReceiver(greatest_range=45.0)},
        {
            "waveform": Triangular(bandwidth=500e6, ramp_duration=50e-6),
            "receiver": PaperReceiver(greatest_range=45.0),
        },
        {
            "waveform": Triangular(bandwidth=500e6, ramp_duration=50e-6),
            "receiver": AutoReceiver(greatest_range=45.0),
        },
    ],
    ids=["named", "paper", "chosen"],
)
def test_receivers_that_take_the_image_for_a_beat_are_refused_before_the_run(changes):
    with pytest.raises(CapabilityError, match=r"needs complex samples.*of 'front' takes real ones"):
        trial(1, converter=replace(RADAR.converter, sampling="real"), **changes)


def test_the_check_warns_of_beats_that_fold_and_refuses_other_receivers(tmp_path):
    """Filter to 10 MHz, beats to 7.5 MHz: 20 MS/s keep them apart, 16 MS/s do not."""
    path = tmp_path / "chirps.toml"
    path.write_text(template("tdm-mimo"), encoding="utf-8")
    real = "defaults.radar.converter.sampling=real"
    assert check(load_study(path, overrides=[real])).radars[0].sampling == "real"
    slow = [real, "defaults.radar.converter.sample_rate=16 MS/s"]
    with pytest.warns(ModelWarning, match=r"above 8 MHz.*sample_rate to '17\.6 MS/s' or more"):
        check(load_study(path, overrides=slow))
    with pytest.raises(CapabilityError, match="'coherent' needs complex samples"):
        check(load_study(path, overrides=[real, "receiver.kind=coherent"]))

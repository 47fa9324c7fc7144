"""Interference over noise in closed form, against the energy of simulated samples."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import hadamard

from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.ramp import RampSchedule
from polychirp.model.scene import Actor, Scene
from polychirp.rng import Streams
from polychirp.synthesis.links.interference_levels import (
    energy_over_noise,
    interference_to_noise,
    noise_power,
    path_powers,
    received_paths,
)
from polychirp.synthesis.links.links import links_between
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.waveform import (
    DiverseSawtooth,
    DiverseTriangular,
    Hopping,
    Noise,
    PhaseCodedRamp,
    Pmcw,
    Sawtooth,
)
from tests.support.schedules import drawn_chirps

FILTER = IfFilter(passband=9e6, stopband=12e6)
CONVERTER = Converter(sample_rate=25e6, start=0.6e-6, margin=0.0)


def radar(name):
    return Radar(
        name=name,
        array=AntennaArray(num_channels=1, pattern=ISOTROPIC),
        if_filter=FILTER,
        converter=CONVERTER,
    )


SCENE = Scene(
    time=0.0,
    actors=(Actor(name="car", kind="vehicle"),),
    radars=(radar("victim"), radar("other"), radar("third")),
    carriers=(0, 0, 0),
)


def hand_path(*, delay, gain=1e-6, transmitter=1):
    return HandPath(transmitter=transmitter, delay=delay, delay_rate=0.0, gain=gain)


def simulated(schedules, paths, scene=SCENE):
    """Energy of the interference over that of noise in the samples of a frame."""
    frame, parts = synthesize(
        Stretch(), scene, schedules, [paths], victim=0, interferers=None, streams=Streams(seed=1),
        neglected_share=0.0,
    )  # fmt: skip
    energy = np.sum(np.abs(parts.samples[2:4].sum(axis=0)) ** 2)
    return energy / (noise_power(scene, 0) * np.count_nonzero(frame.times.is_sample))


def in_closed_form(schedules, paths, scene=SCENE):
    ratio = interference_to_noise(scene, schedules, received_paths(scene, paths), victim=0)
    times = sample_times(schedules[0], scene.radars[0].converter)
    return float(np.average(ratio, weights=times.num_samples))


def late(schedule, delay):
    return schedule.as_clocked(start_time=delay)


FAMILIES = {
    "crossing": DiverseSawtooth(bandwidth=(150e6, 300e6), idle=(3e-6, 6e-6)),
    "hopping": Hopping(band=(76.5e9, 76.8e9), bandwidth=75e6),
}


def drawn(name, seed):
    """Chirps of a victim and of a radar that starts 7 µs later; the third radar is silent."""
    own, sent = (
        FAMILIES[name].schedule(num_sweeps=64, streams=Streams(seed).of(n)) for n in ("own", "sent")
    )
    return [own, late(sent, 7e-6), late(sent, 1.0)]


@pytest.mark.parametrize("name", FAMILIES)
@pytest.mark.parametrize("seed", range(4))
def test_the_energy_of_one_path_is_that_of_the_samples(name, seed):
    """What the closed form neglects: clicks at the ends of ramps, and that a filter takes time.
    The greatest error of 16 draws of each family is 0.06 dB."""
    schedules, paths = drawn(name, seed), paths_of(hand_path(delay=0.1e-6))
    error = 10 * np.log10(in_closed_form(schedules, paths) / simulated(schedules, paths))
    assert error == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize("name", FAMILIES)
def test_two_paths_add_their_energies_in_the_mean(name):
    """Two signals of equal slopes beat against each other: 4 dB of amplitude ratio can add or take
    up to 2·0.5/1.25 = 0.8 of the sum's power in a draw. The mean of eight draws is closer."""
    paths = paths_of(hand_path(delay=0.1e-6), hand_path(delay=0.35e-6, gain=0.5e-6))
    ratios = [
        in_closed_form(drawn(name, seed), paths) / simulated(drawn(name, seed), paths)
        for seed in range(8)
    ]
    assert 10 * np.log10(ratios) == pytest.approx(np.zeros(8), abs=0.8)
    assert 10 * np.log10(np.mean(ratios)) == pytest.approx(0, abs=0.3)


@pytest.mark.parametrize("delay", [0.0, 0.2e-6, 0.5e-6])
def test_a_signal_in_the_band_all_the_time_has_the_energy_of_its_power(delay):
    """Equal chirps in step: P over noise, times the gain of the filter at the beat, which is flat
    below 9 MHz. The interval of the last of 485 samples is partly behind the chirp: 0.2 %."""
    ramps = Sawtooth(bandwidth=300e6, ramp_duration=20e-6).schedule(
        num_sweeps=8, streams=Streams(seed=1)
    )
    paths = paths_of(hand_path(delay=delay))
    schedules = [ramps, ramps, late(ramps, 1.0)]
    level = path_powers(SCENE, paths)[0] / noise_power(SCENE, 0)
    assert in_closed_form(schedules, paths) == pytest.approx(level, rel=3e-3)
    assert in_closed_form(schedules, paths) == pytest.approx(simulated(schedules, paths), rel=0.02)


def test_elements_that_send_together_add_their_powers():
    """Equal chirps in step with codes that are orthogonal over 4 chirps: 4 times one element's."""
    array = AntennaArray(num_channels=1, num_transmitters=4, pattern=ISOTROPIC)
    scene = replace(SCENE, radars=tuple(replace(one, array=array) for one in SCENE.radars))
    plain = Sawtooth(bandwidth=300e6, ramp_duration=20e-6).schedule(
        num_sweeps=8, streams=Streams(seed=1)
    )
    together = replace(plain, transmit_weight=np.tile(hadamard(4), (2, 1)).astype(complex))
    in_turn = replace(plain, transmit_weight=np.tile(np.eye(4), (2, 1)).astype(complex))
    paths = paths_of(hand_path(delay=0.1e-6))
    levels = []
    for sent in (together, in_turn):
        schedules = [in_turn, sent, late(in_turn, 1.0)]
        expected = simulated(schedules, paths, scene)
        levels.append(in_closed_form(schedules, paths, scene))
        assert levels[-1] == pytest.approx(expected, rel=0.02)
    assert levels[0] == pytest.approx(4 * levels[1])


STRONG = 1e-3
"""Gain of a path 60 dB above the noise, whose clicks the engine does not leave out as too weak."""


def with_converter(**times):
    """The scene with converters that leave out other times."""
    converter = replace(CONVERTER, **times)
    return replace(SCENE, radars=tuple(replace(one, converter=converter) for one in SCENE.radars))


def equal_chirps(*, idle=0.0, apart=2e-6):
    """Chirps of 15 MHz/µs of three radars: the second starts late, and the third is silent."""
    ramps = Sawtooth(bandwidth=300e6, ramp_duration=20e-6, idle=idle).schedule(
        num_sweeps=8, streams=Streams(seed=1)
    )
    return [ramps, late(ramps, apart), late(ramps, 1.0)]


@pytest.mark.parametrize("idle", [0.0, 30e-9, 4e-6])
@pytest.mark.parametrize("apart", [1e-6, 2e-6, 9e-6])
def test_chirps_outside_of_the_band_are_heard_where_they_begin_and_end(idle, apart):
    """Their beats of 15 to 135 MHz never come into the band, but an abrupt begin or end does.

    The closed form takes the filter's band as flat: 0.02 dB from 1.5 of the stop edge on, and 0.1
    to 0.3 dB at its edge.
    """
    scene = with_converter(margin=1e-6)
    schedules = equal_chirps(idle=idle, apart=apart)
    paths = paths_of(hand_path(delay=0.1e-6, gain=STRONG))
    error = in_closed_form(schedules, paths, scene) / simulated(schedules, paths, scene)
    assert 10 * np.log10(error) == pytest.approx(0, abs=0.15)


def test_clicks_before_and_after_the_samples_are_not_heard():
    """Chirps begin 2.1 µs into the victim's, and samples are taken from 5 µs on.

    The impulse response is 1.9 µs long, so that none of it is in the samples.
    """
    assert pytest.approx(1.9e-6, rel=0.01) == FILTER.support
    schedules, paths = equal_chirps(), paths_of(hand_path(delay=0.1e-6, gain=STRONG))
    assert in_closed_form(schedules, paths, with_converter(margin=1e-6)) > 1.0
    assert in_closed_form(schedules, paths, with_converter(start=5e-6, margin=1e-6)) < 1e-9


def triangles(*, start_frequency, bandwidth, ramp_duration, seed, jumps=0.0):
    waveform = DiverseTriangular(
        start_frequency=start_frequency, bandwidth=(bandwidth, 1.1 * bandwidth),
        ramp_duration=(ramp_duration, 1.1 * ramp_duration), start_frequency_spread=jumps,
    )  # fmt: skip
    return waveform.schedule(num_sweeps=16, streams=Streams(seed))


@pytest.mark.parametrize("seed", range(3))
def test_continuous_triangles_click_only_where_their_frequency_jumps(seed):
    """Corners of either radar, whose phase and frequency go on, add nothing; jumps between the
    second radar's triangles add clicks. The converter takes samples all the time."""
    scene = with_converter(start=0.0)
    own = triangles(start_frequency=76e9, bandwidth=200e6, ramp_duration=20e-6, seed=seed)
    sent = triangles(
        start_frequency=76.3e9, bandwidth=150e6, ramp_duration=13e-6, seed=seed + 9, jumps=50e6
    )
    paths = paths_of(hand_path(delay=0.1e-6, gain=STRONG))
    schedules = [own, sent, late(own, 1.0)]
    error = in_closed_form(schedules, paths, scene) / simulated(schedules, paths, scene)
    assert 10 * np.log10(error) == pytest.approx(0, abs=0.1)


def test_powers_of_paths_are_those_of_the_links():
    paths = paths_of(
        hand_path(delay=0.1e-6), hand_path(delay=0.4e-6, gain=3e-7),
        hand_path(delay=0.2e-6, transmitter=2),
    )  # fmt: skip
    found = path_powers(SCENE, paths)
    for sender in (1, 2):
        links = links_between(SCENE, paths, victim=0, transmitter=sender)
        np.testing.assert_allclose(
            found[paths.transmitter == sender], np.abs(links.amplitude) ** 2, rtol=1e-12
        )


def test_a_signal_in_the_band_while_a_radar_listens_adds_its_energy():
    """A radar sends 20 of every 25 µs: in 100 µs it adds 0.8 of its power over the noise."""
    ramps = Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)
    sent = ramps.schedule(num_sweeps=40, streams=Streams(seed=1))
    paths = paths_of(hand_path(delay=0.0))
    energy, samples = energy_over_noise(
        SCENE, received_paths(SCENE, paths), {1: sent}, listener=0,
        band=(76.5e9, 76.8e9), time=(100e-6, 200e-6),
    )  # fmt: skip
    noise = noise_power(SCENE, 0) / FILTER.noise_bandwidth * 300e6
    assert samples == pytest.approx(3e4)
    assert energy - 1.0 == pytest.approx(0.8 * path_powers(SCENE, paths)[0] / noise, rel=1e-6)


def test_a_radar_in_another_band_or_at_another_time_is_not_heard():
    sent = Sawtooth(start_frequency=76.5e9, bandwidth=300e6).schedule(
        num_sweeps=4, streams=Streams(seed=1)
    )
    paths = received_paths(SCENE, paths_of(hand_path(delay=0.0)))
    for band, time in (((77.5e9, 77.8e9), (0.0, 1e-4)), ((76.5e9, 76.8e9), (1.0, 1.1))):
        energy, _ = energy_over_noise(SCENE, paths, {1: sent}, listener=0, band=band, time=time)
        assert energy == 1.0


@pytest.mark.parametrize(
    ("band", "share"),
    [((76.5e9, 76.6e9), 0.0), ((76.6e9, 76.7e9), 0.25), ((76.7e9, 76.9e9), 0.75)],
)
@pytest.mark.parametrize("is_down", [False, True])
def test_a_chirp_that_is_partly_heard_counts_where_its_frequency_is_in_the_band(
    band, share, is_down
):
    """A chirp of 76.5 to 76.9 GHz is heard from 76.675 to 76.775 GHz, in a quarter of its time: of
    this, 25 MHz are below 76.7 GHz and none is below 76.6 GHz. From 76.7 GHz on 75 MHz remain."""
    duration, width = 40e-6, 400e6
    sent = RampSchedule(
        start_time=[0.0], duration=[duration], start_frequency=[76.9e9 if is_down else 76.5e9],
        slope=[(-width if is_down else width) / duration], start_phase=[0.0], sweep=[0],
    )  # fmt: skip
    time = (12.5e-6, 22.5e-6) if is_down else (17.5e-6, 27.5e-6)
    paths = received_paths(SCENE, paths_of(hand_path(delay=0.0)))
    energy, _ = energy_over_noise(SCENE, paths, {1: sent}, listener=0, band=band, time=time)
    noise = noise_power(SCENE, 0) / FILTER.noise_bandwidth * (band[1] - band[0])
    assert energy - 1.0 == pytest.approx(share * paths.power[0] / noise, rel=1e-6, abs=1e-12)


def test_only_the_power_of_the_ramp_that_is_heard_counts():
    """The second of two ramps is sent at a quarter of the power, and only it is heard."""
    sent = RampSchedule(
        start_time=[0.0, 20e-6], duration=[20e-6, 20e-6], start_frequency=[76.5e9, 76.5e9],
        slope=[15e12, 15e12], start_phase=[0.0, 0.0], sweep=[0, 1], transmit_weight=[[1.0], [0.5]],
    )  # fmt: skip
    paths = received_paths(SCENE, paths_of(hand_path(delay=0.0)))
    energy, _ = energy_over_noise(
        SCENE, paths, {1: sent}, listener=0, band=(76.5e9, 76.8e9), time=(20e-6, 40e-6)
    )
    noise = noise_power(SCENE, 0) / FILTER.noise_bandwidth * 300e6
    assert energy - 1.0 == pytest.approx(0.25 * paths.power[0] / noise, rel=1e-6)


def test_a_coded_chirp_is_heard_as_far_as_its_band_is_in_that_of_the_listener():
    """Mean over the time of the share of the code's band, by a sum over 20 000 moments."""
    sent = CODED["chirps"].schedule(num_sweeps=1, streams=Streams(seed=1))
    band, time = (76.5e9, 76.65e9), (3e-6, 11e-6)
    paths = received_paths(SCENE, paths_of(hand_path(delay=0.0)))
    energy, _ = energy_over_noise(SCENE, paths, {1: sent}, listener=0, band=band, time=time)
    moment = np.linspace(*time, 20_001)
    middle = sent.start_frequency[0] + sent.slope[0] * (moment - sent.start_time[0])
    half = 0.5 * sent.code.bandwidth
    common = np.minimum(middle + half, band[1]) - np.maximum(middle - half, band[0])
    share = np.mean(np.clip(common / (2 * half), 0, 1))
    noise = noise_power(SCENE, 0) / FILTER.noise_bandwidth * (band[1] - band[0])
    expected = share * sent.code.mean_power * paths.power[0] / noise
    assert energy - 1.0 == pytest.approx(expected, rel=1e-3)


def test_drawn_durations_and_starts_are_met_too():
    """Ramps of 28 to 42 µs of two radars that share no timing."""
    own, sent = drawn_chirps(48, seed=3), drawn_chirps(48, seed=4)
    schedules = [own, sent, late(sent, 1.0)]
    paths = paths_of(hand_path(delay=0.2e-6))
    expected = simulated(schedules, paths)
    assert 10 * np.log10(in_closed_form(schedules, paths) / expected) == pytest.approx(0, abs=0.25)


def test_schedules_without_a_common_time_leave_nothing():
    ramps = RampSchedule(
        start_time=[0.0], duration=[20e-6], start_frequency=[76.5e9], slope=[15e12],
        start_phase=[0.0], sweep=[0],
    )  # fmt: skip
    schedules = [ramps, late(ramps, 1e-3), late(ramps, 1.0)]
    assert in_closed_form(schedules, paths_of(hand_path(delay=0.1e-6))) == 0.0


CODED = {
    "chirps": PhaseCodedRamp(start_frequency=76.4e9, bandwidth=500e6, ramp_duration=20e-6),
    "carrier": Pmcw(carrier=76.65e9, order=9, chip_duration=8e-9, periods=4, idle=3e-6),
    "noise": Noise(carrier=76.65e9, bandwidth=100e6, chip_duration=5e-9, num_chips=512, periods=6),
}
"""Coded radars whose band a victim's chirps cross."""


@pytest.mark.parametrize("name", CODED)
def test_a_code_spreads_the_energy_over_its_band(name):
    """Chirps of 300 MHz cross the coded band: the spectrum's shape hardly matters.

    What the band of chips has beyond the chirps' band is 0.43 dB of a carrier of 125 MHz.
    """
    own = Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=22e-6).schedule(
        num_sweeps=64, streams=Streams(seed=1)
    )
    sent = CODED[name].schedule(num_sweeps=96, streams=Streams(seed=2))
    schedules, paths = [own, sent, late(own, 1.0)], paths_of(hand_path(delay=0.1e-6))
    error = 10 * np.log10(in_closed_form(schedules, paths) / simulated(schedules, paths))
    assert error == pytest.approx(0, abs=0.5)


def test_a_listening_radar_hears_a_code_in_its_band_and_a_tone():
    """A quarter of the band of chips of 5 ns, 200 MHz, is in the listener's; the tone is within."""
    sent = Pmcw(carrier=77e9, order=9, chip_duration=5e-9, periods=8, idle=0.0).schedule(
        num_sweeps=40, streams=Streams(seed=1)
    )
    width = sent.code.bandwidth
    tone = replace(sent, code=None)
    paths = received_paths(SCENE, paths_of(hand_path(delay=0.0)))
    band = (77e9, 77e9 + 0.25 * width)
    noise = noise_power(SCENE, 0) / FILTER.noise_bandwidth * 0.25 * width
    for one, share in ((sent, 0.25), (tone, 0.5)):
        energy, _ = energy_over_noise(
            SCENE, paths, {1: one}, listener=0, band=band, time=(50e-6, 150e-6)
        )
        assert energy - 1.0 == pytest.approx(share * paths.power[0] / noise, rel=1e-3)

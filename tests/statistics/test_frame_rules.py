"""Rules from frame to frame against the closed forms of channel access.

Radars are 30 m apart and hear each other far above the noise, so that a frame is lost if and only
if its ramps meet those of another radar within the IF band.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import binomtest

from polychirp.channel.tracers.free_space import FreeSpace
from polychirp.errors import InputError
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.study.frame_loop import frame_begin, last_frame
from polychirp.study.recent_results import RecentResults
from polychirp.study.spec import Study, StudyRadar, scene_of, schedules_of, tracer_of
from polychirp.study.trial import run_trial
from polychirp.synthesis.links.interference_levels import (
    interference_to_noise,
    path_powers,
    received_paths,
)
from polychirp.synthesis.links.thermal_noise import noise_density
from polychirp.traffic.street import Point, Street, Vehicle
from polychirp.waveform import (
    DiverseTriangular,
    HopAfterHit,
    ListenBeforeTalk,
    RedrawEachFrame,
    Sawtooth,
)

CHIRPS = Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6)
NUM_CHIRPS = 8
FRAME = NUM_CHIRPS * 25e-6 - 5e-6
TRACES = RecentResults(most=2)


def study(rule, *, count=5, seed=1):
    """Radars in a row, all alike, each of which hears all others."""
    names = [f"radar-{n}" for n in range(count)]
    return Study(
        name="row",
        seed=seed,
        num_sweeps=NUM_CHIRPS,
        street=Street(
            vehicles=tuple(Vehicle(name=name, x=0.0, y=30.0 * n) for n, name in enumerate(names))
        ),
        radars=tuple(
            StudyRadar(
                name=name,
                vehicle=name,
                waveform=CHIRPS,
                array=AntennaArray(num_channels=1, pattern=ISOTROPIC),
                if_filter=IfFilter(passband=9e6, stopband=12e6),
                converter=Converter(sample_rate=25e6, start=0.6e-6, margin=0.0),
            )
            for name in names
        ),
        tracer=FreeSpace(),
        access=rule,
    )


def histories(rule, *, count=5, trials):
    scene = scene_of(study(rule, count=count))
    for seed in range(trials):
        yield last_frame(study(rule, count=count, seed=seed), rule, scene, traces=TRACES).history


def lost_frames(rule, *, count=5, trials):
    """Whether the first radar lost each frame, ``(trial, frame)``."""
    return np.array([one.is_lost[:, 0] for one in histories(rule, count=count, trials=trials)])


def is_probability(hits, expected):
    """True if a binomial test of all hits does not refuse the expected probability at 0.1 %."""
    hits = np.asarray(hits).ravel()
    return binomtest(int(hits.sum()), hits.size, expected).pvalue > 1e-3


def test_slots_of_aloha_are_shared_as_often_as_its_law_says():
    """A frame is lost with 1 − (1 − 1/n)^(N−1). Slots are 4 µs, 60 MHz of beat, apart."""
    rule = RedrawEachFrame(num_slots=6, slot=4e-6, num_frames=10, frame_interval=2e-3)
    assert is_probability(lost_frames(rule, trials=40), 1 - (1 - 1 / 6) ** 4)


def test_frames_that_hop_are_lost_as_bazzi_says_and_in_a_row_by_a_power():
    """Bazzi 2024: 1 − (1 − P_f P_t)^N with P_f = 1/M channels and P_t of starts that meet.

    Starts are uniform in T, and chirps repeat after 25 µs: with starts τ apart, frames of K chirps
    meet within the band if τ is within w of a multiple of 25 µs, w the IF band over the slope, with
    fewer chirps in common for greater multiples, but at least one. Of the triangular density of τ
    the part near n·25 µs is (1 − n·25 µs/T)·2w/T on both sides. Draws are independent from frame to
    frame: M_f lost frames in a row have the power M_f.
    """
    spread, channels, others = 400e-6, 4, 4
    rule = RedrawEachFrame(
        start_spread=spread, num_channels=channels, spacing=1e9, num_frames=12, frame_interval=2e-3
    )
    lost = lost_frames(rule, trials=60)
    # a signal is lost in the band up to the delay of 30 to 120 m and the filter's transition: w is
    # measured on the first frames of other trials, where only the two nearest radars are there
    window = if_window()
    meeting = sum(
        (1 - abs(n) * 25e-6 / spread) * 2 * window / spread
        for n in range(-(NUM_CHIRPS - 1), NUM_CHIRPS)
    )
    single = 1 - (1 - meeting / channels) ** others
    assert is_probability(lost, single)
    in_a_row = lost[:, :-1] & lost[:, 1:]
    # pairs that share a frame are not independent: every other pair is
    assert is_probability(in_a_row[:, ::2], single**2)


def if_window():
    """Half of the range of starts, s, within which two equal chirps are in one IF band."""
    pair = study(None, count=2)
    scene = scene_of(pair)
    paths = received_paths(scene, pair.tracer.trace(scene))
    own = schedules_of(pair)[0]
    grid = np.linspace(-3e-6, 3e-6, 1201)
    heard = [
        np.mean(
            interference_to_noise(
                scene, [own, own.as_clocked(start_time=10e-6 + late)], paths, victim=0
            )
        )
        for late in grid - 10e-6
    ]
    return 0.5 * np.mean(np.array(heard) > 0.25) * 6e-6


def test_hops_after_hits_end_where_nobody_is_hit():
    """Five radars among 12 channels: once all are free they stay free, and all are soon."""
    rule = HopAfterHit(num_channels=12, spacing=1e9, num_frames=25, frame_interval=2e-3)
    for one in histories(rule, trials=10):
        any_lost = np.any(one.is_lost, axis=1)
        assert any_lost[0] or not any_lost.any()
        assert not any_lost[-1]
        assert not np.any(np.diff(any_lost.astype(int)) > 0)


def test_two_radars_part_after_as_many_frames_as_a_geometric_law_says():
    """Two radars in one channel both draw among M: they meet again with 1/M in every frame."""
    rule = HopAfterHit(num_channels=3, spacing=1e9, num_frames=12, frame_interval=2e-3)
    until = [one.frames_until_free[0] for one in histories(rule, count=2, trials=150)]
    assert is_probability(np.array(until) > 0, 1 / 3)
    assert is_probability(np.array(until) > 1, 1 / 9)


def test_radars_that_listen_collide_if_one_has_not_heard_enough_of_the_other():
    """Two radars begin to listen Δ apart, for L each. The later one hears the other for Δ less the
    delay, and waits once that energy exceeds the threshold q: from Δ = τ + (q − 1)·L·kT₀FB/P on.
    The power is such that this is 15 µs. Starts are uniform in S: they meet with 1 − (1 − Δ/S)²."""
    listening, spread, needed = 50e-6, 500e-6, 15e-6
    rule = ListenBeforeTalk(
        start_spread=spread, listening=listening, backoff=400e-6, most_attempts=12, num_frames=1,
        frame_interval=10e-3,
    )  # fmt: skip
    excess = rule.threshold(CHIRPS.bandwidth * listening) - 1.0
    plain = study(rule, count=2)
    scene = scene_of(plain)
    paths = plain.tracer.trace(scene)
    noise = noise_density(scene.radars[0]) * CHIRPS.bandwidth
    power = excess * listening / needed * noise / path_powers(scene, paths)[0]
    met = []
    for seed in range(300):
        one = study(rule, count=2, seed=seed)
        weak = replace(
            one,
            radars=tuple(
                replace(radar, transmit_power=power * radar.transmit_power) for radar in one.radars
            ),
        )
        starts = last_frame(weak, rule, scene_of(weak), traces=TRACES).history.start_time[0]
        apart = abs(starts[0] - starts[1])
        met.append(apart < FRAME)
        assert apart < 2 * needed or apart > FRAME - 25e-6
    assert is_probability(met, 1 - (1 - (needed + 0.1e-6) / spread) ** 2)


def test_the_last_frame_is_simulated_and_begins_at_zero():
    rule = RedrawEachFrame(num_slots=6, slot=4e-6, num_frames=3, frame_interval=2e-3)
    assert frame_begin(rule, 2) == 0.0
    one = study(rule, count=3)
    post = Point(name="post", x=20.0, y=5.0, z=0.5, rcs=10.0)
    one = replace(one, street=replace(one.street, points=(post,)), victims=("radar-0",))
    trial = run_trial(one)
    start = trial.victims[0].frame.schedule.start_time[0]
    assert start == trial.frames.start_time[-1, 0]
    assert 0.0 <= start < 6 * 4e-6
    assert np.all(trial.frames.start_time[0] < -3e-3)
    again = run_trial(one)
    np.testing.assert_array_equal(trial.frames.inr, again.frames.inr)


def test_what_a_radar_hears_is_the_interference_of_its_simulated_frame():
    """Energy of the direct and indirect parts over that of noise, to 5 %: noise of 3 880 samples
    has a spread of 1.6 %."""
    rule = RedrawEachFrame(num_slots=1, num_frames=2, frame_interval=2e-3)
    one = replace(
        study(rule, count=2),
        street=Street(
            vehicles=(
                Vehicle(name="radar-0", x=0.0, y=0.0),
                Vehicle(name="radar-1", x=0.0, y=30.0),
            ),
            points=(Point(name="post", x=20.0, y=5.0, z=0.5, rcs=10.0),),
        ),
    )
    trial = run_trial(one)
    victim = trial.victims[0]
    parts = victim.parts
    heard = np.sum(np.abs(parts.samples[2:4].sum(axis=0)) ** 2) / np.sum(
        np.abs(parts.samples[parts.names.index("noise")]) ** 2
    )
    assert trial.frames.inr[-1, 0] == pytest.approx(heard, rel=0.05)


def test_ramps_of_drawn_lengths_count_with_their_samples():
    """Energy of all samples over that of noise, with the ramps of 8 to 40 µs of either radar."""
    rule = RedrawEachFrame(num_frames=1, start_spread=20e-6)
    one = study(rule, count=2)
    waveform = DiverseTriangular(
        start_frequency=76.5e9, bandwidth=(200e6, 300e6), ramp_duration=(8e-6, 40e-6)
    )
    one = replace(one, radars=tuple(replace(radar, waveform=waveform) for radar in one.radars))
    scene = scene_of(one)
    last = last_frame(one, rule, scene)
    paths = received_paths(scene, tracer_of(one, schedules_of(one)).trace(scene))
    ratio = interference_to_noise(scene, last.schedules, paths, victim=0)
    count = sample_times(last.schedules[0], scene.radars[0].converter).num_samples
    assert last.history.inr[0, 0] == pytest.approx(np.sum(ratio * count) / np.sum(count))
    assert last.history.inr[0, 0] != pytest.approx(np.mean(ratio), rel=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_equal_chirps_out_of_step_are_heard_where_they_begin_and_end(seed):
    """Chirps that start some µs apart: what the rule sees is what the last frame's samples have.

    Noise of 3 888 samples has a spread of 1.6 %; the closed form of a click is right to 3 %.
    """
    rule = RedrawEachFrame(num_slots=6, slot=4e-6, num_frames=1, frame_interval=2e-3)
    one = replace(study(rule, count=2, seed=seed), victims=("radar-0",))
    post = Point(name="post", x=20.0, y=5.0, z=0.5, rcs=1e-6)
    radars = tuple(replace(radar, transmit_power=10.0) for radar in one.radars)
    trial = run_trial(
        replace(one, radars=radars, street=replace(one.street, points=(post,)), targets=("post",))
    )
    parts = trial.victims[0].parts
    heard = np.sum(np.abs(parts.interference) ** 2) / np.sum(np.abs(parts.noise) ** 2)
    assert trial.frames.inr[-1, 0] == pytest.approx(heard, rel=0.08)


@dataclass(frozen=True)
class Wrong:
    """A tracer of a user's own, whose paths have a negative delay."""

    capabilities = frozenset({"points"})

    def trace(self, scene):
        paths = FreeSpace(frequency=76.65e9).trace(scene)
        return replace(paths, delay=-paths.delay)


def test_paths_that_cannot_be_are_refused_in_every_frame():
    rule = RedrawEachFrame(num_frames=2, frame_interval=2e-3)
    one = replace(study(rule, count=2), tracer=Wrong())
    with pytest.raises(InputError, match=r"the tracer's path 0 has a delay of -"):
        last_frame(one, rule, scene_of(one))


def test_frames_that_do_not_fit_are_refused_with_their_key():
    rule = RedrawEachFrame(num_slots=6, slot=4e-6, num_frames=2, frame_interval=150e-6)
    one = study(rule)
    with pytest.raises(InputError, match=r"access\.frame_interval: radar 'radar-\d' ends frame"):
        last_frame(one, rule, scene_of(one))
    assert math.isclose(FRAME, 195e-6)

"""Coherent gain of every family of waveforms, and what each does to another radar's signal."""

import math

import numpy as np
import pytest

from polychirp.constants import SPEED_OF_LIGHT
from polychirp.frames import Pose
from polychirp.model.antenna import ISOTROPIC, AntennaArray
from polychirp.model.if_filter import IfFilter
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter, Radar
from polychirp.model.scene import Actor, Scene
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver
from polychirp.rng import Streams
from polychirp.synthesis.received_frame import synthesize
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.testing.paths import HandPath, paths_of
from polychirp.waveform import (
    DiverseSawtooth,
    Hopping,
    PermutedChirps,
    PhaseCodedSawtooth,
    Sawtooth,
    SlopeSequence,
)
from tests.support.points import HandPoint, frame_of, true_motions

FAST = Converter(sample_rate=20e6, start=2e-6, margin=1e-6)
FAMILIES = {
    "sawtooth": Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6),
    "diverse sawtooth": DiverseSawtooth(start_frequency_spread=200e6, idle=(4e-6, 6e-6)),
    "one draw a frame": DiverseSawtooth(every="frame", start_frequency_spread=200e6),
    "hops from chirp to chirp": Hopping(),
    "hops from frame to frame": Hopping(every="frame"),
    "phase codes": PhaseCodedSawtooth(),
    "permuted chirps": PermutedChirps(),
    "slopes": SlopeSequence(slopes=(1.2e13, 9e12, 6e12, 3e12), ramp_duration=40e-6, idle=3e-6),
    "slopes of both signs": SlopeSequence(
        slopes=(1.2e13, -9e12, 6e12, -3e12), ramp_duration=40e-6, idle=3e-6
    ),
}
SWEEPS = {"permuted chirps": 64, "slopes": 16, "slopes of both signs": 16}


def ramps(family, trial):
    return FAMILIES[family].schedule(num_sweeps=SWEEPS.get(family, 128), streams=Streams(trial))


@pytest.mark.parametrize("family", FAMILIES)
def test_all_samples_of_a_frame_add_up_in_phase(family, compare):
    """A point of 20 dB of coherent SNR in each of four channels: 400 in all.

    The mean over 12 frames of a noncentral χ² with 8 degrees of freedom has a standard deviation of
    2 √(400)/√12 = 12, and of 3 %; its mean is 404.
    """
    found = []
    for trial in range(12):
        schedule = ramps(family, trial)
        number = int(sample_times(schedule, FAST).num_samples.sum())
        point = HandPoint(
            range=17.3 + 0.9 * trial, range_rate=trial - 6.2, azimuth=0.2, power=100 / number
        )
        frame = frame_of(schedule, [point], seed=trial, converter=FAST)
        seen = CoherentReceiver(greatest_range=40.0, greatest_speed=20.0).detect(frame)
        motion = true_motions(schedule, [point])[0]
        assert seen.num_detections == 1
        assert seen.range[0] == pytest.approx(motion[0], abs=0.1)
        assert seen.range_rate[0] == pytest.approx(motion[1], abs=0.1)
        found.append(float(seen.snr[0]))
    compare(
        page="receiver",
        case=family,
        quantity="SNR of a point of 26.0 dB, coherent receiver, dB",
        expected=10 * math.log10(404.0),
        measured=10 * math.log10(float(np.mean(found))),
        tolerance=0.4,
        source="sum of all samples in phase",
    )


def test_equal_chirps_have_range_doppler_processing_and_others_do_not():
    equal = {"sawtooth", "one draw a frame", "hops from frame to frame", "phase codes"}
    chosen = {name: AutoReceiver().chosen(ramps(name, 1)).kind for name in FAMILIES}
    assert {name for name, kind in chosen.items() if kind == RangeDoppler().kind} == equal
    assert {chosen[name] for name in FAMILIES if name not in equal} == {CoherentReceiver().kind}


# ── other radars ──────────────────────────────────────────────────────────────

VICTIM = Radar(
    name="front",
    array=AntennaArray(num_channels=1, pattern=ISOTROPIC),
    if_filter=IfFilter(passband=6e6, stopband=9e6),
    converter=FAST,
)


def direct_samples(own, other, *, distance=20.0):
    """Samples of the part ``direct`` of one frame, V ``(ramp, fast)``; radars are at rest."""
    scene = Scene(
        time=0.0,
        actors=(
            Actor(name="ego", kind="vehicle"),
            Actor(name="car", kind="vehicle", pose=Pose(x=9)),
        ),
        radars=(VICTIM, Radar(name="other", array=VICTIM.array)),
        carriers=(0, 1),
    )
    path = HandPath(delay=distance / SPEED_OF_LIGHT, gain=1e-3, transmitter=1, receiver=0)
    _, parts = synthesize(
        Stretch(), scene, [own, other], [paths_of(path)], victim=0, interferers=None,
        streams=Streams(1),
    )  # fmt: skip
    return parts["direct"][0]


def drawn(waveform, name, num_sweeps=64, seed=1):
    return waveform.schedule(num_sweeps=num_sweeps, streams=Streams(seed).of(name))


def test_a_code_turns_the_signals_of_other_radars_and_not_the_own_ones():
    """Of synchronous radars, each ramp is turned by the difference of both codes, exactly."""
    plain = FAMILIES["sawtooth"].schedule(num_sweeps=64, streams=Streams(1))
    own, other = (drawn(PhaseCodedSawtooth(), name) for name in ("front", "rear"))
    turned = direct_samples(own, other)
    straight = direct_samples(plain, plain)
    cycles = (own.start_phase - plain.start_phase) - (other.start_phase - plain.start_phase)
    np.testing.assert_allclose(
        turned, np.exp(2j * np.pi * cycles)[:, None] * straight, atol=1e-9 * np.abs(straight).max()
    )


def test_a_code_spreads_a_ghost_over_all_range_rates(compare):
    """The power in one cell of K is 1/K of the ghost's without codes, in the mean over codes.

    Of 400 pairs of codes the mean of |sum/K|², of mean 1/K, has a relative standard deviation of
    √(2/400), since a sum of signs is real: 7 %.
    """
    count, pairs = 64, 400
    level = np.empty(pairs)
    for seed in range(pairs):
        own, other = (drawn(PhaseCodedSawtooth(), n, count, seed) for n in ("front", "rear"))
        product = np.exp(2j * np.pi * (own.start_phase - other.start_phase))
        level[seed] = np.abs(np.mean(product)) ** 2
    compare(
        page="closed-forms",
        case="64 chirps, binary codes",
        quantity="ghost of a synchronous radar in its cell, over that without codes, dB",
        expected=-10 * math.log10(count),
        measured=10 * math.log10(float(level.mean())),
        tolerance=0.8,
        source="−10 log₁₀ K",
    )


def test_pieces_in_another_order_meet_in_one_of_their_number():
    """A synchronous radar is in the IF band where both orders have the same piece: 1 of 4.

    Beside it, the pieces of the band's two sides are 150 MHz apart, far outside of the filter. Of
    256 pieces the share has a standard deviation of 0.03.
    """
    own, other = (drawn(PermutedChirps(), name) for name in ("front", "rear"))
    power = np.mean(np.abs(direct_samples(own, other)) ** 2, axis=1)
    is_same = own.start_frequency == other.start_frequency
    assert np.mean(is_same) == pytest.approx(0.25, abs=0.1)
    assert power[is_same].min() > 0.9 * power.max()
    assert power[~is_same].max() < 1e-4 * power.max()


def test_hops_meet_in_one_of_the_number_of_channels():
    waveform = Hopping(band=(76e9, 77e9), bandwidth=250e6)
    own, other = (drawn(waveform, name) for name in ("front", "rear"))
    power = np.mean(np.abs(direct_samples(own, other)) ** 2, axis=1)
    is_same = own.start_frequency == other.start_frequency
    assert power[is_same].min() > 0.9 * power.max()
    assert power[~is_same].max() < 1e-4 * power.max()


def test_slopes_in_another_order_have_no_ghost():
    """Sequences of Son, Sung and Heo (2018) that start together never have the same slope."""
    own = SlopeSequence(slopes=(1.2e13, 9e12, 6e12, 3e12), ramp_duration=40e-6, idle=3e-6)
    other = SlopeSequence(slopes=(9e12, 3e12, 1.2e13, 6e12), ramp_duration=40e-6, idle=3e-6)
    mine, theirs = drawn(own, "front", 16), drawn(other, "rear", 16)
    same = np.abs(direct_samples(mine, mine)) ** 2
    crossed = np.abs(direct_samples(mine, theirs)) ** 2
    # both start at one frequency, and leave the filter of 9 MHz after at most 9 MHz / 3 MHz/µs
    assert crossed.mean() < 0.1 * same.mean()
    assert np.all(mine.slope != theirs.slope)

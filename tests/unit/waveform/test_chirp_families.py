"""Families of chirps against interference: their draws, and the values that they refuse."""

import numpy as np
import pytest

from polychirp.config.load import build
from polychirp.errors import InputError
from polychirp.rng import Streams
from polychirp.study.spec import StudyRadar
from polychirp.waveform import (
    DiverseSawtooth,
    Hopping,
    PermutedChirps,
    PhaseCodedSawtooth,
    Sawtooth,
    SlopeSequence,
)

STREAMS = Streams(seed=3).of("front")


def schedule(waveform, num_sweeps=64):
    return waveform.schedule(num_sweeps=num_sweeps, streams=STREAMS)


# ── drawn chirps ──────────────────────────────────────────────────────────────


def test_draws_stay_within_their_limits_and_fill_them():
    """The probability that none of 2 000 uniform draws is within 1 % of a limit is below 1e-8."""
    waveform = DiverseSawtooth(
        bandwidth=(200e6, 300e6), start_frequency_spread=100e6, idle=(3e-6, 7e-6)
    )
    ramps = schedule(waveform, 2000)
    pauses = ramps.start_time[1:] - ramps.end_time[:-1]
    for values, lowest, highest in (
        (ramps.bandwidth, 200e6, 300e6),
        (ramps.start_frequency, 76.5e9, 76.6e9),
        (pauses, 3e-6, 7e-6),
    ):
        margin = 0.01 * (highest - lowest)
        assert lowest <= values.min() * (1 + 1e-9) < lowest + margin
        assert highest >= values.max() * (1 - 1e-9) > highest - margin


def test_one_draw_for_the_frame_gives_equal_chirps_that_differ_between_radars():
    waveform = DiverseSawtooth(every="frame", start_frequency_spread=100e6, idle=(3e-6, 7e-6))
    ramps = schedule(waveform)
    other = waveform.schedule(num_sweeps=64, streams=Streams(seed=3).of("rear"))
    assert len(set(ramps.slope)) == len(set(ramps.start_frequency)) == 1
    assert np.ptp(np.diff(ramps.start_time)) < 1e-15
    assert ramps.slope[0] != other.slope[0]


def test_a_draw_that_another_quantity_does_not_move():
    """Each quantity has a stream of its own."""
    plain = schedule(DiverseSawtooth(start_frequency_spread=0.0))
    moved = schedule(DiverseSawtooth(start_frequency_spread=100e6))
    np.testing.assert_array_equal(plain.slope, moved.slope)


# ── hops ──────────────────────────────────────────────────────────────────────


def test_hops_use_all_channels_alike_and_stay_in_the_band():
    """Of 4 000 hops among four channels, a share of 1/4 has a standard deviation of 0.007."""
    ramps = schedule(Hopping(band=(76e9, 77e9), bandwidth=250e6), 4000)
    places, counts = np.unique(ramps.start_frequency, return_counts=True)
    np.testing.assert_allclose(places, [76e9, 76.25e9, 76.5e9, 76.75e9])
    assert np.abs(counts / 4000 - 0.25).max() < 0.03
    assert ramps.stop_frequency.max() <= 77e9 + 1.0


def test_two_radars_share_a_channel_as_often_as_there_are_channels():
    waveform = Hopping(band=(76e9, 77e9), bandwidth=125e6)
    own = schedule(waveform, 4000)
    other = waveform.schedule(num_sweeps=4000, streams=Streams(seed=3).of("rear"))
    share = np.mean(own.start_frequency == other.start_frequency)
    assert share == pytest.approx(1 / 8, abs=4 * np.sqrt(1 / 8 * 7 / 8 / 4000))


# ── codes and pieces ──────────────────────────────────────────────────────────


def test_a_code_is_balanced_and_changes_phases_alone():
    coded = schedule(PhaseCodedSawtooth(num_phases=4), 4000)
    plain = schedule(
        Sawtooth(start_frequency=76.5e9, bandwidth=300e6, ramp_duration=20e-6, idle=5e-6), 4000
    )
    np.testing.assert_array_equal(coded.start_time, plain.start_time)
    np.testing.assert_array_equal(coded.slope, plain.slope)
    steps = np.rint(4 * (coded.start_phase - plain.start_phase)) % 4
    np.testing.assert_allclose(coded.start_phase, (plain.start_phase + steps / 4) % 1, atol=1e-9)
    assert np.abs(np.bincount(steps.astype(int)) / 4000 - 0.25).max() < 0.03


def test_pieces_cover_the_band_of_every_chirp_once():
    waveform = PermutedChirps(num_pieces=5, bandwidth=500e6, jump=1e-6, idle=8e-6)
    ramps = schedule(waveform, 32)
    lowest = ramps.start_frequency.reshape(32, 5)
    np.testing.assert_allclose(np.sort(lowest), np.tile(76.5e9 + 1e8 * np.arange(5), (32, 1)))
    np.testing.assert_allclose(ramps.slope, 500e6 / 40e-6)
    assert len({tuple(row) for row in lowest}) > 20
    pause = (ramps.start_time[1:] - ramps.end_time[:-1]).reshape(-1)
    np.testing.assert_allclose(pause[:4], 1e-6, atol=1e-12)
    np.testing.assert_allclose(pause[4::5], 8e-6, atol=1e-12)


def test_a_sequence_repeats_its_slopes_within_one_band():
    ramps = schedule(SlopeSequence(slopes=(1e12, -4e11), ramp_duration=1e-3, idle=1e-5), 3)
    np.testing.assert_allclose(ramps.slope, [1e12, -4e11] * 3)
    lowest = np.minimum(ramps.start_frequency, ramps.stop_frequency)
    np.testing.assert_allclose(lowest, 76.5e9)
    np.testing.assert_array_equal(ramps.sweep, [0, 0, 1, 1, 2, 2])


# ── refused values ────────────────────────────────────────────────────────────

REFUSED = {
    "limits of bandwidth": (
        {"kind": "diverse-sawtooth", "bandwidth": ["300 MHz", "200 MHz"]},
        "limits of bandwidth in the wrong order; write the smaller one first",
    ),
    "limits of idle": (
        {"kind": "diverse-sawtooth", "idle": ["5 us", "4 us"]},
        "limits of idle in the wrong order",
    ),
    "a negative spread": (
        {"kind": "diverse-sawtooth", "start_frequency_spread": "-1 MHz"},
        "cannot have a negative start_frequency_spread",
    ),
    "a channel outside of the band": (
        {"kind": "hopping", "band": ["76 GHz", "76.5 GHz"], "channels": ["76 GHz", "76.4 GHz"]},
        "channel 1 of a hopping waveform reaches from 76.4 to 76.65 GHz, outside of its band of 76 "
        "to 76.5 GHz; move the channel or widen the band",
    ),
    "chirps wider than the band": (
        {"kind": "hopping", "band": ["76 GHz", "76.2 GHz"]},
        "chirps of 250 MHz, which do not fit into its band of 76 to 76.2 GHz",
    ),
    "one phase": (
        {"kind": "phase-coded-sawtooth", "num_phases": 1},
        "needs 2 phases or more, not 1; the waveform 'sawtooth' has no code",
    ),
    "one piece": (
        {"kind": "permuted-chirps", "num_pieces": 1},
        "needs 2 pieces or more in a chirp, not 1; the waveform 'sawtooth' has whole chirps",
    ),
    "no slope": ({"kind": "slope-sequence", "slopes": []}, "needs one slope or more"),
    "a negative carrier": (
        {"kind": "pmcw", "carrier": "-1 GHz"},
        "a PMCW waveform needs a positive carrier, not a negative one",
    ),
    "noise without a band": (
        {"kind": "noise", "bandwidth": "1 MHz"},
        "a block of 1.024 µs is constant with so narrow a bandwidth, and cannot tell ranges apart; "
        "use '1.96 MHz' or more",
    ),
    "a flat ramp": (
        {"kind": "slope-sequence", "slopes": ["1 MHz/us", "0 MHz/us"]},
        "needs one slope or more, none of them 0",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_value_that_cannot_be_is_refused_in_one_sentence_with_its_place(case):
    table, sentence = REFUSED[case]
    with pytest.raises(InputError) as caught:
        build(StudyRadar, {"name": "front", "vehicle": "ego", "waveform": table})
    (line,) = str(caught.value).splitlines()
    assert line.startswith("waveform: ")
    assert sentence in line


@pytest.mark.parametrize(
    ("family", "values"),
    [
        (Sawtooth, {"bandwidth": "1 GHz"}),
        (Sawtooth, {"idle": "5 us"}),
        (DiverseSawtooth, {"bandwidth": ("200 MHz", "300 MHz")}),
    ],
)
def test_a_quantity_with_its_unit_is_refused_outside_of_study_files(family, values):
    with pytest.raises(InputError, match=r"needs a number in SI units as .*, not '[0-9]"):
        family(**values)

"""Margins of detections, the same in studies and in the paper's scenarios."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polychirp.config.load import study_of_tables
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.antenna import AntennaArray
from polychirp.model.if_frame import sample_times
from polychirp.model.radar import Converter
from polychirp.receiver.alternatives.paper_receiver import PaperReceiver
from polychirp.receiver.coherent.chain import CoherentReceiver
from polychirp.receiver.decoding.chain import Decoding
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.receiver.selection import AutoReceiver
from polychirp.rng import Streams
from polychirp.study.margins import PAPER_GATE, folds_of, gate_for, gates_of
from polychirp.study.paper.scenarios import WAVEFORMS
from polychirp.waveform import DiverseSawtooth, Hopping, Noise, PermutedChirps, Pmcw, Sawtooth
from tests.support.small_study import SMALL_STUDY

CONVERTER = Converter(sample_rate=4e6, start=1e-6, margin=1e-6)


@pytest.mark.parametrize("waveform", WAVEFORMS.values(), ids=WAVEFORMS)
def test_the_margin_in_range_rate_is_at_least_a_cell_of_what_is_added_in_phase(waveform):
    """λ/2T of a frame of 16 sweeps; of one ramp for the paper's receiver."""
    schedule = waveform.schedule(num_sweeps=16, streams=Streams(1))
    times = sample_times(schedule, CONVERTER)
    wavelength = SPEED_OF_LIGHT / np.mean(schedule.centre_frequency)
    frame = schedule.end_time[-1] - schedule.start_time[0]
    for receiver, time in (
        (CoherentReceiver(), frame),
        (AutoReceiver(), frame),
        (PaperReceiver(), schedule.duration.min()),
    ):
        gate = gate_for(receiver, schedule, times, AntennaArray())
        assert gate.range_rate >= wavelength / (2.0 * time)
    assert gate == PAPER_GATE
    assert gate_for(CoherentReceiver(), schedule, times, AntennaArray()).range_rate == 1.0


@pytest.mark.parametrize(
    ("waveform", "ramp", "frame"),
    [
        (PermutedChirps(), 1.0, 0.4),
        (Hopping(), 0.6, 0.4),
        (Hopping(band=(76.5e9, 76.8e9), bandwidth=75e6), 2.0, 0.5),
        (DiverseSawtooth(), 0.52, 0.52),
        (DiverseSawtooth(start_frequency_spread=900e6), 0.52, 0.4),
        (Sawtooth(bandwidth=75e6), 2.0, 2.0),
    ],
    ids=["permuted-chirps", "hopping", "narrow-hopping", "one-band", "many-bands", "sawtooth"],
)
def test_the_margin_in_range_is_a_cell_of_what_is_added_in_phase(waveform, ramp, frame):
    """The coherent receiver has the band of all ramps, and others have that of one."""
    schedule = waveform.schedule(num_sweeps=256, streams=Streams(1))
    times = sample_times(schedule, replace(CONVERTER, sample_rate=40e6))
    for receiver, margin in ((CoherentReceiver(), frame), (PaperReceiver(), ramp)):
        gate = gate_for(receiver, schedule, times, AntennaArray())
        assert gate.range == pytest.approx(margin, rel=0.05), receiver


SMALL = study_of_tables(tomllib.loads(SMALL_STUDY), folder=Path())


def test_a_study_has_the_margins_of_its_receiver_for_every_victim():
    """Ramps of 200 µs: λ/2T is 9.48 m/s, and 0.15 m/s in a frame of 64 of them."""
    study = replace(SMALL, num_sweeps=32)
    assert {name: gate.range_rate for name, gate in gates_of(study).items()} == {"front": 1.0}
    paper = gates_of(replace(study, receiver=PaperReceiver()))
    assert paper["front"].range_rate == pytest.approx(9.475, abs=0.01)


@pytest.mark.parametrize("waveform", [Pmcw(), Noise()], ids=["pmcw", "noise"])
def test_a_folded_echo_of_a_carrier_keeps_its_range(waveform):
    """A code's delay does not depend on the Doppler shift; the span is λ/2T of a sweep's interval.

    A chirp of slope μ moves the echo by fS/μ instead.
    """
    schedule = waveform.schedule(num_sweeps=8, streams=Streams(1))
    folds = folds_of(Decoding(), schedule, AntennaArray())
    interval = np.diff(schedule.start_time)[0]
    assert folds.shift == 0.0
    assert folds.span == pytest.approx(SPEED_OF_LIGHT / 79e9 / (2.0 * interval), rel=1e-9)
    chirps = Sawtooth(bandwidth=500e6).schedule(num_sweeps=8, streams=Streams(1))
    folds = folds_of(RangeDoppler(), chirps, AntennaArray())
    expected = folds.span * chirps.centre_frequency[0] / chirps.slope[0]
    assert folds.shift == pytest.approx(expected, rel=1e-12)

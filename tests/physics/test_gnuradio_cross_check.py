"""Our correlations of what GNU Radio's channel model makes of a chirp, beside theory."""

import math

import numpy as np
import pytest

from polychirp.correlation.alignment import aligned
from polychirp.correlation.base import correlate
from polychirp.correlation.lobes import lobes
from polychirp.errors import CapabilityError, RunError
from polychirp.rng import Streams
from polychirp.study.section_v.operands import named
from polychirp.waveform import Triangular
from polychirp.waveform.playing import played
from tools.experiments import gnuradio
from tools.experiments.gnuradio import gnuradio_python, through_gnuradio

needs_gnuradio = pytest.mark.skipif(
    gnuradio_python() is None,
    reason="GNU Radio is not installed (Debian: gnuradio); this check runs in its own process",
)
CHIRP = played(named("paper-100").schedule, sample_rate=130e6, centre_frequency=4e9)


@needs_gnuradio
def test_without_effects_the_chirp_comes_back():
    back = through_gnuradio(CHIRP)
    found = lobes(correlate(back, CHIRP, oversampling=8))
    assert found.peak == pytest.approx(1.0, abs=2e-3)


@needs_gnuradio
@pytest.mark.parametrize("snr", [10.0, 1.0])
def test_noise_leaves_the_peak_that_theory_says(snr, compare):
    back = through_gnuradio(CHIRP, noise=math.sqrt(1 / snr))
    found = lobes(correlate(aligned(back, CHIRP).signal, CHIRP, oversampling=8))
    compare(
        page="gnuradio",
        case=f"SNR {10 * math.log10(snr):g} dB",
        quantity="peak behind GNU Radio's channel",
        expected=math.sqrt(snr / (1 + snr)),
        measured=found.peak,
        tolerance=0.02,
        source="√(SNR/(1+SNR))",
    )


@needs_gnuradio
def test_a_frequency_offset_is_found():
    wave = Triangular(start_frequency=3.96e9, bandwidth=80e6, ramp_duration=50e-6)
    plan = wave.schedule(num_sweeps=1, streams=Streams(seed=1))
    sent = played(plan, sample_rate=130e6, centre_frequency=4e9)
    back = through_gnuradio(sent, frequency_offset=12e3)
    assert aligned(back, sent, greatest_offset=40e3).frequency_offset == pytest.approx(
        12e3, abs=500.0
    )


def test_without_gnuradio_it_is_one_sentence(monkeypatch):
    monkeypatch.setattr(gnuradio, "PYTHONS", ())
    with pytest.raises(CapabilityError, match="GNU Radio is not installed"):
        through_gnuradio(CHIRP)


def test_the_exchange_is_exact(monkeypatch, tmp_path):
    """A stand-in of GNU Radio that copies the file: floats come back to the bit."""
    program = tmp_path / "python"
    program.write_text('#!/bin/sh\n[ $# = 2 ] && exit 0\n/bin/cp "$3.sigmf-data" "$4.sigmf-data"\n')
    program.chmod(0o755)
    monkeypatch.setattr(gnuradio, "PYTHONS", (str(program),))
    back = through_gnuradio(CHIRP)
    np.testing.assert_array_equal(
        back.samples, CHIRP.samples.astype(np.complex64).astype(np.complex128)
    )


def test_a_failure_is_said_in_its_own_words(monkeypatch, tmp_path):
    program = tmp_path / "python"
    program.write_text('#!/bin/sh\n[ $# = 2 ] && exit 0\necho "no such block" >&2; exit 3\n')
    program.chmod(0o755)
    monkeypatch.setattr(gnuradio, "PYTHONS", (str(program),))
    with pytest.raises(RunError, match="GNU Radio failed: no such block"):
        through_gnuradio(CHIRP)

"""``polychirp correlate``: what it prints and writes, and the one sentence of every mistake."""

import csv
import json
import math
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from polychirp.capture.sigmf import open_sigmf, write_sigmf
from polychirp.cli.app import main
from polychirp.cli.init import template
from polychirp.model.baseband import Baseband
from polychirp.rng import Streams
from polychirp.study.section_v.operands import NAMED, Operand, closed_form, named, paired
from polychirp.waveform import Sawtooth
from polychirp.waveform.playing import played

CHIRP = played(named("paper-100").schedule, sample_rate=130e6, centre_frequency=4e9)


def last_words(capsys):
    return [line for line in capsys.readouterr().err.splitlines() if line.startswith("polychirp:")]


def answer(capsys, *arguments):
    """The JSON of a correlation."""
    assert main(["correlate", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def decibels(lobes):
    return 20 * math.log10(lobes["peak"])


@pytest.fixture
def recording(tmp_path):
    """The paper's chirp, 30 µs late, its amplitude a tenth, in a noisy recording."""
    noise = np.random.default_rng(1).standard_normal((39_000, 2)).view(complex)[:, 0]
    samples = 0.02 * noise
    samples[3900 : 3900 + CHIRP.num_samples] += 0.1 * CHIRP.samples
    record = Baseband(samples=samples, sample_rate=130e6, centre_frequency=4e9)
    return str(write_sigmf(tmp_path / "bench", record, datatype="ci16_le"))


def test_a_waveform_with_itself_is_printed_beside_the_closed_form(capsys):
    assert main(["correlate", "paper-100"]) == 0
    printed = capsys.readouterr().out
    assert "paper-100 with itself, about 4 GHz, 130 MS/s" in printed
    for line in printed.splitlines():
        if line.startswith(("  correlation", "  closed form")):
            assert [word in line for word in ("0.00 dB", "8.86 ns", "-13.27 dB", "-9.68 dB")]


def test_the_papers_second_case_shares_no_frequency_or_follows_the_law(capsys):
    apart = answer(capsys, "paper-120", "paper-100")
    assert decibels(apart["closed form"]) == pytest.approx(-92.9, abs=0.1)
    # samples add aliases of the ramps' ends, of 0.2 dB at most at the default rate
    assert decibels(apart["correlation"]) == pytest.approx(-92.87, abs=0.22)
    based = answer(capsys, "paper-120", "paper-100", "--baseband")
    assert decibels(based["correlation"]) == pytest.approx(-31.6, abs=0.1)
    assert decibels(based["closed form"]) == pytest.approx(-31.6, abs=0.1)


def test_a_width_that_is_not_reached_is_called_unknown(capsys):
    assert main(["correlate", "paper-120", "paper-100", "--rate", "468 MS/s"]) == 0
    printed = capsys.readouterr().out
    assert "unknown" in printed
    assert "inf" not in printed


@pytest.mark.slow
def test_radars_of_a_study_are_correlated(tmp_path, capsys):
    study = str(tmp_path / "study.toml")
    assert main(["init", study]) == 0
    capsys.readouterr()
    name = tomllib.loads(Path(study).read_text())["radars"][0]["name"]
    found = answer(capsys, f"{study}:{name}")
    assert found["correlation"]["peak"] == pytest.approx(1.0, abs=1e-9)


def test_a_recording_is_aligned_with_its_waveform(recording, capsys):
    """SNR 0.01/8e-4 over the chirp: √(SNR/(1 + SNR)) of its energy."""
    found = answer(capsys, recording, "paper-100", "--align")
    assert found["delay"] == pytest.approx(30e-6, abs=1e-10)
    assert found["correlation"]["lag"] == pytest.approx(0.0, abs=1e-10)
    snr = 0.1**2 / (2 * 0.02**2)
    assert found["correlation"]["peak"] == pytest.approx(math.sqrt(snr / (1 + snr)), abs=0.01)
    assert "closed form" not in found


def test_a_long_recording_is_searched(recording, tmp_path, capsys):
    path = tmp_path / "peaks.csv"
    found = answer(capsys, recording, "paper-100", "--search", "--csv", str(path))
    assert found["time"] == pytest.approx([30e-6], abs=1e-9)
    with path.open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["time_s"]) == pytest.approx(30e-6, abs=1e-9)
    assert main(["correlate", recording, "paper-100", "--search"]) == 0
    assert "found 1 times" in capsys.readouterr().out


def test_the_model_stands_between_on_demand(capsys):
    found = answer(capsys, "paper-100", "--snr", "10 dB")
    assert found["correlation"]["peak"] == pytest.approx(math.sqrt(10 / 11), abs=0.01)
    assert found["correlation"]["width"] == pytest.approx(9.19e-9, abs=0.05e-9)


def test_a_loop_stands_for_a_radio(capsys):
    found = answer(capsys, "paper-100", "--radio", "loopback")
    assert found["correlation"]["peak"] == pytest.approx(1.0, abs=1e-3)


def test_pictures_data_and_recordings_are_written(tmp_path, capsys):
    options = [
        *("--figure", str(tmp_path / "f.png"), "--csv", str(tmp_path / "f.csv")),
        *("--ambiguity", str(tmp_path / "a.png"), "--save", str(tmp_path / "kept")),
    ]
    assert main(["correlate", "paper-100", *options]) == 0
    assert "stored" in capsys.readouterr().err
    for name in ("f.png", "a.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    with (tmp_path / "f.csv").open() as file:
        rows = list(csv.DictReader(file))
    highest = max(rows, key=lambda row: float(row["correlation_db"]))
    assert float(highest["correlation_db"]) == pytest.approx(0.0, abs=0.01)
    assert float(highest["closed_form_db"]) == pytest.approx(0.0, abs=0.01)
    kept = open_sigmf(tmp_path / "kept" / "a.sigmf-meta")
    assert kept.schedule.slope[0] == pytest.approx(1e12)
    np.testing.assert_array_equal(
        kept.signal().samples, CHIRP.samples.astype(np.complex64).astype(complex)
    )
    assert main(["correlate", str(tmp_path / "kept" / "a.sigmf-meta"), "paper-100"]) == 0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["walk.npy"], "'walk.npy' is neither a recording (NAME.sigmf-meta), nor a radar"),
        (["paper100"], "did you mean 'paper-100'?"),
        (["none.sigmf-meta"], "there is no recording 'none.sigmf-meta'"),
        (["study.toml"], "'study.toml' is a whole study; name one of its radars"),
        (["quick.toml"], "as in 'quick.toml:front'; it has front, other"),
        (["quick.toml:frnt"], "no radar 'frnt'; there are 'front', 'other'; did you mean 'front'?"),
        (["paper-100", "--rate", "130"], "--rate: '130' is not a value in S/s"),
        (["paper-100", "--rate", "50 MS/s"], "needs 100 MS/s, not 50"),
        (["paper-100", "--snr", "ten"], "--snr: 'ten' is not a value in dB"),
        (["paper-100", "--snr", "3 dB", "--radio", "loopback"], "give one of them"),
        (["paper-100", "--radio", "lime"], "--radio: there is no 'lime'"),
        (["paper-100", "--search"], "--search needs B"),
        (["paper-100", "paper-100", "--search"], "--search needs a recording as A"),
        (["paper-100", "--seed", "-1"], "--seed: -1 is negative"),
        (["paper-100", "--figure", "no/such/f.png"], "--figure: there is no folder"),
        (["paper-100", "--csv", "."], "--csv: '.' is a folder; name a file"),
        (["paper-100", "--save", "quick.toml"], "--save: 'quick.toml' is a file; name a folder"),
        (["paper", "--figure", "quick.toml"], "--figure: 'quick.toml' is a file; name a folder"),
        (["paper", "--draws", "1"], "an interval needs 2 or more"),
    ],
)
def test_a_mistake_is_one_sentence(arguments, sentence, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    Path("quick.toml").write_text(template(), encoding="utf-8")
    assert main(["correlate", *arguments]) == 2
    (said,) = last_words(capsys)
    assert sentence in said


def test_a_cut_recording_is_one_sentence(recording, capsys):
    data = recording.replace(".sigmf-meta", ".sigmf-data")
    with Path(data).open("r+b") as file:
        file.truncate(1000)
    assert main(["correlate", recording, "paper-100"]) == 2
    (said,) = last_words(capsys)
    assert "was cut off: 250 of 39000 samples are there" in said


def test_a_recording_too_long_for_memory_is_to_be_searched(recording, capsys, monkeypatch):
    monkeypatch.setattr("polychirp.study.section_v.operands.MOST_IN_MEMORY", 1000)
    assert main(["correlate", recording, "paper-100"]) == 2
    (said,) = last_words(capsys)
    assert "has 3.9e+04 samples, too many for memory at once" in said
    assert main(["correlate", recording, "paper-100", "--search"]) == 0


@pytest.mark.parametrize("options", [[], ["--baseband"]])
def test_a_reference_too_long_for_memory_is_not_read(recording, capsys, monkeypatch, options):
    monkeypatch.setattr("polychirp.study.section_v.operands.MOST_IN_MEMORY", 1000)
    assert main(["correlate", recording, recording, "--search", *options]) == 2
    (said,) = last_words(capsys)
    assert "has 3.9e+04 samples, too many for memory at once" in said


SEARCH = "long.sigmf-meta", "paper-100", "--search"


@pytest.mark.parametrize(
    ("arguments", "option", "taker"),
    [
        *(
            ((*SEARCH, *option), option[0], "correlate A B")
            for option in (
                *(("--figure", "f.png"), ("--ambiguity", "a.png"), ("--save", "kept")),
                *(("--align",), ("--offset", "1 kHz"), ("--rate", "1 MS/s")),
                *(("--snr", "3 dB"), ("--radio", "loopback"), ("--doppler", "1 kHz")),
            )
        ),
        *(
            (("paper", *option), option[0], "correlate A B")
            for option in (
                *(("--ambiguity", "a.png"), ("--save", "kept"), ("--snr", "3 dB")),
                *(("--radio", "loopback"), ("--align",), ("--offset", "1 kHz"), ("--search",)),
                *(("--rate", "1 MS/s"), ("--baseband",), ("--sweeps", "2")),
            )
        ),
        ((*SEARCH, "--draws", "3"), "--draws", "correlate paper"),
        (("paper-100", "--draws", "3"), "--draws", "correlate paper"),
    ],
)
def test_an_option_without_an_effect_is_refused(arguments, option, taker, capsys):
    assert main(["correlate", *arguments]) == 2
    (said,) = last_words(capsys)
    assert f"{option}: 'correlate " in said
    assert said.endswith(f"' does not take it, but '{taker}' does")


def test_the_paper_is_correlated_with_nothing_else(capsys):
    assert main(["correlate", "paper", "paper-100"]) == 2
    (said,) = last_words(capsys)
    assert "'correlate paper' takes no B; leave out 'paper-100'" in said


def test_slopes_that_are_opposite_but_for_rounding_follow_the_law_of_opposite_slopes():
    rising = named("paper-100")
    falling = replace(
        rising.schedule,
        start_frequency=rising.schedule.stop_frequency,
        slope=-np.nextafter(rising.schedule.slope, np.inf),
    )
    pair = paired(rising, Operand(name="falling", schedule=falling))
    power, law = pair.law
    assert law == "−10 log₁₀(2 B T) + 2.6 dB for opposite slopes"
    assert 10 * math.log10(power) == pytest.approx(-10 * math.log10(2e4) + 2.56, abs=0.01)


@pytest.mark.parametrize(
    ("low", "bandwidth", "direction"),
    [
        (0.0, 100e6, "down"),
        (0.0, 60e6, "down"),
        (20e6, 100e6, "down"),
        (80e6, 120e6, "up"),
        (20e6, 90e6, "up"),
        (0.0, 20e6, "up"),
    ],
)
def test_a_law_of_the_peak_is_right_to_some_tenths_of_a_decibel(low, bandwidth, direction):
    """Bands that overlap in part, too; opposite slopes are those of 100 MHz in 100 µs."""
    falls = direction == "down"
    wave = Sawtooth(
        start_frequency=3.95e9 + low,
        bandwidth=bandwidth,
        ramp_duration=bandwidth / 1e12 if falls else 100e-6,
        direction=direction,
    )
    other = Operand(name="b", schedule=wave.schedule(num_sweeps=1, streams=Streams(1)))
    pair = paired(named("paper-100"), other)
    lag = np.linspace(-100e-6, 100e-6, 400_001)
    peak = np.max(np.abs(closed_form(pair, lag).amplitude)) ** 2
    assert 10 * math.log10(pair.law[0] / peak) == pytest.approx(0.0, abs=0.25)


def test_ramps_that_share_hardly_any_band_have_no_law():
    """One megahertz: 1 µs, where a Fresnel zone takes 2 µs; the peak is 8 dB below the law."""
    wave = Sawtooth(start_frequency=4.049e9, bandwidth=120e6, ramp_duration=100e-6)
    other = Operand(name="b", schedule=wave.schedule(num_sweeps=1, streams=Streams(1)))
    assert paired(named("paper-100"), other).law is None


def test_a_radio_without_its_package_is_one_sentence(capsys, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "SoapySDR", None)
    assert main(["correlate", "paper-100", "--radio", "soapy:driver=lime"]) == 3
    (said,) = last_words(capsys)
    assert "SoapySDR is not installed" in said


def test_named_waveforms_are_the_papers():
    assert {name: wave.bandwidth for name, wave in NAMED.items()} == {
        "paper-100": 100e6,
        "paper-120": 120e6,
    }

"""Studies of real radars that ``polychirp init`` writes, against what the radars' makers say."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import beta

from polychirp.capture.ti_profile import read_profile
from polychirp.cli.app import main
from polychirp.cli.radar_study import RADARS, profile_study, radar_study
from polychirp.config.load import load_study
from polychirp.config.monte_carlo import load_plan
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.model.if_frame import sample_times
from polychirp.study.check import check
from polychirp.study.spec import Study, schedule_of
from polychirp.study.trial import run_trial
from polychirp.units import to_db

CFG = """\
channelCfg 15 7 0
adcCfg 2 1
profileCfg 0 77 10 6 40 0 0 30 0 256 8000 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 4
frameCfg 0 1 32 0 40 1 0
"""
"""Commands of TI's mmWave SDK: two transmitters in turns, complex 1x samples at 8 MS/s."""

DEMOS = {
    "awr1843-short": (
        "channelCfg 15 5 0\nadcCfg 2 1\nprofileCfg 0 77.01 5 3 44 0 0 56.25 1 512 12500\n"
        "chirpCfg 0 0 0 0 0 0 0 1\nchirpCfg 1 1 0 0 0 0 0 4\nframeCfg 0 1 64 0 30 1 0\n"
    ),
    "awr1843-long": (
        "channelCfg 15 7 0\nadcCfg 2 1\nprofileCfg 0 76.01 5 4.8 60 0 0 4 1 256 4652\n"
        "chirpCfg 0 0 0 0 0 0 0 7\nframeCfg 0 0 128 0 30 1 0\n"
    ),
    "awr2944-long": (
        "channelCfg 15 13 0\nadcCfg 2 0\nprofileCfg 0 77 7 7 20.81 0 0 8.883 0 256 30000\n"
        "chirpCfg 0 5 0 0 0 0 0 13\nframeCfg 0 5 128 0 256 50 1 0\nddmPhaseShiftAntOrder 0 2 3\n"
    ),
}
"""Chirps of TI's demos, without the transmitter for elevation, as commands of the SDK."""


def written(folder: Path, text: str, name: str = "study.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", RADARS)
def test_a_radar_passes_its_check_and_has_a_grid(name, tmp_path):
    """Warnings are errors here, so that its target is within its range and its speeds."""
    path = written(tmp_path, radar_study(name))
    found = check(load_study(path))
    assert found.victims == ("front",)
    assert found.radars[0].receiver == ("coherent" if name == "paper" else "range-doppler")
    assert len(load_plan(path).points) == 4


@pytest.mark.parametrize("name", RADARS)
def test_every_figure_of_a_radars_hardware_has_its_source(name, tmp_path):
    """Front end and antennas say in a comment where they come from."""
    text = radar_study(name)
    tables = text[text.index("[defaults.radar]") : text.index("── the scene")]
    for key in ("transmit_power", "noise_figure", "peak_gain", "azimuth_beamwidth"):
        line = next(line for line in tables.splitlines() if line.startswith(f"{key} ="))
        assert any(word in line for word in ("typical", "TI", "paper", "table 2"))
    assert name == "paper" or "# Chirps: " in tables


@pytest.mark.parametrize("name", DEMOS)
def test_a_radar_has_the_chirps_of_its_makers_demo(name, tmp_path):
    """The same study follows from the demo's numbers, read as commands of the SDK."""
    cfg = written(tmp_path, DEMOS[name], "demo.cfg")
    expected = tomllib.loads(profile_study(read_profile(cfg), cfg))["defaults"]["radar"]
    found = tomllib.loads(radar_study(name))["defaults"]["radar"]
    for table in ("waveform", "converter", "if_filter"):
        assert found[table] == expected[table]
    assert found.get("coding") == expected.get("coding")
    assert found["array"]["num_channels"] == expected["array"]["num_channels"]
    assert found["array"].get("num_transmitters") == expected["array"].get("num_transmitters")


@pytest.mark.parametrize(("name", "level"), [("awr1843-long", -95.0), ("awr2944-long", -96.0)])
def test_a_radar_has_the_phase_noise_of_its_class(name, level, tmp_path):
    study = load_study(written(tmp_path, radar_study(name)))
    noise = study.radars[0].oscillator.phase_noise
    assert noise is not None
    assert to_db(noise.density(np.array([1e6])))[0] == pytest.approx(level)


def test_a_long_range_radar_resolves_1_m_to_250_m(tmp_path):
    found = check(load_study(written(tmp_path, radar_study("lrr-77")))).radars[0]
    assert found.range_resolution == pytest.approx((1.0, 1.0), abs=0.02)
    assert 250.0 < found.greatest_range < 270.0


def study_of(folder: Path, text: str) -> Study:
    path = written(folder, text, "radar.cfg")
    return load_study(written(folder, profile_study(read_profile(path), path)))


def test_a_profile_gives_its_chirps_and_its_samples(tmp_path):
    """40 µs at 30 MHz/µs are 1.2 GHz; complex 1x samples of 8 MS/s are 512 at 16 MS/s here.

    They begin 6 µs after a chirp's start and cover 32 µs, in which the chirp sweeps 960 MHz.
    """
    study = study_of(tmp_path, CFG)
    radar = study.radars[0]
    ramps = schedule_of(study, radar)
    assert ramps.num_ramps == 64
    assert ramps.start_frequency == pytest.approx(np.full(64, 77e9))
    assert ramps.bandwidth == pytest.approx(np.full(64, 1.2e9))
    assert np.diff(ramps.start_time) == pytest.approx(np.full(63, 50e-6))
    assert np.abs(ramps.transmit_weight).tolist() == 32 * [[1.0, 0.0], [0.0, 1.0]]
    times = sample_times(ramps, radar.converter)
    assert times.first - ramps.start_time == pytest.approx(np.full(64, 6e-6))
    assert set(times.num_samples.tolist()) == {512}
    assert times.rate == pytest.approx(16e6)
    found = check(study).radars[0]
    assert found.range_resolution[0] == pytest.approx(SPEED_OF_LIGHT / (2 * 960e6))
    assert found.greatest_range == pytest.approx(0.9 * 8e6 * SPEED_OF_LIGHT / 60e12)
    wavelength = SPEED_OF_LIGHT / 77.6e9
    assert found.unambiguous_speed == pytest.approx(wavelength / (4 * 100e-6))


@pytest.mark.parametrize(
    ("code", "samples", "usable"), [(0, 256, 0.45), (1, 512, 0.9), (2, 256, 0.45)]
)
def test_the_converters_format_sets_the_pass_band(tmp_path, code, samples, usable):
    """Real and complex 2x samples reach to 0.45 of the rate, complex 1x to 0.9 (SWRA553)."""
    study = study_of(tmp_path, CFG.replace("adcCfg 2 1", f"adcCfg 2 {code}"))
    radar = study.radars[0]
    assert radar.if_filter.passband == pytest.approx(usable * 8e6)
    assert radar.converter.sampling == ("real" if code == 0 else "complex")
    times = sample_times(schedule_of(study, radar), radar.converter)
    assert times.num_samples[0] == samples


def test_transmitters_that_send_together_add_up_on_the_axis(tmp_path):
    """Two fields in phase: four times the power density."""
    study = study_of(
        tmp_path, CFG.replace(" 0 0 0 0 1\n", " 0 0 0 0 3\n").replace("fg 0 1 32", "fg 0 0 32")
    )
    assert study.radars[0].transmit_gain == pytest.approx(4.0, rel=2e-3)
    assert study.radars[0].coding is None


def test_init_writes_the_study_of_a_profile_with_notes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, CFG, "corner radar.cfg")
    assert main(["init", "mine.toml", "--profile", "corner radar.cfg"]) == 0
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("note: txEnable: the file does not say where transmitters 1 and 3")
    assert said[-1] == "wrote mine.toml; next: polychirp check mine.toml"
    assert load_study("mine.toml").name == "corner-radar"
    assert main(["check", "mine.toml"]) == 0


@pytest.mark.parametrize(
    "options",
    [
        ["--radar", "paper", "--template", "paper"],
        ["--radar", "paper", "--profile", "a.cfg"],
        ["--template", "street", "--profile", "a.cfg"],
    ],
)
def test_two_studies_at_once_are_refused(tmp_path, monkeypatch, capsys, options):
    monkeypatch.chdir(tmp_path)
    assert main(["init", *options]) == 2
    assert "each give a whole study; keep one of them" in capsys.readouterr().err
    assert not Path("study.toml").exists()


def test_a_profile_that_cannot_be_read_leaves_no_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, CFG.replace("77", "seventy-seven"), "bad.cfg")
    assert main(["init", "--profile", "bad.cfg"]) == 2
    assert "bad.cfg: line 3, profileCfg: 'seventy-seven' is not a number" in capsys.readouterr().err
    assert not Path("study.toml").exists()


DRAWS = 6
"""Draws of the target's range and speed for each radar."""

FEWER = {"paper": 8, "awr2944-long": 192}
"""Sweeps of a frame, for a faster test; 96 for all that are not named: each code divides it.

The real samples of awr2944-long have 3 dB less SNR than complex ones: 18 dB at 100 m in 96 sweeps,
too few for its 24 noncoherent looks.
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", RADARS)
def test_a_radar_finds_its_target_at_drawn_ranges_and_speeds(name, tmp_path):
    """Detection rate beside an interferer, at 15 to 50 % of the range and 80 % of the speeds.

    With 5 of 6 found, the rate is above 0.418 with 95 % confidence (Clopper and Pearson).
    """
    text = radar_study(name)
    path = written(tmp_path, text)
    radar = check(load_study(path)).radars[0]
    reach = load_study(path).receiver.greatest_range
    speed = 20.0 if name == "paper" else min(0.8 * radar.unfolded_speed, 25.0)
    draw = np.random.default_rng(list(RADARS).index(name))
    found = 0
    for number in range(DRAWS):
        x = 2.33 + reach * draw.uniform(0.15, 0.5)
        velocity = 50 / 3.6 + draw.uniform(-speed, speed)
        study = load_study(
            path,
            overrides=[
                f"num_sweeps={FEWER.get(name, 96)}",
                f"seed={number}",
                f"street.points.0.x={x} m",
                f'street.points.0.velocity=["{velocity} m/s", "0 m/s", "0 m/s"]',
            ],
        )
        found += int(np.sum(run_trial(study).victim("front").score.is_detected))
    assert found > 0
    assert beta.ppf(0.05, found, DRAWS - found + 1) > 0.4, f"{found} of {DRAWS} found"

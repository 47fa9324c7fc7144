"""A radar with a raised transmitting element, from the study file to errors of elevations."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest

from polychirp.cli.app import main
from polychirp.cli.init import template
from polychirp.config.load import load_study
from polychirp.constants import SPEED_OF_LIGHT
from polychirp.errors import CapabilityError, ModelWarning
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.study.check import check
from polychirp.study.store.load import load_run
from polychirp.study.trial import run_trial
from tests.support.directions import direction_bound

SENDERS = "defaults.radar.array.transmitter_positions"

ELEMENTS = 0.5 * np.array([(x + 2 * n, n % 2) for n in range(3) for x in range(4)], dtype=float)
"""Virtual elements of the template, wavelengths: eight in a row, and four above their middle."""

HANN_LOSS = 1.5
"""Noise bandwidth of the window with which the SNR of a score is measured, in cells."""

TAPER_LOSS = 1.58**2
"""Noise bandwidths of the receiver's two windows, in cells, of `TAPER_SHAPE`."""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "elevation.toml"
    file.write_text(template("elevation"), encoding="utf-8")
    return file


def study(path: Path, *overrides: str):
    return load_study(path, overrides=overrides)


@pytest.mark.slow
def test_heights_of_a_sign_and_of_a_car_are_right_within_their_bound(path):
    """Elevation errors of 12 draws of the noise, over the bound for the receiver's windows.

    The raised element's turn is between those of the others, so that errors of the speed do not
    change the elevation. The rms of 24 errors is known to 14 %: 0.57 … 1.43 are 3 σ. Vertically,
    ESPRIT uses four pairs of the rows, and exceeds the bound by √(8/6).
    """
    ratios = {"bartlett": [], "esprit": []}
    for seed in range(12):
        victim = run_trial(study(path, f"seed={seed}")).victims[0]
        true = victim.truth
        assert victim.score.is_detected.all()
        assert np.degrees(true.elevation) == pytest.approx([8.45, 0.15], abs=0.01)
        power = victim.score.snr * HANN_LOSS / TAPER_LOSS / len(ELEMENTS)
        bound = [
            direction_bound(ELEMENTS, *angles, snr=snr)[1]
            for *angles, snr in zip(true.azimuth, true.elevation, power, strict=True)
        ]
        for estimator, errors in ratios.items():
            found = RangeDoppler(angle=estimator, greatest_range=45.0).detect(victim.frame)
            assert found.range == pytest.approx([38.65, 34.02], abs=0.02)
            errors.extend((found.elevation[::-1] - true.elevation) / bound)
    rms = {name: np.sqrt(np.mean(np.square(errors))) for name, errors in ratios.items()}
    assert 0.57 < rms["bartlett"] < 1.43
    assert 0.57 < rms["esprit"] / np.sqrt(8 / 6) < 1.43


def test_check_prints_the_window_and_run_prints_and_stores_elevations(path, tmp_path, capsys):
    assert main(["check", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "unambiguous azimuth" in printed
    assert "unambiguous elevation" in printed
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    assert "elevation error" in capsys.readouterr().out
    stored = load_run(tmp_path / "out" / "run.zarr").victims[0]
    assert stored.frame.array.transmitter_positions == ((0.0, 0.0), (2.0, 1.0), (4.0, 0.0))
    assert np.degrees(stored.detections.elevation[:2]) == pytest.approx([0.15, 8.45], abs=2.0)
    assert np.all(np.abs(stored.score.elevation_error) < np.radians(2.0))


def test_the_windows_are_in_the_json_of_check(path, capsys):
    assert main(["check", str(path), "--json"]) == 0
    (radar,) = json.loads(capsys.readouterr().out)["radars"]
    assert np.degrees(radar["azimuth_window"]) == pytest.approx(86.7, abs=0.1)
    assert np.degrees(radar["elevation_window"]) == pytest.approx(86.7, abs=0.1)


def test_elements_far_apart_are_warned_of(path):
    """Rows two wavelengths apart: sines 0.5 apart look equal, in a beam of ±7.5°, 0.26 wide.

    Rows four wavelengths apart are ambiguous in it.
    """
    check(study(path, f"{SENDERS}=[[0, 0], [2, 4], [4, 0]]"))
    with pytest.warns(ModelWarning, match="cannot tell apart directions in its elements' beam"):
        check(study(path, f"{SENDERS}=[[0, 0], [2, 8], [4, 0]]"))


@pytest.mark.parametrize(("wide", "tall"), [(60, 35), (80, 35), (35, 60), (60, 60), (100, 20)])
def test_the_window_of_staggered_rows_covers_the_beam_unless_a_warning_says_so(path, wide, tall):
    """Elements 0.7 λ aside and above each other: sines that differ by 0.714 in both look equal."""
    array = "defaults.radar.array."
    wavelength = SPEED_OF_LIGHT / 77e9
    overrides = [
        f'{array}spacing="{0.7e3 * wavelength} mm"',
        f"{array}num_channels=8",
        f"{array}channel_positions=[[0,0],[2,0],[4,0],[6,0],[1,1],[3,1],[5,1],[7,1]]",
        f"{array}num_transmitters=1",
        f"{array}transmitter_positions=[[0,0]]",
        'radars.0.coding={kind="time-division"}',
        f'{array}pattern.azimuth_beamwidth="{wide} deg"',
        f'{array}pattern.elevation_beamwidth="{tall} deg"',
    ]
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        (radar,) = check(study(path, *overrides)).radars
    window = np.array([radar.azimuth_window, radar.elevation_window])
    diagonal, straight = np.arcsin(0.25 / 0.7), np.arcsin(0.5 / 0.7)
    expected = [diagonal, straight] if tall > wide else [straight, diagonal]
    assert window == pytest.approx(expected, rel=0.01)  # the chirp's middle is above 77 GHz
    is_covered = bool(np.all(window >= np.radians([wide, tall]) / 2))
    assert is_covered != any("cannot tell apart" in str(one.message) for one in told)


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["receiver.angle=root-music"], "one horizontal or vertical line"),
        (['receiver.kind="coherent"'], "not at one height.*'range-doppler' reads any array"),
        ([f"{SENDERS}=[[0, 0], [2, 1.3], [4, 0.6]]", "receiver.angle=esprit"], "one shift up"),
        (
            [
                "defaults.radar.array.channel_positions=[[0, 0], [1, 0], [2, 0], [3, 1]]",
                'receiver.kind="coherent"',
            ],
            "receiving elements on a horizontal line",
        ),
    ],
)
def test_what_a_receiver_cannot_read_is_refused_before_the_run(path, overrides, message):
    with pytest.raises(CapabilityError, match=message) as caught:
        check(study(path, *overrides))
    assert str(caught.value).startswith("radars.0.array: ")
    with pytest.raises(CapabilityError, match=message):
        run_trial(study(path, *overrides))

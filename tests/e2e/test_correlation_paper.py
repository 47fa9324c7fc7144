"""Section V of the paper, from chirps to the table: what it must show."""

import json

import pytest

from polychirp.cli.app import main
from polychirp.report.correlation import (
    correlation_csv,
    correlation_json,
    shape_rows,
    write_correlation,
)
from polychirp.report.figures.correlation import slope_product
from polychirp.study.section_v.cases import correlation_cases, run_correlation
from polychirp.units import to_db

pytestmark = [pytest.mark.slow, pytest.mark.claims]


@pytest.fixture(scope="module")
def results():
    return run_correlation(seed=1, num_seeds=3)


def theory(results, name):
    return float(to_db(results.row(name).ideal.peak ** 2))


def level(results, name, snr=0):
    return results.row(name).modelled[snr].level_db.mean


def test_the_papers_two_cases_are_among_them():
    printed = [case for case in correlation_cases() if case.paper]
    assert {(c.sent.bandwidth, c.carrier) for c in printed} == {(100e6, 4e9), (120e6, 3.75e9)}


def test_like_signals_have_a_sharp_peak_in_theory_model_and_loop(results):
    row = results.row("auto")
    assert row.ideal.peak == pytest.approx(1.0)
    assert row.ideal.width == pytest.approx(8.86e-9, abs=0.01e-9)
    for one in row.modelled:
        assert one.level_db.mean == pytest.approx(0.0, abs=0.4)
        assert one.width_ns.mean == pytest.approx(9.19, abs=0.1)
        assert one.peak_side_lobe_db.mean == pytest.approx(-14.75, abs=0.5)
    assert row.looped_level_db == pytest.approx(0.0, abs=0.1)
    assert row.looped.lag == pytest.approx(0.0, abs=1e-10)


def test_the_printed_measurement_is_frequency_division(results):
    """A receiver at 4 GHz hears its own noise, whose peaks fall with the SNR asked for."""
    name = "cross, receiver stays"
    assert theory(results, name) == pytest.approx(-92.9, abs=0.1)
    levels = [level(results, name, n) for n in range(3)]
    assert levels[1] - levels[0] == pytest.approx(20.0, abs=0.5)
    assert levels[2] - levels[1] == pytest.approx(10.0, abs=0.5)


def test_overlapping_bands_follow_the_law(results):
    """1.37 dB above stationary phase; the model's filters round the overshoot off."""
    for row in results.rows:
        bend = slope_product(row)
        if bend > 0.0 and row.case.name != "falling":
            law = 1.37 - float(to_db(bend))
            assert float(to_db(row.ideal.peak**2)) == pytest.approx(law, abs=0.2)
            assert row.modelled[0].level_db.mean == pytest.approx(law, abs=0.8)
            assert row.looped_level_db == pytest.approx(row.modelled[0].level_db.mean, abs=0.3)


def test_on_a_real_radio_opposite_slopes_are_worth_its_image_rejection(results):
    """The image of a falling ramp is a rising one, −42.4 dB at each of both mixers."""
    assert theory(results, "falling") == pytest.approx(-40.5, abs=0.1)
    assert -37.5 < level(results, "falling") < -34.0


def test_intervals_widen_as_noise_grows(results):
    widths = [one.width_ns.half_width for one in results.row("auto").modelled]
    assert widths[0] < widths[1] < widths[2]


def test_everything_is_written_with_its_data(results, tmp_path):
    pictures = write_correlation(results, tmp_path)
    assert list(pictures) == ["fig06", "fig07-as-printed", "fig07-baseband", "slope-law"]
    for name, picture in pictures.items():
        assert picture.startswith(b"\x89PNG")
        assert (tmp_path / f"{name}.csv").read_text().count("\n") > 4
    lines = correlation_csv(results).splitlines()
    assert len(lines) == 1 + 3 * len(results.rows)
    json.dumps(correlation_json(results), allow_nan=False)
    assert [row[0] for row in shape_rows(results)][0::4] == ["theory", "loop-back"]


def test_the_command_prints_the_table(monkeypatch, capsys, results):
    monkeypatch.setattr("polychirp.study.section_v.cases.run_correlation", lambda **_: results)
    assert main(["correlate", "paper"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "cross, receiver" in printed
    assert "bands that share no frequency" in printed

"""Stored results are found by their folder and by the folder that they are in."""

import pytest

from polychirp.cli.plot import FILES
from polychirp.cli.stored import RUN, STUDY, drawn_files, stored_results
from polychirp.errors import InputError


@pytest.fixture
def both(tmp_path):
    for kind in (RUN, STUDY):
        (tmp_path / kind / kind).mkdir(parents=True)
        (tmp_path / kind / kind / "zarr.json").write_text("{}")
    return tmp_path


@pytest.mark.parametrize("kind", [RUN, STUDY])
def test_results_are_found_by_either_folder(both, kind):
    whole = both / kind / kind
    assert stored_results(str(whole)) == stored_results(str(both / kind)) == whole


def test_a_study_is_no_run(both):
    assert stored_results(str(both / RUN), folders=(RUN,)) == both / RUN / RUN
    for name in (both / STUDY, both / STUDY / STUDY, both / "nothing"):
        with pytest.raises(InputError, match=r"there is no run in .* into which 'run' stored"):
            stored_results(str(name), folders=(RUN,))


def test_the_message_names_both_kinds(both):
    with pytest.raises(InputError, match=r"no run and no study in .* 'run' or 'study' stored its"):
        stored_results(str(both / "nothing"))


@pytest.mark.parametrize(
    ("kind", "names"),
    [(RUN, ("detections", "range-rate-1", "maps-front")), (STUDY, ("curves-rcs", "differences-a"))],
)
def test_figures_and_pages_are_told_from_results_and_from_files_of_others(tmp_path, kind, names):
    drawn = {tmp_path / "report.html"}
    drawn |= {
        folder / f"{name}.{end}"
        for folder in (tmp_path, tmp_path / "figures")
        for name in names
        for end in (*FILES, "csv")
    }
    results = ("differences.csv", "summary.csv", "run.mat", "my-detections.csv", "ramps.txt")
    (tmp_path / "figures").mkdir()
    for path in (*drawn, *(tmp_path / name for name in results)):
        path.touch()
    assert set(drawn_files(tmp_path, kind)) == drawn


def test_the_log_of_trials_has_one_name():
    """The command has its own constant, since the module of the trials imports the kernels."""
    from polychirp.cli import stored
    from polychirp.study.monte_carlo import run

    assert stored.LOG == run.LOG

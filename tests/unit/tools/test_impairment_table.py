"""The table of impairments, from rows to Markdown and back."""

from polychirp.study.paper.scenarios import paper_study
from tools.experiments.impairments import IMPAIRMENTS, INTERFERER, VICTIM, ImpairedRow
from tools.pages.impairment_table import RECORD, impairment_table, write_impairments


def row(waveform, ghosts):
    return ImpairedRow(
        impairment="none", waveform=waveform, ghosts=ghosts, floor_rise_db=13.04, missed=1, others=2
    )


def test_a_row_has_both_waveforms_and_the_strongest_ghosts(tmp_path):
    ghosts = ((6.61, 23.6), (26.12, -10.5), (1.0, -20.0))
    write_impairments([row("conventional", ghosts), row("diverse", ())], tmp_path / RECORD)
    last = impairment_table(tmp_path).splitlines()[-1]
    assert last == (
        "| none | 6.6 m (+24 dB), 26.1 m (−10 dB), 1 more | 13.0 | 1 | 2 | – | 13.0 | 1 | 2 |"
    )


def test_every_impairment_changes_the_interferer_but_none():
    study = paper_study("conventional", radars=(VICTIM, INTERFERER))
    other = study.radars[1]
    assert other.name == INTERFERER
    same = [name for name, impair in IMPAIRMENTS.items() if impair(other) == other]
    assert same == ["none"]

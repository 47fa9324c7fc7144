"""The study files of the paper's street are the studies that the code makes."""

from pathlib import Path

import pytest

from polychirp.config.load import load_study
from polychirp.receiver.mitigation import Autoregression, Blanking, Imat, StftExcision
from polychirp.study.paper.scenarios import paper_study

FOLDER = Path(__file__).parents[3] / "studies" / "paper"
STUDIES = {
    "fig09-ideal": paper_study("conventional", radars=("vehicle-1", "vehicle-2")),
    "fig10-indirect": paper_study("conventional", radars=("vehicle-1", "vehicle-3")),
    "fig11-direct": paper_study("conventional", radars=("vehicle-2", "vehicle-4")),
    "street-diverse": paper_study("diverse", synchronous=False),
}


def test_every_file_is_looked_at():
    """`test_paper_statistics` looks at the last."""
    assert {path.stem for path in FOLDER.glob("*.toml")} == {*STUDIES, "fig12-13"}


@pytest.mark.parametrize("name", STUDIES)
def test_a_file_of_the_paper_is_the_study_that_the_code_makes(name):
    assert load_study(FOLDER / f"{name}.toml") == STUDIES[name]


def test_a_comment_of_a_file_says_what_works():
    path = FOLDER / "fig11-direct.toml"
    changes = [
        'victims=["vehicle-2"]',
        'defaults.radar.waveform={kind="diverse-triangular"}',
        'receiver.mitigation={kind="blanking"}',
    ]
    study = load_study(path, overrides=changes)
    assert study.victims == ("vehicle-2",)
    assert {radar.waveform.kind for radar in study.radars} == {"diverse-triangular"}
    assert study.receiver.mitigation is not None


@pytest.mark.parametrize(
    ("table", "method"),
    [
        ('{kind="blanking", taper="8 us"}', Blanking(taper=8e-6)),
        (
            '{kind="autoregression", order=32, longest_gap=0.5}',
            Autoregression(order=32, longest_gap=0.5),
        ),
        ('{kind="imat", depth="40 dB"}', Imat(depth=1e4)),
        ('{kind="stft-excision", cells="levelled"}', StftExcision(cells="levelled")),
    ],
)
def test_a_study_chooses_its_mitigation_by_kind(table, method):
    path = FOLDER / "fig11-direct.toml"
    study = load_study(path, overrides=[f"receiver.mitigation={table}"])
    assert study.receiver.mitigation == method

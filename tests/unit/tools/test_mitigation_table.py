"""The table of mitigations, from rows to Markdown and back."""

from tools.experiments.mitigations import MitigationRow
from tools.pages.mitigation_table import RECORD, mitigation_table, write_mitigations


def test_a_row_says_where_and_how_and_what_came_of_it(tmp_path):
    row = MitigationRow(
        scenario="C, direct",
        method="IMAT",
        sinr_db=99.401,
        evm=0.00213,
        floor_rise_db=-0.001,
        ghosts=1,
        others=2,
        echoes=4,
        missed=3,
        lost=0.0166,
        touched_clean=0.0006,
        loss_clean_db=0.014,
    )
    write_mitigations([row], tmp_path / RECORD)
    assert mitigation_table(tmp_path).splitlines()[-1] == (
        "| C, direct | IMAT | 99.4 | 0.213 | 0.0 | 1 | 2 | 3 | 4 | 1.66 | 0.060 | 0.010 |"
    )

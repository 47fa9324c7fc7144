from dataclasses import replace

import pytest

from polychirp.report.verdict import other_false_detections, row_in_words, row_of, verdicts


def answer(results, figure):
    return next(v for v in verdicts(results) if v.claim.figure == figure)


def with_row(results, row):
    """Results whose only row of that case is ``row``."""
    case = (row.scenario, row.radar, row.waveform)
    others = [r for r in results.rows if (r.scenario, r.radar, r.waveform) != case]
    return replace(results, rows=(*others, row))


def test_claims_hold_where_targets_and_ghosts_are_those_of_the_paper(results):
    holding = [v.claim.figure for v in verdicts(results) if v.holds]
    assert holding == ["9a", "9b", "10a", "10b", "11a"]


def test_a_claim_is_answered_by_radars_in_step_without_mitigation_whatever_the_order(results):
    backwards = replace(results, rows=results.rows[::-1])
    for verdict in verdicts(backwards):
        row = row_of(backwards, verdict.claim)
        assert row.mitigation == "none"
        assert row.synchronous


def test_a_case_that_was_not_computed_is_no_agreement(results):
    verdict = verdicts(replace(results, rows=results.rows[:1]))[-1]
    assert verdict.row is None
    assert verdict.differences == ("this case was not computed",)


@pytest.mark.parametrize(
    ("ghosts", "difference"),
    [
        ((), "no ghosts, where the paper has 1"),
        ((("direct", 6.6, 3.0), ("indirect", 9.0, 1.0)), "2 ghosts, where the paper has 1"),
        ((("direct", 8.0, 3.0),), "no ghost at 6.60 m"),
        ((("direct", 6.6, -3.0),), "no ghost is stronger than the targets"),
    ],
)
def test_a_different_ghost_is_named(results, make_row, ghosts, difference):
    row = make_row("C", "radar 2", ghosts=ghosts)
    assert difference in answer(with_row(results, row), "11a").differences


def test_ghosts_that_no_radar_made_do_not_count_against_a_claim(results, make_row):
    row = make_row("B", waveform="diverse", ghosts=(("multipath", 12.0, -20.0),))
    assert answer(with_row(results, row), "10b").holds


def test_a_target_found_far_from_the_claimed_range_is_a_difference(results, make_row):
    row = make_row()
    moved = replace(row.targets[0], range_error_m=0.6)
    row = replace(row, targets=(moved, *row.targets[1:]))
    assert answer(with_row(results, row), "9a").differences == ("no target is found at 6.50 m",)


def test_detections_that_nothing_explains_are_counted_beside_ghosts_of_interference(make_row):
    ghosts = (("direct", 6.6, 3.0), ("unexplained", 9.5, -9.0), ("unexplained", 3.7, -9.0))
    row = make_row("C", "radar 2", ghosts=ghosts)
    assert other_false_detections(row) == ["2 unexplained"]
    assert row_in_words(row).endswith("besides: unexplained at 9.50 m, unexplained at 3.70 m")
    assert other_false_detections(make_row()) == []

"""Tables of methods of mitigation, from records made by hand."""

import json

from tools.pages.benchmark_table import benchmark_tables
from tools.pages.published_table import published_table

MEASURED = {
    "sinr_range": (1.0, 2.0, 3.0),
    "floor_rise": (0.0, 4.0, 5.0),
    "detection": (0.5, 0.75, 1.0),
    "evm": (0.1, 0.2, 0.3),
    "phase_error": (0.0, 0.1, 0.2),
    "false_mitigation": (0.0, 0.011, 0.1),
    "precision": (0.5, 0.9, 1.0),
    "recall": (0.5, 0.8, 1.0),
    "f_score": (0.5, 0.85, 1.0),
}


def row(method, family="f", *, refusal=""):
    return {
        "method": method,
        "family": family,
        "refusal": refusal,
        "share_worse": None if refusal else 0.25,
        "summary": dict.fromkeys(MEASURED, (None, None, None)) if refusal else MEASURED,
    }


def test_harm_comes_first_and_a_refusal_has_no_numbers(tmp_path):
    rows = [row("nothing"), row("blanking"), row("burg-ramps", refusal="why"), row("nothing", "g")]
    rows += [row("blanking, bursts known"), row("clean oracle"), row("clean oracle", "g")]
    record = {"rows": rows, "seconds": {"blanking": {"direct": 0.0235}}}
    (tmp_path / "benchmark.json").write_text(json.dumps(record), encoding="utf-8")
    harm, floor, sinr, evm, known, detection, cost = benchmark_tables(tmp_path).split("\n\n**")
    assert "| burg-ramps | refuses | not measured |" in harm
    assert "| blanking | 25; 1.10 | not measured |" in harm
    assert "nothing" not in harm
    assert "| blanking | 4.0; 0.75 |" in floor
    assert "| blanking | 2.0 (1 … 3) |" in sinr
    assert "| blanking | 20.0; 5.7 |" in evm
    assert "| blanking | 2.0 | not measured |" in known
    assert "| blanking | 90; 80; 85 |" in detection
    assert "| blanking | detection alone | 23.5 | refuses |" in cost


def test_published_rows_are_sorted_by_their_median(tmp_path):
    rows = [
        {"method": name, "published": "–", "median": m, "low": m - 1, "high": m + 1, "tenth": m - 2}
        for name, m in (("good", 9.0), ("bad", -3.0))
    ]
    (tmp_path / "published.json").write_text(json.dumps(rows), encoding="utf-8")
    lines = published_table(tmp_path).splitlines()
    assert lines[2] == "| bad | -3.0 | -4.0 … -2.0 | -5.0 | – |"
    assert lines[3].startswith("| good")

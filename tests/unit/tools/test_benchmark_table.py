"""Tables of methods of mitigation, from records made by hand."""

import json

from tools.pages.benchmark_table import benchmark_tables
from tools.pages.published_table import published_table


def row(method, family, *, sinr=(1.0, 2.0, 3.0), refusal=""):
    values = {"sinr_range": sinr, "evm": (0.1, 0.2, 0.3), "ghosts": (0.0, 2.5, 9.0)}
    values["false_mitigation"] = (0.0, 0.011, 0.1)
    if refusal:
        values = dict.fromkeys(values, (None, None, None))
    return {
        "method": method,
        "family": family,
        "refusal": refusal,
        "share_worse": None if refusal else 0.25,
        "summary": values,
    }


def test_harm_comes_first_and_a_refusal_has_no_numbers(tmp_path):
    rows = [row("nothing", "f"), row("mine", "f", refusal="why"), row("clean oracle", "f")]
    (tmp_path / "benchmark.json").write_text(json.dumps([*rows, row("own", "f")]), encoding="utf-8")
    text = benchmark_tables(tmp_path)
    harm, sinr, _ = text.split("\n\n**")
    assert "| mine | refuses |" in harm
    assert "| own | 25; 1.1 |" in harm
    assert "nothing" not in harm
    assert "SINR along range" in sinr
    assert "| own | 2.0 (1 … 3) |" in text
    assert "| own | 20.0; 2 |" in text


def test_published_rows_are_sorted_by_their_median(tmp_path):
    rows = [
        {"method": name, "published": "–", "median": m, "low": m - 1, "high": m + 1, "tenth": m - 2}
        for name, m in (("good", 9.0), ("bad", -3.0))
    ]
    (tmp_path / "published.json").write_text(json.dumps(rows), encoding="utf-8")
    lines = published_table(tmp_path).splitlines()
    assert lines[2] == "| bad | -3.0 | -4.0 … -2.0 | -5.0 | – |"
    assert lines[3].startswith("| good")

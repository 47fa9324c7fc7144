"""The record of `polychirp paper`: all its results as strict JSON."""

from dataclasses import asdict, fields
from typing import Any

from polychirp.report.correlation import correlation_json
from polychirp.report.statistics import findings, shown_statistics
from polychirp.report.verdict import Verdict, verdicts
from polychirp.report.words import finite
from polychirp.study.paper.results import PaperResults, PaperRow


def results_json(results: PaperResults) -> dict[str, Any]:
    """Results as values for ``json.dumps(…, allow_nan=False)``: NaN and infinity become null.

    Range profiles and maps are left out; the profiles of figures 9 to 11 are in the CSV files
    beside the figures.
    """
    record = {
        "seed": results.seed,
        "versions": dict(results.versions),
        "wall_time_s": results.wall_time_s,
        "scenarios": [_scenario(row) for row in results.rows],
        "all_radars": [_scenario(row) for row in results.everyone],
        "consistent_antenna": [_scenario(row) for row in results.consistent],
        "claims": [_claim(verdict) for verdict in verdicts(results)],
        "notes": list(results.notes),
        "correlation": results.correlation and correlation_json(results.correlation),
        "statistics": [asdict(row) for row in results.statistics],
        "stored_statistics": results.stored and asdict(results.stored),
        "traced_statistics": results.traced and asdict(results.traced),
        "statistics_findings": findings(shown_statistics(results)),
    }
    values: dict[str, Any] = finite(record)
    return values


def _scenario(row: PaperRow) -> dict[str, Any]:
    arrays = {
        "profile_range",
        "profile_power_db",
        "detection_range",
        "detection_power_db",
        "map",
    }
    plain = {f.name: getattr(row, f.name) for f in fields(row) if f.name not in arrays}
    return {
        **plain,
        "targets": [asdict(target) for target in row.targets],
        "ghosts": [asdict(ghost) for ghost in row.ghosts],
        "detections": [
            {"range_m": float(range_), "power_dbm": float(power)}
            for range_, power in zip(row.detection_range, row.detection_power_db, strict=True)
        ],
    }


def _claim(verdict: Verdict) -> dict[str, Any]:
    return {
        **asdict(verdict.claim),
        "holds": verdict.holds,
        "differences": list(verdict.differences),
    }

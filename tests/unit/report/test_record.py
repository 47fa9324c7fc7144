import json
from dataclasses import replace

import jsonschema
import pytest

from polychirp.report.record import results_json

ASKED = {
    "type": "object",
    "required": ["seed", "versions", "wall_time_s", "scenarios"],
    "properties": {
        "seed": {"type": "integer"},
        "versions": {"type": "object"},
        "wall_time_s": {"type": "number"},
        "scenarios": {
            "type": "array",
            "minItems": 26,
            "items": {
                "type": "object",
                "required": [
                    "scenario",
                    "radar",
                    "waveform",
                    "synchronous",
                    "mitigation",
                    "targets",
                    "ghosts",
                    "missed",
                    "floor_rise_db",
                ],
                "properties": {
                    "scenario": {"enum": ["A", "B", "C"]},
                    "synchronous": {"type": "boolean"},
                    "missed": {"type": "integer"},
                    "floor_rise_db": {"type": ["number", "null"]},
                    "targets": {
                        "type": "array",
                        "items": {
                            "type": "object",
                            "required": [
                                "name",
                                "range_m",
                                "closing_speed_mps",
                                "azimuth_deg",
                                "detected",
                                "range_error_m",
                                "speed_error_mps",
                                "azimuth_error_deg",
                            ],
                        },
                    },
                    "ghosts": {
                        "type": "array",
                        "items": {
                            "type": "object",
                            "required": ["kind", "range_m", "power_over_strongest_target_db"],
                        },
                    },
                },
            },
        },
    },
}


def test_the_record_is_strict_json_with_the_promised_keys(results):
    text = json.dumps(results_json(results), allow_nan=False)
    jsonschema.validate(json.loads(text), ASKED)


def test_every_row_is_in_the_record_once(results):
    scenarios = results_json(results)["scenarios"]
    keys = ("scenario", "radar", "waveform", "synchronous", "mitigation")
    cases = [tuple(case[key] for key in keys) for case in scenarios]
    assert len(set(cases)) == len(cases) == len(results.rows)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_what_is_not_a_number_is_null(results, value):
    row = replace(results.rows[0], floor_rise_db=value)
    record = results_json(replace(results, rows=(row,)))
    assert record["scenarios"][0]["floor_rise_db"] is None
    json.dumps(record, allow_nan=False)


def test_a_missed_target_has_no_errors(results):
    missed = [
        target
        for case in results_json(results)["scenarios"]
        for target in case["targets"]
        if not target["detected"]
    ]
    assert missed
    assert all(target["range_error_m"] is None for target in missed)


def test_the_record_says_which_claims_hold(results):
    claims = {claim["figure"]: claim for claim in results_json(results)["claims"]}
    assert [figure for figure, claim in claims.items() if not claim["holds"]] == ["11b"]
    assert claims["11b"]["differences"] == ["no target is found at 13.65 m"]

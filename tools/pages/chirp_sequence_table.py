"""Tables of the how-to about a radar with equal chirps beside another one.

``python -m tools.pages.chirp_sequence_table FILE`` runs the template's study and stores what its
radar measures as JSON.
"""

from __future__ import annotations

import json
import sys
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any, Final

from polychirp import load_study, run_trial
from polychirp.units import to_db
from tools.pages.markdown import table

RECORD: Final = "chirp-sequence.json"
"""File with the numbers of the tables, in the folder of the validation pages."""

_IDLE: Final = "radars.1.waveform.idle"
_START: Final = "radars.1.start_time"
_MITIGATION: Final = "receiver.mitigation"

INTERVALS: Final = {"the same": "20 us", "50 ns longer": "20.05 us"}
"""Pause after the other radar's chirps, by the word for the interval of these chirps."""

MITIGATIONS: Final = {
    "none": None,
    "blanking": '{kind="blanking"}',
    "excision in time and frequency": '{kind="stft-excision"}',
}
"""Settings of the mitigation by the words for them."""

STARTS: Final = ("0.3 us", "0.45 us", "0.6 us", "0.75 us")
"""Starts of the other radar; the third one is that of the template."""


def measure() -> dict[str, list[dict[str, Any]]]:
    """Rows of both tables."""
    cases = []
    for interval, idle in INTERVALS.items():
        for mitigation, setting in MITIGATIONS.items():
            chosen = [f'{_IDLE}="{idle}"']
            chosen += [f"{_MITIGATION}={setting}"] if setting else []
            cases.append({"interval": interval, "mitigation": mitigation, **_measured(chosen)})
    real = _measured(["defaults.radar.converter.sampling=real"])
    cases.append({"interval": "the same", "mitigation": "none; real samples", **real})
    starts = [
        {
            "start": start,
            "interval": interval,
            **_measured([f'{_START}="{start}"', f'{_IDLE}="{idle}"']),
        }
        for start in STARTS
        for interval, idle in INTERVALS.items()
    ]
    return {"cases": cases, "starts": starts}


def _measured(settings: list[str]) -> dict[str, float]:
    """Results of the radar with these settings: number of ghosts, and levels in dB."""
    template = files("polychirp") / "cli" / "templates" / "chirp-sequence.toml"
    with as_file(template) as path:
        score = run_trial(load_study(path, overrides=settings)).victim("front").score
    return {
        "ghosts": len(score.ghosts),
        "floor_rise": round(float(to_db(score.floor_rise)), 2),
        "snr": round(float(to_db(score.snr[0])), 2),
        "sinr": round(float(to_db(score.mitigated_sinr[0])), 2),
    }


def chirp_sequence_tables(folder: Path) -> dict[str, str]:
    """Both tables by the names of their blocks."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    levels = ("ghosts", "floor rise", "SNR", "SINR")
    return {
        "chirp-sequence": table(
            ("interval of the other radar's chirps", "mitigation", *levels),
            [(row["interval"], row["mitigation"], *_cells(row)) for row in record["cases"]],
        ),
        "chirp-sequence-starts": table(
            ("start of the other radar", "interval of its chirps", *levels),
            [(_micro(row["start"]), row["interval"], *_cells(row)) for row in record["starts"]],
        ),
    }


def _micro(time: str) -> str:
    return time.replace(" us", " µs")


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    levels = (f"{row[name] + 0.0:.1f} dB" for name in ("floor_rise", "snr", "sinr"))
    return (str(row["ghosts"]), *levels)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")

"""Tables for docs/validation of methods of mitigation on a set of frames.

``python -m tools.pages.benchmark_table FILE`` measures what `polychirp benchmark` does, and stores
its summary. The file is written after each family.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from polychirp.study.mitigation.benchmark import (
    KNOWN,
    NO_MITIGATION,
    ORACLE,
    BenchmarkPlan,
    benchmark_record,
    benchmark_times,
    run_benchmark,
)
from polychirp.study.mitigation.frame_sets import FRAME_SETS, NEWEST
from polychirp.study.mitigation.own_methods import METHODS, SLOW_METHODS, methods_named
from polychirp.threads import num_cores
from tools.pages.markdown import table, three_digits

RECORD: Final = "benchmark.json"
"""File with the numbers of the tables, in the folder of the pages."""

FRAMES: Final = 6
"""Frames of every family; chosen: half an hour on two cores."""

SLOW_FRAMES: Final = 1
"""Frames of every family for slow methods; chosen: half a minute to a minute each."""

DETECTING: Final = "blanking"
"""Method whose detector is the default one, and stands for all that begin with it."""

NOT_MEASURED: Final = "not measured"
"""Entry of a method that has no row for a family."""

TIMED_FAMILIES: Final = ("direct", "street-ramps")
"""Families whose CPU times are shown: 64 chirps of 261 samples, and 8 ramps of some 1500."""

MULTIPLICATIONS: Final[Mapping[str, str]] = {
    "blanking": "detection alone",
    "blanking-amplitude": "4",
    "interpolation": "detection, and 4 per missing sample",
    "burg": "16 P per good sample beside a gap, 8 P per missing one (P = 32)",
    "burg-ramps": "the same from ramp to ramp (P = 8)",
    "autoregression": "4 g² (P + g/3) + 16 P³ per gap of g samples (P = 64)",
    "matrix-pencil": "16 (2 L)³ per gap (L = 64)",
    "imat": "8 K log₂ N per sample (K = 10)",
    "nulling": "8 C² per hit sample",
    "stft-zeroed": "64 log₂ W per sample (W = 32)",
    "stft-levelled": "64 log₂ W per sample",
    "stft-filled": "64 log₂ W per sample, and 16 N² per ramp for each line",
    "stft-statistics": "16 N log₂ N / L per sample (L = 64)",
    "wavelet": "64 per sample, of which mirror images add 256 to a ramp",
    "dual-sparsity": "100 to 400 log₂ N per sample and iteration (20)",
    "chirp-subtraction": "4 N² log₂ N per ramp and choice, 5 to 20 choices",
    "noise-canceller": "8 log₂ N + 8 L per sample (L = 8)",
    "ramp-minimum": "8 log₂ N + 4 per sample",
    "low-rank-hankel": "320 r N log₂ N per ramp and iteration (r = 10, 20 iterations)",
    "complex-network": "45 000 per sample, and 20 iterations of 8 log₂ N + 1500 for hit ramps",
}
"""Real multiplications per channel beside those of detection, 4 P² + 8 P per sample with P = 8; N
samples per ramp, C channels. They are those of the documentation of each method."""


def benchmark_tables(folder: Path) -> str:
    """Harm, floors, SINR, amplitudes and phases of every method and family; detection; cost."""
    record = json.loads((folder / RECORD).read_text(encoding="utf-8"))
    rows = record["rows"]
    families = list(dict.fromkeys(row["family"] for row in rows))
    of = {(row["method"], row["family"]): row for row in rows}
    methods = [name for name in dict.fromkeys(row["method"] for row in rows) if KNOWN not in name]
    own = [name for name in methods if name not in (NO_MITIGATION, ORACLE)]

    def body(names: list[str], shown: Callable[[dict[str, Any]], str]) -> str:
        lines = [
            (
                _marked(name),
                *(
                    shown(of[name, family]) if (name, family) in of else NOT_MEASURED
                    for family in families
                ),
            )
            for name in names
        ]
        return table(("method", *families), lines)

    parts = [
        ("frames made worse, %, and clean samples touched, %", body(own, _harm)),
        ("floor over that of the clean frame, dB, and Pd", body(methods[:-1], _floor)),
        ("SINR along range, dB: median (10 … 90 %)", body(methods, _sinr)),
        ("EVM, %, and phase error, degrees", body(methods[:-1], _evm)),
        ("SINR along range, dB, if the bursts are known", body(_repairs(of), _known(of))),
        (
            "detection of bursts: precision, recall and F, %",
            body([DETECTING, "stft-zeroed", "complex-network"], _detection),
        ),
        ("multiplications per channel, and CPU time of a frame", _costs(own, record["seconds"])),
    ]
    return "\n\n".join(f"**{title}**\n\n{lines}" for title, lines in parts)


def _marked(name: str) -> str:
    return f"{name} (slow: {SLOW_FRAMES} frame)" if name in SLOW_METHODS else name


def _median(row: Mapping[str, Any], name: str, scale: float = 1.0, digits: int = 1) -> str:
    value = row["summary"][name][1]
    return "–" if value is None else f"{round(scale * value, digits) + 0.0:.{digits}f}"


def _harm(row: dict[str, Any]) -> str:
    if row["refusal"]:
        return "refuses"
    return f"{100 * row['share_worse']:.0f}; {_median(row, 'false_mitigation', 100.0, 2)}"


def _floor(row: dict[str, Any]) -> str:
    return f"{_median(row, 'floor_rise')}; {_median(row, 'detection', 1.0, 2)}"


def _sinr(row: dict[str, Any]) -> str:
    low, median, high = row["summary"]["sinr_range"]
    return "–" if median is None else f"{median:.1f} ({low:.0f} … {high:.0f})"


def _evm(row: dict[str, Any]) -> str:
    return f"{_median(row, 'evm', 100.0)}; {_median(row, 'phase_error', 180.0 / math.pi)}"


def _detection(row: dict[str, Any]) -> str:
    return "; ".join(_median(row, name, 100.0, 0) for name in ("precision", "recall", "f_score"))


def _repairs(of: Mapping[tuple[str, str], Any]) -> list[str]:
    """Methods that were measured with known bursts too."""
    names = [name.removesuffix(KNOWN) for name, _ in of if name.endswith(KNOWN)]
    return list(dict.fromkeys(names))


def _known(of: Mapping[tuple[str, str], Any]) -> Callable[[dict[str, Any]], str]:
    def shown(row: dict[str, Any]) -> str:
        known = of.get((row["method"] + KNOWN, row["family"]))
        return NOT_MEASURED if known is None else _median(known, "sinr_range")

    return shown


def _costs(methods: list[str], seconds: Mapping[str, Mapping[str, float]]) -> str:
    """Multiplications, and CPU times of two kinds of frames, ms."""
    lines = []
    for name in methods:
        times = [seconds.get(name, {}).get(family) for family in TIMED_FAMILIES]
        shown = ["refuses" if one is None else three_digits(1000.0 * one) for one in times]
        lines.append((_marked(name), MULTIPLICATIONS[name], *shown))
    head = ("method", "real multiplications", *(f"{name}, ms" for name in TIMED_FAMILIES))
    return table(head, lines)


def write_benchmark(path: Path) -> None:
    """Measure all methods on all families, and store the summaries without frames."""
    rows: list[dict[str, Any]] = []
    seconds: dict[str, dict[str, float]] = {}
    for family in FRAME_SETS[NEWEST]:
        more, times = measured_family(family, workers=num_cores())
        rows += more
        for name, of_family in times.items():
            seconds.setdefault(name, {}).update(of_family)
        text = json.dumps({"rows": rows, "seconds": seconds}, indent=1, ensure_ascii=False)
        path.write_text(text + "\n", encoding="utf-8")
        print(f"{family}: {len(more)} rows", flush=True)


def measured_family(
    family: str, *, workers: int
) -> tuple[list[dict[str, Any]], dict[str, dict[str, float]]]:
    """Summaries of all methods on a family, and CPU times by method if they are shown."""
    methods = methods_named(tuple(METHODS), ())
    plan = BenchmarkPlan(
        methods=methods,
        families=(family,),
        num_frames=FRAMES,
        fewer=dict.fromkeys(SLOW_METHODS, SLOW_FRAMES),
        knows_bursts=True,
    )
    results = run_benchmark(plan, workers=workers)
    rows = benchmark_record(results, plan)["results"]
    for row in rows:
        del row["frames"]
        for name, values in row["summary"].items():
            row["summary"][name] = [None if v is None else round(v, 4) for v in values]
    return rows, benchmark_times(results) if family in TIMED_FAMILIES else {}


if __name__ == "__main__":
    write_benchmark(Path(sys.argv[1]))

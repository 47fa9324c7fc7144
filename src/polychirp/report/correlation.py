"""Tables and files of the paper's section V: paper, theory, model and loop-back side by side."""

import csv
import io
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from rich.table import Table

from polychirp.report.figures.correlation import correlation_drawings
from polychirp.report.tables import plain_table
from polychirp.report.words import decimal, finite
from polychirp.study.section_v.cases import CorrelationResults, Interval

NUM_WORD_COLUMNS: Final = 3
"""Number of leading columns with words in the table of peaks."""

SHAPE_HEAD: Final = ("Source", "Width (ns)", "Peak side lobe (dB)", "Integrated side lobes (dB)")
"""Columns of `shape_rows`."""

CORRELATION_CAPTIONS: Final[dict[str, str]] = {
    "fig06": "Equal chirps: theory on the left, transceiver model and loop-back recording on the "
    "right, on one scale; the upper panels show the lags about the peak. At half of the duration, "
    "±50 µs, the side lobes are widest, and a bin of the curve may lie between two of them.",
    "fig07-as-printed": "The second chirp at its own carrier, the receiver still at the first one: "
    "the bands do not overlap, and only noise is recorded. This is frequency division.",
    "fig07-baseband": "The same with the receiver tuned to the transmitted band: slope diversity, "
    "−10 log₁₀(|ΔB| T) + 1.4 dB.",
    "slope-law": "Highest peak of ramps that share a band, over the difference of their slopes.",
}
"""Captions of the figures of section V, by figure name."""


def interval_words(value: Interval, digits: int = 1) -> str:
    """A mean and the half width of its 95 % interval, with ``digits`` decimals.

    >>> interval_words(Interval(mean=-31.62, half_width=0.25))
    '−31.6 ± 0.2'
    """
    return f"{decimal(value.mean, digits)} ± {decimal(value.half_width, digits)}"


def correlation_table(results: CorrelationResults) -> Table:
    """One row for each case: peaks, dB relative to the energy of the signal without noise."""
    head, rows = peak_head(results), peak_rows(results)
    return plain_table("Section V: highest peak, dB", head, rows, num_words=NUM_WORD_COLUMNS)


def peak_head(results: CorrelationResults) -> list[str]:
    """Columns of `peak_rows`: `NUM_WORD_COLUMNS` of words, then numbers."""
    model = [f"Model, {one.snr_db:.0f} dB SNR" for one in results.rows[0].modelled]
    return ["Case", "Description", "The paper", "Theory", *model, "Loop-back"]


def peak_rows(results: CorrelationResults) -> list[list[str]]:
    """Cells of the table of peaks, one row for each case."""
    return [
        [
            row.case.name,
            row.case.says,
            row.case.paper or "–",
            decimal(20.0 * math.log10(row.ideal.peak), 1),
            *(interval_words(one.level_db) for one in row.modelled),
            decimal(row.looped_level_db, 1),
        ]
        for row in results.rows
    ]


def shape_table(results: CorrelationResults) -> Table:
    """Width and side lobes of the correlation of equal signals."""
    return plain_table("Shape of the auto-correlation", SHAPE_HEAD, shape_rows(results))


def shape_rows(results: CorrelationResults) -> list[list[str]]:
    """Cells of `shape_table`: theory, model, loop-back."""
    row = results.row("auto")

    def plain(name: str, lobes: Any) -> list[str]:
        levels = (lobes.peak_side_lobe, lobes.integrated_side_lobe)
        return [
            name,
            decimal(lobes.width * 1e9),
            *(decimal(10.0 * math.log10(level)) for level in levels),
        ]

    drawn = [
        [
            f"model, {one.snr_db:.0f} dB SNR",
            interval_words(one.width_ns, 2),
            interval_words(one.peak_side_lobe_db, 2),
            interval_words(one.integrated_side_lobe_db, 2),
        ]
        for one in row.modelled
    ]
    return [plain("theory", row.ideal), *drawn, plain("loop-back", row.looped)]


def correlation_csv(results: CorrelationResults) -> str:
    """Peaks of all cases, and lobes by the model, as CSV: one line for each case and SNR."""
    file = io.StringIO()
    writer = csv.DictWriter(file, list(_lines(results)[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(_lines(results))
    return file.getvalue()


def _lines(results: CorrelationResults) -> list[dict[str, object]]:
    lines = []
    for row in results.rows:
        for one in row.modelled:
            line: dict[str, object] = {
                "case": row.case.name,
                "paper": row.case.paper,
                "theory_peak_db": f"{20.0 * math.log10(row.ideal.peak):.3f}",
                "snr_db": f"{one.snr_db:.0f}",
            }
            for name, value in asdict(one).items():
                if name != "snr_db":
                    line[name] = f"{value['mean']:.3f}"
                    line[f"{name}_half_width"] = f"{value['half_width']:.3f}"
            line["loop_back_peak_db"] = f"{row.looped_level_db:.3f}"
            lines.append(line)
    return lines


def correlation_json(results: CorrelationResults) -> dict[str, Any]:
    """All results except the curves; theory and loop-back in SI, others with units in names."""
    return {
        "seed": results.seed,
        "draws": results.num_seeds,
        "notes": list(results.notes),
        "cases": [
            {
                "name": row.case.name,
                "says": row.case.says,
                "paper": row.case.paper or None,
                "theory": finite(asdict(row.ideal)),
                "model": [asdict(one) for one in row.modelled],
                "loop_back": {**finite(asdict(row.looped)), "level_db": row.looped_level_db},
            }
            for row in results.rows
        ],
    }


def write_correlation(results: CorrelationResults, folder: Path) -> dict[str, bytes]:
    """Write figures, their data and ``correlation.csv``; gives the PNG files by figure name."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = {name: draw().save(folder, name) for name, draw in correlation_drawings(results)}
    (folder / "correlation.csv").write_text(correlation_csv(results), encoding="utf-8")
    return pictures

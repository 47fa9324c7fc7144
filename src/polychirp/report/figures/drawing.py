"""`Drawing`, a figure with its data, and the common style of all figures."""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, Final, ParamSpec

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from polychirp.study.csv_cells import safe_cell

STYLE_FILE: Final = Path(__file__).parents[1] / "style.mplstyle"

BLUE: Final = "#0072B2"
VERMILION: Final = "#D55E00"
GREEN: Final = "#009E73"
PURPLE: Final = "#CC79A7"
ORANGE: Final = "#E69F00"
SKY: Final = "#56B4E9"
INK: Final = "#222222"
GREY: Final = "#7A7A7A"
"""Colours of Okabe and Ito (2008), which colour-blind eyes can tell apart, and two greys."""

LABEL_BOX: Final = {"boxstyle": "square,pad=0.1", "facecolor": "white", "alpha": 0.85, "lw": 0}
"""Box behind a label, so that the lines below do not cross its letters."""

Column = Sequence[Any] | NDArray[Any]
"""A column of a table: one number or word for every row."""

P = ParamSpec("P")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Drawing:
    """A figure and its data: columns of equal length, whose names contain their units.

    `draw` returns it.
    """

    figure: Figure
    data: Mapping[str, Column]

    def png(self) -> bytes:
        """The figure as a PNG file; equal figures give equal bytes."""
        return self.picture("png")

    def csv(self) -> str:
        """The data as a CSV file; numbers have seven significant digits."""
        return csv_of(self.data)

    def picture(self, form: str) -> bytes:
        """The figure as a file of the format ``png``, ``svg`` or ``pdf``, as `png`."""
        file = io.BytesIO()
        unset = {"png": ("Software",), "svg": ("Date",), "pdf": ("CreationDate",)}[form]
        with mpl.rc_context(fname=STYLE_FILE, rc={"svg.hashsalt": "polychirp"}):
            self.figure.savefig(file, format=form, metadata=dict.fromkeys(unset))
        return file.getvalue()

    def save(self, folder: Path, name: str, *, formats: Sequence[str] = ("png",)) -> bytes:
        """Write ``NAME.png`` and ``NAME.csv`` into ``folder``, or the picture in other formats.

        The bytes of the first picture are returned.
        """
        pictures = [self.picture(form) for form in formats]
        for form, picture in zip(formats, pictures, strict=True):
            (folder / f"{name}.{form}").write_bytes(picture)
        (folder / f"{name}.csv").write_text(self.csv(), encoding="utf-8")
        return pictures[0]


def csv_of(data: Mapping[str, Column]) -> str:
    r"""Columns of equal length as a CSV file; numbers have seven significant digits.

    >>> csv_of({"label": ["-10 dB"], "snr_db": [-10.0]})
    "label,snr_db\n'-10 dB,-10\n"
    """
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(_cell(name) for name in data)
    for line in zip(*data.values(), strict=True):
        writer.writerow(_cell(value) for value in line)
    return file.getvalue()


def _cell(value: Any) -> str:
    return f"{value:.7g}" if hasattr(value, "__float__") else str(safe_cell(value))


def styled(draw: Callable[P, Drawing]) -> Callable[P, Drawing]:
    """Decorator that draws a figure in the common style, whatever the user's settings are."""

    @wraps(draw)
    def draw_in_style(*args: P.args, **kwargs: P.kwargs) -> Drawing:
        with mpl.rc_context(fname=STYLE_FILE):
            return draw(*args, **kwargs)

    return draw_in_style


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of ``width`` × ``height`` inches, outside of pyplot's global state."""
    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure

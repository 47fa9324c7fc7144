"""Pictures of the figures that `polychirp.draw` returns, which do not belong to pyplot."""

from typing import Any
from weakref import WeakKeyDictionary

from sphinx_gallery.scrapers import figure_rst

from polychirp.report.figures.drawing import Drawing

_shown: WeakKeyDictionary[Any, bool] = WeakKeyDictionary()
"""Figures that were saved already: a script keeps its variables from block to block."""


def drawings(block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """Save the new figures of a block; return what shows them."""
    del block
    saved = []
    for value in [*block_vars["example_globals"].values()]:
        if isinstance(value, Drawing) and value.figure not in _shown:
            _shown[value.figure] = True
            path = next(block_vars["image_path_iterator"])
            with open(path, "wb") as file:  # noqa: PTH123  # the path is text
                file.write(value.png())
            saved.append(path)
    return str(figure_rst(saved, gallery_conf["src_dir"]))

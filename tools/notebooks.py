"""Runs the notebooks of the documentation site: ``./run notebooks``, after ``./run docs``.

The site makes each of them of a script of ``docs/tutorials`` or ``docs/gallery``. A notebook runs
in an empty folder with a kernel of its own, as for somebody who downloads it.
"""

import os
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

DOCS: Final = Path(__file__).parents[1] / "docs"

LONGEST: Final = 600
"""Time after which a cell is stopped, s. The slowest takes a minute on two busy cores."""


def notebooks() -> list[Path]:
    """Notebook of every script of the site.

    Raises
    ------
    FileNotFoundError
        The site has not been built, or has no notebook of a script.
    """
    scripts = sorted([*DOCS.glob("tutorials/tutorial_*.py"), *DOCS.glob("gallery/plot_*.py")])
    found = [DOCS / "generated" / script.parent.name / f"{script.stem}.ipynb" for script in scripts]
    missing = [path.name for path in found if not path.exists()]
    if missing:
        raise FileNotFoundError(f"there is no {', '.join(missing)}; build the site by ./run docs")
    return found


def error_of(path: Path) -> str:
    """Error of a notebook, after its name; empty if it runs."""
    import nbformat  # of requirements-docs.lock, as nbclient: not everybody has it
    from nbclient import NotebookClient
    from nbclient.exceptions import CellExecutionError

    began = time.perf_counter()
    notebook = nbformat.read(path, as_version=nbformat.NO_CONVERT)
    error = ""
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook,
            timeout=LONGEST,
            kernel_name="python3",
            resources={"metadata": {"path": folder}},
        )
        try:
            client.execute()
        except CellExecutionError as failure:
            error = str(failure)
    print(f"{path.stem}: {time.perf_counter() - began:.0f} s", flush=True)
    return f"{path.stem} fails: {error}" if error else ""


def main() -> int:
    """Run all notebooks, two at a time; 1 if one fails."""
    with ThreadPoolExecutor(max_workers=min(2, os.cpu_count() or 1)) as pool:
        errors = [error for error in pool.map(error_of, notebooks()) if error]
    for error in errors:
        print(error, file=sys.stderr)
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())

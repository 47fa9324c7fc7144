"""Pages of all packages with their public names, in the groups of ARCHITECTURE.md."""

import re
from pathlib import Path
from typing import Final

import rst
from sphinx.application import Sphinx

ROOT: Final = Path(__file__).parents[2]
SOURCE: Final = ROOT / "src" / "polychirp"
OPTIONS: Final = (":members:", ":show-inheritance:")


def layers() -> dict[str, list[str]]:
    """Packages and modules of each layer, from the table in ARCHITECTURE.md."""
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    _, _, below = text.partition("| layer | packages | content |\n")
    found = {}
    for row in below.splitlines()[1:]:
        if not row.startswith("|"):
            break
        layer, names, _ = (cell.strip() for cell in row.strip("|").split("|"))
        found[layer] = re.findall(r"`(\w+)`", names)
    return found


def modules(folder: Path) -> list[Path]:
    """Modules of a package without those of its subpackages."""
    return sorted(
        path for path in folder.glob("*.py") if path.name not in ("__init__.py", "__main__.py")
    )


def packages(folder: Path) -> list[Path]:
    """Subpackages of a package."""
    return sorted(path.parent for path in folder.glob("*/__init__.py"))


def name_of(path: Path) -> str:
    """Dotted name of a module or a package."""
    return ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)


def package_page(folder: Path) -> list[str]:
    """The page of one package: its text, its modules, and links to its subpackages."""
    name = name_of(folder)
    lines = [*rst.heading(name, "="), *rst.directive(f"automodule:: {name}", ":no-members:")]
    inner = packages(folder)
    if inner:
        lines += rst.directive("toctree::", ":titlesonly:", content=[name_of(one) for one in inner])
    for path in modules(folder):
        lines += [*rst.heading(name_of(path).removeprefix("polychirp."), "-")]
        lines += rst.directive(f"automodule:: {name_of(path)}", *OPTIONS)
    return lines


def index_page(groups: dict[str, list[str]]) -> list[str]:
    """The page that leads to all packages."""
    lines = [
        *rst.heading("All modules", "="),
        "Every public name of every module, from its docstring. The names that are stable are on "
        "the page :doc:`/reference/api`; :doc:`/project/architecture` explains the layers.",
        "",
    ]
    for layer, names in groups.items():
        content = [f"polychirp.{name}" for name in names]
        lines += rst.directive("toctree::", ":titlesonly:", f":caption: {layer}", content=content)
    return lines


def module_page(path: Path) -> list[str]:
    """The page of one module that is in no package."""
    name = name_of(path)
    return [*rst.heading(name, "="), *rst.directive(f"automodule:: {name}", *OPTIONS)]


def write_pages(app: Sphinx) -> None:
    """Write all pages before the builder reads them, and remove those of packages that are gone."""
    folder = Path(app.srcdir) / "generated" / "modules"
    groups = layers()
    pages = {"index": index_page(groups)}
    inits = sorted(SOURCE.rglob("*/__init__.py"))
    pages |= {name_of(init.parent): package_page(init.parent) for init in inits}
    tops = [SOURCE / f"{name}.py" for names in groups.values() for name in names]
    pages |= {name_of(path): module_page(path) for path in tops if path.exists()}
    for name, lines in pages.items():
        rst.write(folder / f"{name}.rst", lines)
    for old in folder.glob("*.rst"):
        if old.stem not in pages:
            old.unlink()


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writer."""
    app.connect("builder-inited", write_pages)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

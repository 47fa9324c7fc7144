"""The repository holds nothing of the machine it was written on, and says what it is."""

import re
import subprocess
import tomllib
from importlib.metadata import version
from pathlib import Path

ROOT = Path(__file__).parents[2]
MADE = {"__pycache__", "build", "dist", "out", "results", "shared"}
"""Folders that tools make, for a copy of the sources without git."""

# Written so that no pattern finds itself.
MACHINE = re.compile(
    r"(?<![\w.])/(?:farm|home|root|work|Users)/"  # an absolute path
    r"|index[-_]url"  # a package registry, as an option or a setting
    r"|pythonhosted[.]org",
    re.IGNORECASE,
)


def repository_files() -> list[Path]:
    """Files that are or would be committed."""
    try:
        listing = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    except (FileNotFoundError, subprocess.CalledProcessError):
        paths = [path.relative_to(ROOT) for path in ROOT.rglob("*")]
        names = [
            path
            for path in paths
            if not any(part in MADE or part.startswith(".") for part in path.parts)
        ]
    else:
        names = [Path(name) for name in listing.split("\0") if name]
    return sorted(ROOT / name for name in names if (ROOT / name).is_file())


def machine_names(text: str) -> list[str]:
    """Line number and text of everything that names a machine."""
    return [
        f"{number}: {found[0]}"
        for number, line in enumerate(text.splitlines(), start=1)
        for found in MACHINE.finditer(line)
    ]


def test_the_pattern_finds_what_it_is_for():
    slash = "/"
    assert machine_names(f"see\n{slash}root{slash}notes") == [f"2: {slash}root{slash}"]
    assert machine_names("--extra-index" + "-url x")
    assert not machine_names("https://example.org/work/of/others and ./root/x")


def test_no_file_names_this_machine():
    files = repository_files()
    assert ROOT / "pyproject.toml" in files
    found = []
    for path in files:
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue
        found += [f"{path.relative_to(ROOT)}:{place}" for place in machine_names(text)]
    assert found == []


def test_the_lock_names_hashes_and_no_host():
    lock = (ROOT / "requirements.lock").read_text(encoding="utf-8")
    assert "--hash=sha256:" in lock
    assert "://" not in lock
    locks = {"uv.lock", "pylock.toml"} & {path.name for path in repository_files()}
    assert locks == set()


def test_the_licence_is_apache():
    licence = (ROOT / "LICENSE").read_text(encoding="utf-8")
    assert "Apache License" in licence
    assert "The polychirp authors" in licence


def test_every_place_that_states_the_version_agrees():
    with (ROOT / "pyproject.toml").open("rb") as file:
        stated = tomllib.load(file)["project"]["version"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    cited = re.search(r"^version: (\S+)$", citation, re.MULTILINE)
    assert cited is not None
    assert cited[1] == stated
    assert version("polychirp") == stated

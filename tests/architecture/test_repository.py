"""The repository holds nothing of the machine it was written on, and says what it is."""

import re
import subprocess
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

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


LOCKS = ("requirements.lock", "requirements-docs.lock")


@pytest.mark.parametrize("name", LOCKS)
def test_a_lock_names_hashes_and_no_host(name):
    lock = (ROOT / name).read_text(encoding="utf-8")
    assert "--hash=sha256:" in lock
    assert "://" not in lock


def test_there_are_no_other_locks():
    locks = {path.name for path in repository_files() if path.suffix == ".lock"}
    assert locks == set(LOCKS)
    assert {"pylock.toml"} & {path.name for path in repository_files()} == set()


def test_both_locks_have_the_same_versions():
    """The documentation runs examples with the packages that the tests have."""
    versions = [
        set(re.findall(r"^([a-z0-9-]+==\S+)", (ROOT / name).read_text(), re.MULTILINE))
        for name in LOCKS
    ]
    names = [{one.partition("==")[0] for one in found} for found in versions]
    shared = names[0] & names[1]
    assert "numpy" in shared
    tests, docs = ({one for one in found if one.partition("==")[0] in shared} for found in versions)
    assert docs <= tests


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
    entry = (ROOT / "docs/reference/cite.md").read_text(encoding="utf-8")
    assert f"version = {{{stated}}}" in entry


def test_the_newest_release_has_its_date_and_notes():
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    headings = re.findall(r"^## (.+)$", changelog, re.MULTILINE)
    assert headings[0] == "[Unreleased]"
    number, day = re.fullmatch(r"\[(\d+\.\d+\.\d+)\] - (\d{4}-\d\d-\d\d)", headings[1]).groups()
    with (ROOT / "pyproject.toml").open("rb") as file:
        assert tomllib.load(file)["project"]["version"].startswith(number)
    assert (ROOT / "docs" / "releases" / f"{number}.md").is_file()
    assert f"date-released: {day}" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_image_is_made_of_files_that_exist_and_runs_without_root():
    lines = (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()
    copied = [
        source
        for line in lines
        if line.startswith("COPY ") and "--from" not in line
        for source in line.split()[1:-1]
    ]
    assert "src" in copied
    assert [source for source in copied if not (ROOT / source).exists()] == []
    sent = (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines()
    assert {f"!{source}" for source in copied} == {line for line in sent if line.startswith("!")}
    assert "USER polychirp" in lines
    assert 'ENTRYPOINT ["polychirp"]' in lines

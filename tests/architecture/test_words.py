"""Texts and names use the words of the glossary; docstrings and constants say what they are."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GLOSSARY = ROOT / "docs" / "reference" / "glossary.md"
PLACES = {
    "src": (".py", ".toml", ".html"),
    "docs": (".md",),
    "tools": (".py",),
    "bench": (".py",),
    "studies": (".toml",),
}
"""Folders that are searched, and the files in them."""

PAPER = re.compile(r"paper|--claims", re.IGNORECASE)
"""A line about the paper, or the tests of its claims: the paper's statements are claims."""
PAPER_FILES = {
    "src/polychirp/cli/paper.py",
    "src/polychirp/report/__init__.py",
    "src/polychirp/report/answer.py",
    "src/polychirp/report/html.py",
    "src/polychirp/report/paper.py",
    "src/polychirp/report/record.py",
    "src/polychirp/report/tables.py",
    "src/polychirp/report/templates/page.html",
    "src/polychirp/report/verdict.py",
    "src/polychirp/report/words.py",
    "src/polychirp/study/paper/results.py",
    "src/polychirp/study/paper/scenarios.py",
}
"""Modules that compare results with the paper's claims, so that each `claim` there is one."""

QUESTIONS = {"what", "of", "whether", "how", "where", "which", "who", "tell", "tells"}
"""Words with which no docstring opens: it is a noun phrase or a sentence."""

VAGUE_CONSTANTS = {
    "AFTERWARDS", "AHEAD", "ALIKE", "BEHIND", "CHANCE", "CLEAR", "CLOSE", "CLOSEST", "COARSEST",
    "DROWNED", "EQUAL", "FAINT", "FARTHEST", "FEW", "FEWEST", "FILLED", "FINE", "FREE", "GRAIN",
    "HELD", "HOPELESS", "INAUDIBLE", "KEPT", "LARGEST", "LEAST", "LIFT", "LIKELY", "LITTLE",
    "LONGEST", "LOOK", "LOUD", "MIDDLE", "MISS", "MOST", "NEAR", "NEAREST", "NEARNESS",
    "NEGLIGIBLE", "NEVER", "NOISY", "NOTHING", "NOWHERE", "OFF", "PAST", "PATIENCE", "REACH",
    "READY", "ROOM", "SAME", "SENT", "SETTLED", "SETTLING", "SHINE", "SHORT", "SHOWN", "SKIN",
    "SLACK", "SLOW", "SMALL", "SMALLEST", "STEADY", "STEEP", "STRAIGHT", "SWELL", "TOLD", "TOUCH",
    "TRUE", "UNMOVED", "VEILED", "WEAK", "WIDE", "WIDEST", "WORTH",
}  # fmt: skip
"""Adjectives and figures of speech that say neither what a constant is nor what it is for."""


def files() -> list[Path]:
    """Sources and pages whose words are checked."""
    inner = [
        path
        for folder, suffixes in PLACES.items()
        for path in (ROOT / folder).rglob("*")
        if path.suffix in suffixes and path != GLOSSARY
    ]
    return sorted([*inner, *ROOT.glob("*.md"), ROOT / "run"])


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


FILES = files()
SOURCES = [path for path in FILES if path.suffix == ".py"]


def avoided() -> dict[str, str]:
    """Left and right column of the glossary's table of words that are not used."""
    _, _, section = GLOSSARY.read_text(encoding="utf-8").partition("| do not use | use |")
    rows = re.findall(r"^\| ([^|]+?) \| ([^|]+?) \|$", section, re.MULTILINE)
    return dict(rows)


def pattern(word: str) -> re.Pattern[str]:
    """Pattern that finds a word in text and in names of code; a single word with its endings."""
    stem = r"[\s_-]+".join(re.escape(part) for part in word.split())
    ending = "" if " " in word else "(?:s|es|ed|ing)?"
    return re.compile(rf"(?<![a-z]){stem}{ending}(?![a-z])", re.IGNORECASE)


PATTERNS = {word: (pattern(word), use) for word, use in avoided().items()}


def offences(text: str, name: str = "") -> list[str]:
    """Place, word and replacement of all words in a text that are not used."""
    lines = text.splitlines()
    found = []
    for word, (search, use) in PATTERNS.items():
        for hit in search.finditer(text):
            number = text.count("\n", 0, hit.start()) + 1
            about_paper = name in PAPER_FILES or PAPER.search(lines[number - 1])
            if word == "claim" and about_paper:
                continue
            found.append(f"{name}:{number}: '{hit[0]}'; use {use}")
    return found


def docstrings(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """All docstrings of a module: of itself, its classes, functions and constants."""
    for node in ast.walk(tree):
        match node:
            case ast.Expr(value=ast.Constant(value=str(text))):
                yield text, node.lineno


def constants(tree: ast.Module) -> Iterator[tuple[str, int]]:
    """Names that a module or its classes define by an assignment."""
    scopes: list[ast.Module | ast.ClassDef] = [tree]
    while scopes:
        for node in scopes.pop().body:
            match node:
                case ast.ClassDef():
                    scopes.append(node)
                case ast.AnnAssign(target=ast.Name(id=name)):
                    yield name, node.lineno
                case ast.Assign(targets=targets):
                    names = (n.id for t in targets for n in ast.walk(t) if isinstance(n, ast.Name))
                    yield from ((name, node.lineno) for name in names)


def test_the_glossary_has_both_tables():
    assert PATTERNS["claim"][1] == "detection"
    assert GLOSSARY.read_text(encoding="utf-8").count("\n| word | meaning |\n") == 1


def test_the_patterns_find_what_they_are_for():
    assert sorted(offences("radars in\nstep, num_claims and BEARINGS")) == [
        ":1: 'in\nstep'; use starting together, synchronous",
        ":2: 'BEARINGS'; use azimuth",
        ":2: 'claims'; use detection",
    ]
    assert offences("the paper's claims; a proclaimed instep in steps of 1°; disclaimed") == []


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_no_text_or_name_uses_an_avoided_word(path: Path):
    assert offences(path.read_text(encoding="utf-8"), name_of(path)) == []


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_no_docstring_opens_with_a_question_word(path: Path):
    found = [
        f"{name_of(path)}:{line}: {text.split(maxsplit=6)[:6]}"
        for text, line in docstrings(ast.parse(path.read_text(encoding="utf-8")))
        if text.split() and text.split()[0].lower().strip("…,:;.") in QUESTIONS
    ]
    assert found == []


@pytest.mark.parametrize(
    "path", [path for path in SOURCES if "src" in path.relative_to(ROOT).parts], ids=name_of
)
def test_no_constant_is_one_vague_word(path: Path):
    found = [
        f"{name_of(path)}:{line}: {name}"
        for name, line in constants(ast.parse(path.read_text(encoding="utf-8")))
        if name.strip("_") in VAGUE_CONSTANTS
    ]
    assert found == []

"""Pages of the documentation as files and commands: their fenced blocks, and tables to paste."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]

_FENCE = re.compile(
    r"(?:^<!-- test: (?P<mark>.*?) -->\n+)?^```(?P<language>\w*)\n(?P<text>.*?)^```$",
    re.DOTALL | re.MULTILINE,
)
_TABLE = re.compile(r"^\[\[?(?P<name>[^\]]+)\]\]?", re.MULTILINE)


@dataclass(frozen=True)
class Block:
    """A fenced block, and the HTML comment ``<!-- test: MARK -->`` before it.

    ``slow`` blocks run with the slow tests; ``parse`` blocks need what a test has not, and only the
    arguments of their commands are read; ``paste into FILE`` names the study of a TOML block.
    """

    language: str
    text: str
    mark: str

    @property
    def commands(self) -> list[str]:
        """Lines of a shell block without comments, those that end in a backslash joined."""
        lines = self.text.replace("\\\n", " ").splitlines()
        return [line.strip() for line in lines if line.strip() and not line.startswith("#")]


def blocks_of(page: Path) -> list[Block]:
    """All fenced blocks of a page, in order."""
    found = _FENCE.finditer(page.read_text(encoding="utf-8"))
    return [Block(one["language"], one["text"], one["mark"] or "") for one in found]


def pasted(study: str, snippet: str) -> str:
    """The study with a snippet in it, as the pages say: its keys and tables replace their likes."""
    keys, tables = _parts(study)
    new_keys, new_tables = _parts(snippet)
    for key in re.findall(r"^(\w+) *=", new_keys, re.MULTILINE):
        keys = re.sub(rf"^{key} *=.*\n", "", keys, flags=re.MULTILINE)
    replaced = {name for name, _ in new_tables}
    kept = [text for name, text in tables if name not in replaced]
    return "".join([keys, new_keys, *kept, *(text for _, text in new_tables)])


def _parts(text: str) -> tuple[str, list[tuple[str, str]]]:
    """Keys before the first table, and the tables by name."""
    starts = [(match["name"], match.start()) for match in _TABLE.finditer(text)]
    first = starts[0][1] if starts else len(text)
    ends = ([start for _, start in starts[1:]] + [len(text)])[: len(starts)]
    return f"{text[:first].rstrip()}\n", [
        (name, f"{text[start:end].rstrip()}\n\n")
        for (name, start), end in zip(starts, ends, strict=True)
    ]

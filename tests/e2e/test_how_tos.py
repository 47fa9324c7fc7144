"""Every line of every how-to runs as it is written, and so do the commands of the README.

Each page has a folder of its own, with the study of ``polychirp init`` and the recordings and
meshes that its commands name. What a test cannot have (radios, clusters, Sionna RT) is marked in
the page, and its commands are at least read by the parser.
"""

import ast
import re
import shlex
import struct
import tomllib
from contextlib import redirect_stdout
from pathlib import Path

import numpy as np
import pytest

from polychirp.cli.app import VERBS, build_parser, main
from polychirp.cli.init import template
from polychirp.config.monte_carlo import load_plan
from polychirp.testing.shapes import mesh_of, plate
from polychirp.traffic.mesh_file import save_glb
from tests.support.snippets import ROOT, Block, blocks_of, pasted

PAGES = sorted((ROOT / "docs" / "how-to").glob("*.md"))

WALK = """\
start_frequency = "77 GHz"
slope = "60 MHz/us"
idle_time = "10 us"
ramp_end_time = "40 us"
adc_start = "5 us"
num_ramps = 8
sample_rate = "2 MS/s"
num_samples = 64
num_receivers = 2
device = "xwr16xx"
"""
RADAR = """\
channelCfg 15 5 0
adcCfg 2 1
profileCfg 0 77 10 6 40 0 0 30 0 256 8000 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 0 0 0 0 0 4
frameCfg 0 1 32 0 40 1 0
"""
FAST = ["tracer.kind=free-space", 'targets=["post"]']
"""Changes under which a run takes a second: points instead of traced bodies."""


def make_files(folder: Path) -> None:
    """The files that the commands of the pages name."""
    for name in ("study.toml", "bench.toml"):
        (folder / name).write_text(template(), encoding="utf-8")
    noise = np.random.default_rng(1).normal(0.0, 300.0, (3, 8, 2, 64, 2))
    np.save(folder / "walk.npy", noise[:2].view(complex)[..., 0])
    noise.astype("<i2").tofile(folder / "walk.bin")
    by_profile = np.random.default_rng(2).normal(0.0, 300.0, (64, 4, 256, 2))
    by_profile.astype("<i2").tofile(folder / "drive.bin")
    (folder / "radar.cfg").write_text(RADAR, encoding="utf-8")
    (folder / "walk.toml").write_text(WALK, encoding="utf-8")
    save_glb(mesh_of(plate(0.1, 0.05), "glass"), str(folder / "car.glb"))
    corners = 1e3 * plate(0.1, 0.05)
    faces = b"".join(
        struct.pack("<12fH", 0, 0, 0, *face.astype(np.float32).reshape(-1), 0) for face in corners
    )
    (folder / "pole.stl").write_bytes(bytes(80) + struct.pack("<I", len(corners)) + faces)


def run_line(line: str) -> None:
    """Run one line of a shell block: a polychirp command, perhaps into a file."""
    words = shlex.split(line, comments=True)
    target = None
    if ">" in words:
        place = words.index(">")
        words, target = words[:place], words[place + 1]
    assert words[0] in ("polychirp", "./run"), f"no test runs '{line}'"
    if target is None:
        assert main(words[1:]) == 0, line
        return
    with Path(target).open("w", encoding="utf-8") as file, redirect_stdout(file):
        assert main(words[1:]) == 0, line


def parse_line(line: str) -> None:
    """Let the real parser read a polychirp command; leave other programs alone."""
    words = shlex.split(line, comments=True)
    if words[0] == "polychirp":
        build_parser().parse_args(words[1:])
    elif words[0] == "./run":
        assert words[1] in chores() or build_parser().parse_args(words[1:])
    else:
        assert words[:2] == ["pip", "install"], f"no test knows '{line}'"


def chores() -> set[str]:
    """Verbs of the script ``run`` that are no commands of polychirp."""
    text = (ROOT / "run").read_text(encoding="utf-8")
    return set(re.findall(r"^([a-z]+)\)$", text, re.MULTILINE))


def run_block(block: Block) -> None:
    """Do what a reader of the page does with a block."""
    match block.language:
        case "sh":
            for line in block.commands:
                (parse_line if block.mark.startswith("parse") else run_line)(line)
        case "toml":
            paste(block)
        case "python":
            ast.parse(block.text)
            if not block.mark.startswith("parse"):
                exec(compile(block.text, "page", "exec"), {})


def paste(block: Block) -> None:
    """Put a snippet into a study, which must then pass the check and run."""
    into = re.match(r"paste into (\S+)", block.mark)
    path = Path(into[1] if into else "study.toml")
    if block.mark == "traffic":  # for which the street has one vehicle: tests/unit/docs
        return
    path.write_text(pasted(path.read_text(encoding="utf-8"), block.text), encoding="utf-8")
    if into:
        return
    assert main(["check", str(path)]) == 0
    if "[monte_carlo" in block.text:
        assert len(load_plan(path).points) > 1
    changes = [word for change in FAST for word in ("--set", change)]
    assert main(["run", str(path), *changes, "--out", f"out/{path.stem}", "--force"]) == 0


def works(page: Path, folder: Path, monkeypatch, *, slow: bool) -> None:
    """Run the blocks of a page, in order, in a folder of their own."""
    make_files(folder)
    monkeypatch.chdir(folder)
    for block in blocks_of(page):
        if slow or not is_slow(block):
            run_block(block)


def is_slow(block: Block) -> bool:
    """True for blocks that are marked so, and for those that compile all kernels."""
    return block.mark == "slow" or "polychirp warm-up" in block.text


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
@pytest.mark.filterwarnings("default::polychirp.errors.ModelWarning")
def test_the_quick_lines_of_a_page_run(page, tmp_path, monkeypatch):
    works(page, tmp_path, monkeypatch, slow=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [page for page in PAGES if any(map(is_slow, blocks_of(page)))],
    ids=lambda page: page.stem,
)
@pytest.mark.filterwarnings("default::polychirp.errors.ModelWarning")
def test_every_line_of_a_page_runs(page, tmp_path, monkeypatch):
    works(page, tmp_path, monkeypatch, slow=True)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_fence_of_a_page_belongs_to_a_block_that_the_tests_see(page):
    """A fence with more than a language, such as `sh slow`, would hide itself and the next one."""
    fences = re.findall(r"^```.*$", page.read_text(encoding="utf-8"), re.MULTILINE)
    assert [word for word in fences if not re.fullmatch(r"```\w*", word)] == []
    assert len(fences) == 2 * len(blocks_of(page))


def test_every_block_that_does_not_run_says_why():
    marks = {block.mark for page in PAGES for block in blocks_of(page)}
    known = re.compile(r"|slow|traffic|paste into \S+|parse \(.+\)")
    assert [mark for mark in marks if not known.fullmatch(mark)] == []


LONG = {
    "./run live": "serves a page until it is stopped",
    "./run test": "runs this test",
    "./run study studies/paper/fig12-13.toml": "takes an hour",
}
"""Lines of the README that only the parser reads, and why."""


def readme_lines() -> list[str]:
    blocks = blocks_of(ROOT / "README.md")
    return [line for block in blocks if block.language == "sh" for line in block.commands]


def test_the_commands_of_the_readme_are_parsed():
    for line in readme_lines():
        parse_line(line)


@pytest.mark.slow
def test_the_commands_of_the_readme_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for line in readme_lines():
        if shlex.join(shlex.split(line, comments=True)) not in LONG:
            run_line(line)


def test_the_script_leaves_the_commands_of_polychirp_alone():
    assert chores() & set(VERBS) == set()


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", ".ci/run", "ARCHITECTURE.md", "README.md"])
def test_every_verb_of_the_script_that_is_named_exists(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    assert set(re.findall(r"\./run ([a-z][a-z-]*)", text)) <= chores() | set(VERBS)


def test_a_snippet_replaces_the_tables_of_its_names():
    study = 'name = "a"\nseed = 1\n[x]\na = 1\n[x.y]\nb = 2\n'
    text = pasted(study, "seed = 2\n[x]\nc = 3\n")
    assert tomllib.loads(text) == {"name": "a", "seed": 2, "x": {"c": 3, "y": {"b": 2}}}
    assert tomllib.loads(pasted(study, "seed = 3\n")) == tomllib.loads(study) | {"seed": 3}


NEXT = re.compile(r"next: (polychirp .*)")


def test_a_new_user_gets_from_init_to_a_study_as_it_is_printed(tmp_path, monkeypatch, capsys):
    """Each command suggests the next, and none gets in the way of another's folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("POLYCHIRP_NAME", raising=False)
    line = "polychirp init study.toml"
    done = []
    while line:
        words = shlex.split(line)[1:]
        changes = FAST if words[0] == "run" else []  # which `run` hands on to `study`
        assert main([*words, *(word for change in changes for word in ("--set", change))]) == 0
        done.append(words[0])
        found = NEXT.search(capsys.readouterr().err)
        line = found[1] if found else ""
    assert done == ["init", "check", "run", "study"]
    assert len(list(tmp_path.glob("out/*"))) == 2

"""The public names: one list, documented, typed, and deprecated by rule."""

import inspect
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import polychirp

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "api.md"
NAMES = polychirp.__all__


def test_the_page_of_public_names_has_exactly_these():
    rows = re.findall(r"^\| [^|]+ \| (`.*`) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    listed = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    assert sorted(listed) == NAMES
    assert len(set(listed)) == len(listed)


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_leads_on(name):
    """Its docstring has an example, or names another public name."""
    text = inspect.getdoc(getattr(polychirp, name)) or ""
    linked = set(re.findall(r"(?<!`)`(\w+)(?:\.\w+)?`(?!`)", text)) & set(NAMES) - {name}
    assert ">>>" in text or linked


def test_star_import_gives_the_public_names():
    found: dict[str, object] = {}
    exec("from polychirp import *", found)
    assert set(found) - {"__builtins__"} == set(NAMES)


def test_what_is_not_public_is_no_attribute():
    with pytest.raises(AttributeError, match="has no attribute 'Sawteeth'"):
        _ = polychirp.Sawteeth
    assert polychirp.__version__ == version("polychirp")


def test_a_renamed_name_works_and_warns_where_it_is_used(monkeypatch):
    monkeypatch.setitem(polychirp._RENAMED, "Sawteeth", ("Sawtooth", "0.3"))
    with pytest.warns(DeprecationWarning, match=r"removed in polychirp 0\.3; use") as caught:
        assert polychirp.Sawteeth is polychirp.Sawtooth
    assert caught[0].filename == __file__
    with pytest.warns(DeprecationWarning, match="Sawteeth is deprecated") as caught:
        exec(compile("from polychirp import Sawteeth", "user.py", "exec"), {})
    assert {one.filename for one in caught} == {"user.py"}


def test_a_renamed_name_goes_with_the_version_that_removes_it():
    def parts(text: str) -> tuple[int, ...]:
        return tuple(int(part) for part in text.split(".")[:2])

    for old, (new, removed_in) in polychirp._RENAMED.items():
        assert new in NAMES, old
        assert parts(removed_in) > parts(polychirp.__version__), old


PROGRAM = '''
"""What a user writes, with a type for everything that is not inferred."""

from dataclasses import dataclass
from pathlib import Path
from typing import assert_type

import polychirp as pc


@dataclass(frozen=True, kw_only=True)
class Rising:
    """A waveform of the user's own."""

    bandwidth: float = 150e6

    def schedule(self, *, num_sweeps: int, streams: pc.Streams) -> pc.RampSchedule:
        return pc.Sawtooth(bandwidth=self.bandwidth).schedule(
            num_sweeps=num_sweeps, streams=streams
        )


own: pc.Waveform = Rising()
tracer: pc.RayTracer = pc.FreeSpace()
mitigation: pc.Mitigation = pc.Blanking()
street = pc.Street(
    vehicles=(pc.Vehicle(name="ego", x=0.0, y=0.0),),
    points=(pc.Point(name="post", x=12.0, y=0.0, z=0.5, rcs=pc.from_db(10.0)),),
)
radar = pc.StudyRadar(
    name="front", vehicle="ego", mount=pc.Pose(x=2.33, z=0.5), waveform=pc.Triangular()
)
study = pc.Study(
    name="alone",
    street=street,
    radars=(radar,),
    tracer=pc.FreeSpace(),
    receiver=pc.RangeDoppler(mitigation=pc.Blanking()),
)


def results(path: Path) -> list[float]:
    trial = pc.run_trial(study)
    assert_type(trial, pc.Trial)
    seen = trial.victim("front")
    frame: pc.IfFrame = seen.frame
    found: pc.Detections = seen.detections
    pc.save_run(path / "run.zarr", trial, provenance=pc.provenance(study))
    run = pc.load_run(path / "run.zarr")
    assert_type(run.victim("front").score, pc.Score)
    written: list[Path] = pc.export(run, path, to="csv")
    picture: bytes = pc.draw("range-rate", seen, study.receiver).save(path, "map")
    print(frame.samples.shape, len(written), len(picture))
    return [float(one) for one in found.range]


try:
    derived: pc.Derived = pc.check(study)
except pc.PolychirpError as error:
    print(error)
'''


@pytest.mark.slow
def test_a_program_with_public_names_passes_mypy_strict_elsewhere(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM, encoding="utf-8")
    assert mypy(tmp_path / "program.py").returncode == 0
    (tmp_path / "wrong.py").write_text(
        "import polychirp\n\npolychirp.run_trial('study.toml')\npolychirp.Sawteeth\n"
    )
    said = mypy(tmp_path / "wrong.py")
    assert said.returncode == 1
    assert "[arg-type]" in said.stdout
    assert "[attr-defined]" in said.stdout


def mypy(program: Path) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--no-incremental", program.name],
        cwd=program.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    print(done.stdout, done.stderr)
    return done

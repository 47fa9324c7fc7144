"""The wheel works without the repository."""

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

from polychirp.cli.init import TEMPLATES

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"
CODE = {".py", ".pyi"}
CACHES = {".nbc", ".nbi", ".pyc"}

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(ROOT))
    (found,) = folder.glob("polychirp-*.whl")
    return found


@pytest.fixture(scope="module")
def programs(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of programs of a fresh environment with the wheel; other packages are those here."""
    home = tmp_path_factory.mktemp("fresh")
    venv.create(home, symlinks=os.name != "nt")
    paths = sysconfig.get_paths(vars={"base": str(home), "platbase": str(home)})
    others = sysconfig.get_paths()["purelib"]
    # a folder that a .pth file names is searched, but .pth files in it, such as that of an editable
    # polychirp, are not read
    (Path(paths["purelib"]) / "others.pth").write_text(f"{others}\n", encoding="utf-8")
    python = Path(paths["scripts"]) / Path(sys.executable).name
    pip("--python", str(python), "install", "--no-deps", "--no-index", str(wheel))
    return Path(paths["scripts"])


def pip(*words: str) -> None:
    subprocess.run([sys.executable, "-m", "pip", "--quiet", *words], check=True, env=environment())


def environment() -> dict[str, str]:
    """The variables of this process without those that lead to the repository."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def run(program: Path, *words: str, folder: Path) -> str:
    done = subprocess.run(
        [program, *words],
        cwd=folder,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_has_all_files_of_the_package_and_no_others(wheel):
    with zipfile.ZipFile(wheel) as archive:
        packed = {name for name in archive.namelist() if name.startswith("polychirp/")}
    there = {
        path.relative_to(SOURCE).as_posix()
        for path in (SOURCE / "polychirp").rglob("*")
        if path.is_file() and path.suffix not in CACHES and "__pycache__" not in path.parts
    }
    assert packed == there
    assert "polychirp/py.typed" in packed
    assert {Path(name).suffix for name in packed} > CODE


def test_the_installed_package_is_the_one_that_runs(programs, tmp_path):
    program = "import polychirp, sys; print(polychirp.__file__); print(len(polychirp.__all__))"
    home, count = run(
        programs / Path(sys.executable).name, "-c", program, folder=tmp_path
    ).splitlines()
    assert Path(home).is_relative_to(programs.parent)
    assert int(count) > 100
    said = run(programs / "polychirp", "--version", folder=tmp_path)
    assert said == f"polychirp {version('polychirp')}\n"


@pytest.mark.parametrize("template", TEMPLATES)
def test_every_template_is_written_and_checked(programs, tmp_path, template):
    run(programs / "polychirp", "init", "--template", template, folder=tmp_path)
    said = run(programs / "polychirp", "check", "study.toml", folder=tmp_path)
    assert "range resolution" in said.lower()


def test_a_known_radar_is_written_and_checked(programs, tmp_path):
    run(programs / "polychirp", "init", "--radar", "lrr-77", folder=tmp_path)
    said = run(programs / "polychirp", "check", "study.toml", folder=tmp_path)
    assert "range resolution" in said.lower()

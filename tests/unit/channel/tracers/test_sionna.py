"""The tracer "sionna" without Sionna: what it says, which LLVM it takes, and that it is cheap."""

import json
import subprocess
import sys
from importlib.metadata import PackageNotFoundError
from types import SimpleNamespace

import numpy as np
import pytest

from polychirp.channel.base import RayTracer
from polychirp.channel.tracers import sionna
from polychirp.channel.tracers.sionna import SionnaRt, llvm_version, usable_llvm
from polychirp.errors import CapabilityError, InputError, ModelWarning
from polychirp.frames import Pose
from polychirp.model.material import Material
from polychirp.model.mesh import Plate
from polychirp.model.scene import Actor, PointScatterer
from polychirp.testing.shapes import around, mesh_of, sphere

BALL = Actor(name="ball", kind="object", pose=Pose(x=5.0), mesh=mesh_of(sphere(0.5, 0.2)))
POINT = Actor(
    name="point", kind="object", points=(PointScatterer(position=(5.0, 0.0, 0.0), rcs=1.0),)
)
PLACES = [(0.0, 0.0, 0.0), (0.0, 1.0, 0.0)]


def chosen(**candidates):
    """Of fakes whose version is their whole name; "?" cannot tell it."""
    given = {"chosen": None, "packaged": [], "installed": [], **candidates}
    return usable_llvm(**given, version_of=lambda name: None if name == "?" else int(name))


def test_the_library_that_a_person_names_comes_first():
    assert chosen(chosen="17", packaged=["23"], installed=["19"]) == "17"


def test_the_library_of_a_package_comes_before_those_of_the_system():
    assert chosen(packaged=["18"], installed=["15", "22"]) == "18"


def test_of_the_system_the_newest_is_taken():
    assert chosen(installed=["9", "15", "19", "17"]) == "19"
    assert chosen(packaged=["16"], installed=["17", "?"]) == "17"


@pytest.mark.parametrize("version", ["15", "16", "?"])
def test_a_named_library_that_would_abort_is_refused_and_not_passed_over(version):
    with pytest.raises(CapabilityError, match=r"DRJIT_LIBLLVM_PATH names .* needs LLVM 17"):
        chosen(chosen=version, packaged=["23"])


def test_a_system_with_old_libraries_only_is_told_the_newest():
    with pytest.raises(CapabilityError, match=r"newest here is LLVM 15 .*polychirp\[sionna\]"):
        chosen(installed=["14", "15"])


def test_a_system_without_llvm_is_told_so():
    with pytest.raises(CapabilityError, match=r"there is none here; .*polychirp\[sionna\]"):
        chosen()
    with pytest.raises(CapabilityError, match="no LLVM that tells its version"):
        chosen(installed=["?"])


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("libLLVM-15.so.1", 15),
        ("libLLVM-14.0.6.so.1", 14),
        ("libLLVM.so.19.1", 19),
        ("libLLVM.so.22.1-rust-1.95.0-stable", 22),
        ("LLVM-C.dll", None),
    ],
)
def test_a_library_is_known_by_its_name(name, version):
    assert llvm_version(f"/nowhere/{name}") == version


def test_a_link_is_known_by_the_name_of_what_it_leads_to(tmp_path):
    library, link = tmp_path / "libLLVM-15.so.1", tmp_path / "libLLVM.so"
    library.touch()
    link.symlink_to(library)
    assert llvm_version(str(link)) == 15


def test_a_file_that_is_no_library_has_no_version(tmp_path):
    file = tmp_path / "libLLVM.so"
    file.write_text("no library", encoding="utf-8")
    assert llvm_version(str(file)) is None


def absent(name):
    raise PackageNotFoundError(name)


@pytest.fixture
def nowhere(monkeypatch):
    """As if no package were installed, nor LLVM."""
    monkeypatch.setattr(sionna, "distribution", absent)
    monkeypatch.setattr(sionna, "_installed_libraries", list)
    monkeypatch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
    sionna._sionna.cache_clear()


def test_a_missing_sionna_is_named_with_the_command_that_installs_it(nowhere):
    with pytest.raises(CapabilityError, match=r'not installed; pip install "polychirp\[sionna\]"'):
        SionnaRt().trace(around([], PLACES))


def test_an_old_sionna_is_refused(nowhere, monkeypatch):
    monkeypatch.setattr(sionna, "distribution", lambda _: SimpleNamespace(version="1.2.1"))
    with pytest.raises(CapabilityError, match=r"needs Sionna RT 2 or newer, but 1\.2\.1"):
        SionnaRt().trace(around([], PLACES))


def test_a_sionna_without_llvm_is_refused_before_anything_is_imported(nowhere, monkeypatch):
    package = SimpleNamespace(version="2.2.0", files=[])
    monkeypatch.setattr(sionna, "distribution", lambda _: package)
    monkeypatch.setattr(sionna, "_installed_libraries", lambda: ["libLLVM-15.so.1"])
    before = set(sys.modules)
    with pytest.raises(CapabilityError, match="newest here is LLVM 15"):
        SionnaRt().trace(around([], PLACES))
    assert not {"mitsuba", "drjit"} & (set(sys.modules) - before)


def test_a_scene_that_sionna_cannot_do_is_refused_whether_it_is_there_or_not(nowhere):
    with pytest.raises(CapabilityError, match="nor point scatterers; use the tracer 'composite'"):
        SionnaRt().trace(around([POINT], PLACES))
    wall = Plate(
        centre=(5.0, 0, 0), half_u=(0, 1.0, 0), half_v=(0, 0, 1.0), material="cheese", part="w"
    )
    with pytest.raises(InputError, match="no material 'cheese'"):
        SionnaRt().trace(around([Actor(name="w", kind="building", plates=(wall,))], PLACES))


def test_echoes_of_bodies_are_warned_of(nowhere):
    with (
        pytest.warns(ModelWarning, match="wrong by 5 to 30 dB"),
        pytest.raises(CapabilityError, match="not installed"),
    ):
        SionnaRt().trace(around([BALL], PLACES))


def test_foliage_is_said_to_be_missing(nowhere):
    tree = Actor(name="tree", kind="tree", mesh=mesh_of(sphere(0.5, 0.2) + 5.0, "leaf"))
    with (
        pytest.warns(ModelWarning, match="foliage neither blocks nor scatters"),
        pytest.raises(CapabilityError, match="not installed"),
    ):
        SionnaRt().trace(around([tree], PLACES))


def test_it_is_a_tracer_without_echoes_of_bodies():
    assert isinstance(SionnaRt(), RayTracer)
    assert not SionnaRt().capabilities & {"facets", "points", "diffuse", "diffraction"}
    assert "diffraction" in SionnaRt(diffraction=True).capabilities


@pytest.mark.parametrize(
    "wrong",
    [{"frequency": 0.0}, {"dynamic_range": 0.5}, {"max_depth": -1}, {"num_samples": 0},
     {"seed": -1}],
)  # fmt: skip
def test_impossible_parameters_are_refused(wrong):
    with pytest.raises(InputError, match=rf"{next(iter(wrong))} is .*; choose"):
        SionnaRt(**wrong)


def test_roughness_takes_from_a_mirror_what_the_angle_says():
    """A way that turns by 90° meets its mirror at 45°: ρ = exp(−2 (k σ cos 45°)²) = exp(−(kσ)²)."""
    k = 2 * np.pi * 79e9 / 299792458.0
    ways = np.array([[[1.0, 0, 0], [0, 1.0, 0]]])
    kept = sionna._roughness_factor(np.array([[3e-4]]), ways, 79e9)
    assert kept[0] == pytest.approx(np.exp(-((k * 3e-4) ** 2)), rel=1e-12)


def test_the_air_that_a_pane_displaces_counts_once():
    """Sionna's delay has it, and its coefficient of the pane has the pane from face to face.

    A straight way meets a pane of 4 mm at 60°, of which the second face lies elsewhere.
    """
    pane = np.array([[[0.0, 0, 0], [0, 1, 0], [0, 0, 1]], [[9.0, 0, 0], [9, 1, 0], [8, 0, 0]]])
    part = sionna._Part(actor=0, material="pane", corner=pane)
    ways = np.array([[[0.5, np.sqrt(0.75), 0.0]] * 2])
    found = sionna._SionnaPaths(
        pair=np.array([[0, 1]]),
        response=np.ones((1, 2, 2), dtype=np.complex128),
        shift=np.zeros(1),
        kind=np.array([[4, 0]]),
        part=np.zeros((1, 2), dtype=np.int64),
        face=np.zeros((1, 2), dtype=np.int64),
        point=np.zeros((1, 2, 3)),
    )
    table = {"pane": Material(relative_permittivity=6.0, thickness=4e-3)}
    air = sionna._displaced_air(found, np.array([True]), 1, ways, [part], table)
    assert air.tolist() == pytest.approx([2e-3])


def test_importing_the_tracer_loads_no_heavy_library():
    program = (
        "import json, sys, polychirp.channel.tracers.sionna; print(json.dumps(sorted(sys.modules)))"
    )
    listing = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    ).stdout
    loaded = {name.partition(".")[0] for name in json.loads(listing)}
    assert not loaded & {"drjit", "matplotlib", "mitsuba", "numba", "scipy", "sionna"}

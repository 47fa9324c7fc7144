"""Studies, recordings, meshes and SigMF files that were damaged at random.

Each is refused by an error of polychirp, or accepted: no other exception, and no hang. Every case
has a seed of its own, so that a failure can be repeated: ``case(seed)``.
"""

import json
import shutil
import time
import tomllib
import warnings
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from polychirp.capture.dca1000 import open_raw
from polychirp.capture.parameter_file import parameters_from, read_parameters
from polychirp.capture.recording import Recording, from_array, open_numpy
from polychirp.capture.sigmf import check_sha512, open_sigmf, write_sigmf
from polychirp.capture.zarr_file import open_zarr
from polychirp.config.load import load_study
from polychirp.config.monte_carlo import load_plan
from polychirp.errors import PolychirpError
from polychirp.model.baseband import Baseband
from polychirp.receiver.range_doppler.chain import RangeDoppler
from polychirp.study.check import check
from polychirp.study.store.load import load_run
from polychirp.study.trial import run_trial
from polychirp.traffic.mesh_file import load_mesh, save_glb
from polychirp.traffic.vehicle import vehicle_mesh
from polychirp.waveform import Triangular
from tests.support.dca1000 import write_raw

LONGEST = 20.0
"""Processor time of a case above which it counts as hanging, s."""

QUICKSTART = Path(__file__).parents[2] / "studies" / "quickstart.toml"

ABSURD: tuple[Any, ...] = (
    *(0, -1, 1, 2, 3, 17, 10**9, 2**63, 10**30, -(10**30), 10**400),
    *(0.0, -0.0, 1e-300, 1e300, 0.5, float("nan"), float("inf"), -float("inf")),
    *(
        True,
        False,
        None,
        "",
        " ",
        "x",
        "front",
        "ego",
        "../../x",
        "[/red]",
        "\x1b[31m",
        "\x00",
        "²",
    ),
    *([], {}, [[]], [{}], {"a": 1}, [1, 2], ["1 m"], "a" * 5000),
    *(f"{n} {u}" for n in (0, -1, 1, 3, 1e-300, 1e9, 1e300) for u in ("m", "s", "Hz", "m/s", "dB")),
    *(
        f"{n} {u}"
        for n in (0, -1, 1, 5000, 1e6)
        for u in ("dBm", "deg", "S/s", "ppm", "dBsm", "km")
    ),
    *("1 ms", "2 ms", "10 us", "1 GHz", "300 kHz", "50 km/h", "1 cm", "1 MS/s", "nan m", "inf m"),
)
"""Values that take the place of others."""


def changed(value: Any, rng: np.random.Generator) -> Any:
    """A tree of tables and lists with something replaced, removed, added or repeated."""
    tree = deepcopy(value)
    for _ in range(int(rng.integers(1, 4))):
        _change(tree, rng)
    return tree


def _change(tree: Any, rng: np.random.Generator) -> None:
    places = list(_places(tree))
    if not places:
        return
    parent, key = places[int(rng.integers(len(places)))]
    match int(rng.integers(8)):
        case 0:
            del parent[key]
        case 1 if isinstance(parent, list):
            parent.append(deepcopy(parent[key]))
        case 1:
            parent[f"{key}x"] = parent[key]
        case 2:
            deep: Any = parent[key]
            for _ in range(int(rng.choice([1, 5, 200]))):
                deep = [deep]
            parent[key] = deep
        case 3:
            other, name = places[int(rng.integers(len(places)))]
            parent[key] = deepcopy(other[name])
        case _:
            parent[key] = deepcopy(ABSURD[int(rng.integers(len(ABSURD)))])


NUMBERS = (0, -1, 1e-300, 1e-9, 1e-3, 0.3, 1, 3, 50, 999, 1e5, 1e9, 1e30, 1e300)


def renumbered(tree: Any, rng: np.random.Generator) -> Any:
    """A tree with one or two numbers replaced, their units kept."""
    tree = deepcopy(tree)
    places = [(parent, key) for parent, key in _places(tree) if _is_number(parent[key])]
    for _ in range(int(rng.integers(1, 3))):
        parent, key = places[int(rng.integers(len(places)))]
        number: float = NUMBERS[int(rng.integers(len(NUMBERS)))]
        old = parent[key]
        if isinstance(old, str):
            parent[key] = f"{number} {old.partition(' ')[2]}"
        else:
            parent[key] = int(number) if isinstance(old, int) else float(number)
    return tree


def _is_number(value: Any) -> bool:
    is_quantity = isinstance(value, str) and value[:1] in "-0123456789" and " " in value
    return is_quantity or type(value) in (int, float)


def _places(tree: Any) -> Any:
    """Every parent and key of a tree."""
    for key in list(tree) if isinstance(tree, dict) else range(len(tree)):
        yield tree, key
        if isinstance(tree[key], dict | list):
            yield from _places(tree[key])


def damaged(content: bytes, rng: np.random.Generator) -> bytes:
    """Bytes of which some were changed, cut out, repeated or put in."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(len(data) + 1))
        # half of the changes near the beginning, where headers are
        at = at if rng.random() < 0.5 else min(at, int(rng.integers(200)))
        size = int(rng.choice([1, 4, 50]))
        match int(rng.integers(5)):
            case 0:
                data[at : at + size] = rng.bytes(size)
            case 1:
                del data[at:]
            case 2:
                del data[at : at + size]
            case 3:
                data[at:at] = data[at : at + size] * int(rng.choice([1, 100]))
            case _:
                data[at : at + size] = bytes([int(rng.choice([0, 48, 57, 91, 127, 255]))]) * size
    return bytes(data)


def toml_of(value: Any) -> str:
    """A value as TOML on one line, also where a study would not be written so."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml_of(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(toml_of(entry) for entry in value) + "]"
    if value is None:
        return '"none"'
    if isinstance(value, bool | str):
        return json.dumps(value)
    return str(value)


def survives(action: Callable[[], object], seed: int) -> bool:
    """True if the action accepts what it gets; False if it refuses it as it should."""
    start, refusal = time.process_time(), None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            action()
    except PolychirpError as error:
        refusal = str(error)
    except Exception as error:
        raise AssertionError(f"seed {seed}: {type(error).__name__}: {error}") from error
    assert time.process_time() - start < LONGEST, f"seed {seed} hangs"
    assert refusal is None or 0 < len(refusal) < 20_000, f"seed {seed}: {refusal}"
    return refusal is None


# ── what is damaged ───────────────────────────────────────────────────────────


class Studies:
    """The quickstart with coarse bodies, traffic and a grid: its text, tables or numbers."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "study.toml"
        self.tables = tomllib.loads(QUICKSTART.read_text(encoding="utf-8"))
        for vehicle in self.tables["street"]["vehicles"]:
            vehicle |= {"coarseness": 6.0, "max_edge": "0.3 m"}
        self.tables["traffic"] = {"seen_from": "ego", "num_targets": 2, "num_carriers": 1}
        self.tables["traffic"] |= {"coarseness": 6.0, "max_edge": "0.3 m"}
        self.tables["street"]["trees"] = [
            {"name": "oak", "x": "9 m", "y": "9 m", "height": "8 m", "crown_radius": "2 m"}
        ]
        self.tables["street"]["buildings"] = [
            {"name": "house", "x": "9 m", "y": "20 m", "length": "9 m", "width": "9 m"}
            | {"height": "6 m", "num_windows": 3}
        ]
        self.tables["monte_carlo"] = {"trials": 3, "grid": {"num_sweeps": [4, 8]}}

    def text(self, tables: dict[str, Any]) -> str:
        return "".join(f"{json.dumps(key)} = {toml_of(value)}\n" for key, value in tables.items())

    def __call__(self, seed: int) -> bool:
        rng = np.random.default_rng([1, seed])
        if seed % 4 == 0:
            self.path.write_bytes(damaged(self.text(self.tables).encode(), rng))
        else:
            change = renumbered if seed % 4 == 1 else changed
            text = self.text(change(self.tables, rng))
            self.path.write_text(text, encoding="utf-8", errors="surrogateescape")
        # the table of trials is read on its own
        survives(lambda: load_plan(self.path), seed)
        return survives(lambda: check(load_study(self.path)), seed)


class Trials:
    """A study that is computed in a moment, one number changed: what check accepts, run accepts."""

    TEXT = """
    name = "small"
    num_sweeps = 2
    refresh_interval = "5 ms"
    tracer = { kind = "free-space" }
    targets = ["post"]
    street.vehicles = [{name="ego", x="0 m", y="0 m", coarseness=6.0, max_edge="0.3 m"}]
    street.points = [{name="post", x="12 m", y="1 m", z="0.5 m", rcs="10 dBsm"}]
    [receiver]
    least_range = "0.5 m"
    greatest_range = "15 m"
    greatest_speed = "20 m/s"
    dynamic_range = "40 dB"
    false_alarm_probability = 1e-6
    most_detections = 5
    angle = "root-music"
    mitigation = { kind = "blanking", factor = 3.0, guard = "8 us", whitening = 4 }
    [[radars]]
    name = "front"
    vehicle = "ego"
    start_time = "0 s"
    mount = { x = "2.4 m", z = "0.5 m" }
    noise_figure = "5 dB"
    transmit_power = "10 dBm"
    array = { num_channels = 2, spacing = "1.9 mm" }
    if_filter = { passband = "300 kHz", stopband = "700 kHz", attenuation = "90 dB" }
    converter = { sample_rate = "1 MS/s", start = "10 us", margin = "10 us" }
    waveform = { kind = "triangular", bandwidth = "500 MHz", ramp_duration = "0.5 ms" }
    """
    NUMBERS = (1, 2, 3, 1e-12, 1e-3, 0.1, 0.5, 1.01, 7, 30, 300)

    def __init__(self, folder: Path) -> None:
        self.path = folder / "study.toml"
        self.tables = tomllib.loads(self.TEXT)
        self.path.write_text(self.TEXT, encoding="utf-8")
        run_trial(load_study(self.path))  # kernels compile

    def __call__(self, seed: int) -> bool:
        rng = np.random.default_rng([2, seed])
        tables = deepcopy(self.tables)
        places = [
            (parent, key)
            for part in (tables["receiver"], tables["radars"][0])
            for parent, key in _places(part)
            if isinstance(parent[key], int | float | str)
        ]
        parent, key = places[int(rng.integers(len(places)))]
        number = self.NUMBERS[int(rng.integers(len(self.NUMBERS)))]
        old = parent[key]
        unit = old.partition(" ")[2] if isinstance(old, str) else ""
        parent[key] = f"{number} {unit}" if unit else number
        text = "".join(f"{json.dumps(k)} = {toml_of(v)}\n" for k, v in tables.items())
        self.path.write_text(text, encoding="utf-8")

        def run() -> None:
            study = load_study(self.path)
            derived = check(study)
            if derived.memory < 20e6:
                run_trial(study)

        return survives(run, seed)


PARAMETERS = """
start_frequency = "77 GHz"
slope = "20 MHz/us"
idle_time = "10 us"
ramp_end_time = "50 us"
adc_start = "6 us"
num_ramps = 8
sample_rate = "1 MS/s"
num_samples = 8
num_transmitters = 2
num_receivers = 2
full_scale = 1.0
device = "xwr16xx"
"""


class Recordings:
    """NumPy, Zarr and raw files, and the parameters beside them."""

    SHAPE = (3, 8, 2, 8)

    def __init__(self, folder: Path) -> None:
        import zarr

        self.folder, self.whole = folder / "now", folder / "whole"
        self.whole.mkdir()
        self.parameters = parameters_from(tomllib.loads(PARAMETERS), name="walk.toml")
        array = np.random.default_rng(1).standard_normal(self.SHAPE) + 0.5j
        np.save(self.whole / "walk.npy", array)
        write_raw(
            self.whole / "walk.bin",
            np.round(100 * array.transpose(0, 2, 1, 3)),
            device="xwr16xx",
            is_complex=True,
        )
        for number, compressor in enumerate(
            ("auto", None, zarr.codecs.GzipCodec(), zarr.codecs.BloscCodec())
        ):
            for version in (2, 3):
                if version == 2 and number > 1:
                    continue
                path = self.whole / f"walk-{version}-{number}.zarr"
                stored = zarr.create_array(
                    path,
                    shape=self.SHAPE,
                    chunks=(1, 8, 2, 8),
                    dtype=array.dtype,
                    compressors=compressor,
                    zarr_format=version,
                )
                stored[...] = array
        (self.whole / "walk.toml").write_text(PARAMETERS, encoding="utf-8")
        self.files = sorted(path for path in self.whole.rglob("*") if path.is_file())
        shutil.copytree(self.whole, self.folder)
        self.detect("walk.npy")  # kernels compile

    def open(self, name: str) -> Recording:
        path = self.folder / name
        parameters = read_parameters(self.folder / "walk.toml")
        if path.suffix == ".npy":
            return open_numpy(path, parameters)
        if path.suffix == ".bin":
            return open_raw(path, parameters)
        return from_array(open_zarr(path), parameters, name=path.name)

    def detect(self, name: str) -> None:
        recording = self.open(name)
        parameters = recording.parameters
        receiver = RangeDoppler(
            least_range=0.5 * parameters.range_resolution,
            greatest_range=parameters.greatest_range,
        )
        for number in range(min(3, recording.num_frames)):
            receiver.detect(recording.frame(number))

    def __call__(self, seed: int) -> bool:
        rng = np.random.default_rng([3, seed])
        shutil.rmtree(self.folder, ignore_errors=True)
        shutil.copytree(self.whole, self.folder)
        target = self.files[int(rng.integers(len(self.files)))]
        now = self.folder / target.relative_to(self.whole)
        if target.name in ("zarr.json", ".zarray") and rng.random() < 0.8:
            tree = changed(json.loads(target.read_text(encoding="utf-8")), rng)
            now.write_text(json.dumps(tree), encoding="utf-8")
        elif target.suffix == ".toml":
            tree = changed(tomllib.loads(PARAMETERS), rng)
            text = "".join(f"{json.dumps(k)} = {toml_of(v)}\n" for k, v in tree.items())
            now.write_text(text, encoding="utf-8")
        else:
            now.write_bytes(damaged(target.read_bytes(), rng))
        name = target.relative_to(self.whole).parts[0]
        name = "walk.npy" if name == "walk.toml" else name

        return survives(lambda: self.detect(name), seed)


class Meshes:
    """A car as GLB, a box as OBJ with its materials, and as STL in text and bytes."""

    def __init__(self, folder: Path) -> None:
        import trimesh

        save_glb(vehicle_mesh("sedan", max_edge=0.3, coarseness=6.0), folder / "car.glb")
        box: Any = trimesh.creation.box()
        (folder / "box.stl").write_bytes(box.export(file_type="stl"))
        (folder / "text.stl").write_text(box.export(file_type="stl_ascii"), encoding="utf-8")
        text = f"mtllib box.mtl\nusemtl metal\n{box.export(file_type='obj')}"
        (folder / "box.obj").write_text(text, encoding="utf-8")
        self.folder = folder
        self.files = {path.name: path.read_bytes() for path in sorted(folder.iterdir())}

    def __call__(self, seed: int) -> bool:
        rng = np.random.default_rng([4, seed])
        name = sorted(self.files)[int(rng.integers(len(self.files)))]
        content = self.files[name]
        if name.endswith(".glb") and rng.random() < 0.7:
            length = int.from_bytes(content[12:16], "little")
            text = json.dumps(changed(json.loads(content[20 : 20 + length]), rng)).encode()
            text += b" " * (-len(text) % 4)
            content = (content[:12] + len(text).to_bytes(4, "little") + b"JSON" + text) + content[
                20 + length :
            ]
        else:
            content = damaged(content, rng)
        path = self.folder / f"now{Path(name).suffix}"
        path.write_bytes(content)
        return survives(lambda: load_mesh(path, default_material="metal", max_edge=0.5), seed)


class SigmfFiles:
    """A triangle as 16-bit integers, with its schedule."""

    def __init__(self, folder: Path) -> None:
        from polychirp.rng import Streams

        self.folder = folder
        signal = Baseband(
            samples=0.5 * np.exp(1j * np.arange(500.0)), sample_rate=1e6, centre_frequency=79e9
        )
        schedule = Triangular(bandwidth=1e6, ramp_duration=2e-4).schedule(
            num_sweeps=1, streams=Streams(1)
        )
        path = write_sigmf(folder / "whole", signal, datatype="ci16_le", schedule=schedule)
        self.meta, self.data = path.read_bytes(), path.with_suffix(".sigmf-data").read_bytes()

    def __call__(self, seed: int) -> bool:
        rng = np.random.default_rng([5, seed])
        meta, data = self.meta, self.data
        match seed % 3:
            case 0:
                meta = damaged(meta, rng)
            case 1:
                data = damaged(data, rng)
            case _:
                meta = json.dumps(changed(json.loads(meta), rng)).encode()
        path = self.folder / "now.sigmf-meta"
        path.write_bytes(meta)
        path.with_suffix(".sigmf-data").write_bytes(data)

        def read() -> None:
            recording = open_sigmf(path)
            check_sha512(recording)
            recording.signal()

        return survives(read, seed)


class Runs:
    """A stored run, one of its files damaged."""

    def __init__(self, folder: Path) -> None:
        from polychirp.study.provenance import provenance
        from polychirp.study.store.save import save_run

        study = load_study(Trials(folder).path)
        self.whole, self.now = folder / "whole.zarr", folder / "now.zarr"
        save_run(self.whole, run_trial(study), provenance=provenance(study))
        self.files = sorted(path for path in self.whole.rglob("*") if path.is_file())

    def __call__(self, seed: int) -> bool:
        rng = np.random.default_rng([6, seed])
        shutil.rmtree(self.now, ignore_errors=True)
        shutil.copytree(self.whole, self.now)
        target = self.files[int(rng.integers(len(self.files)))]
        now = self.now / target.relative_to(self.whole)
        if target.name == "zarr.json" and rng.random() < 0.8:
            tree = changed(json.loads(target.read_text(encoding="utf-8")), rng)
            now.write_text(json.dumps(tree), encoding="utf-8")
        else:
            now.write_bytes(damaged(target.read_bytes(), rng))
        return survives(lambda: load_run(self.now), seed)


KINDS = [
    (Studies, 40),
    (Trials, 10),
    (Recordings, 40),
    (Meshes, 60),
    (SigmfFiles, 120),
    (Runs, 15),
]


@pytest.mark.parametrize(("kind", "count"), KINDS, ids=[kind.__name__ for kind, _ in KINDS])
def test_what_was_damaged_is_refused_or_accepted_and_nothing_else(tmp_path, kind, count):
    case = kind(tmp_path)
    accepted = [case(seed) for seed in range(count)]
    assert sum(accepted) < count


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), KINDS, ids=[kind.__name__ for kind, _ in KINDS])
def test_much_that_was_damaged_is_refused_or_accepted_and_nothing_else(tmp_path, kind, count):
    case = kind(tmp_path)
    for seed in range(count, 25 * count):
        case(seed)

"""Recordings of strangers are refused with a reason, and never run code or fill the memory."""

import gzip
import json
import pickle
import struct
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr
from numcodecs import Delta

from polychirp.capture.parameter_file import read_parameters
from polychirp.capture.parameters import CaptureParameters
from polychirp.capture.recording import from_array, open_numpy
from polychirp.capture.sigmf import open_sigmf, write_sigmf
from polychirp.capture.zarr_file import decoded_size, open_zarr
from polychirp.errors import InputError
from polychirp.model.baseband import Baseband
from polychirp.study.store.layout import FORMAT_VERSION
from polychirp.study.store.load import load_run

PARAMETERS = CaptureParameters(
    start_frequency=77e9,
    slope=20e12,
    idle_time=10e-6,
    ramp_end_time=50e-6,
    adc_start=6e-6,
    num_ramps=4,
    sample_rate=1e6,
    num_samples=8,
    num_receivers=2,
    full_scale=1.0,
)
SHAPE = (3, 4, 2, 8)
ARRAY = np.random.default_rng(1).standard_normal(SHAPE) + 0.5j
MARK = "polychirp_ran_code"


class Bomb:
    """An object whose pickle leaves a mark when it is loaded."""

    def __reduce__(self) -> tuple[Any, ...]:
        return exec, (f"import builtins; builtins.{MARK} = True",)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    path = tmp_path / "walk.zarr"
    zarr.create_array(path, shape=SHAPE, chunks=(1, 4, 2, 8), dtype=ARRAY.dtype)[...] = ARRAY
    return path


def read_all(path: Path) -> None:
    recording = from_array(open_zarr(path), PARAMETERS, name=path.name)
    for number in range(recording.num_frames):
        recording.frame(number)


def change(path: Path, **values: Any) -> None:
    text = path.read_text(encoding="utf-8")
    path.write_text(json.dumps({**json.loads(text), **values}), encoding="utf-8")


def v2(path: Path, content: bytes = b"", **values: Any) -> Path:
    """A Zarr array of version 2 with one chunk, written by hand."""
    path.mkdir()
    told = {
        "zarr_format": 2,
        "shape": list(SHAPE),
        "chunks": list(SHAPE),
        "dtype": "<c16",
        "compressor": None,
        "filters": None,
        "fill_value": 0,
        "order": "C",
        **values,
    }
    (path / ".zarray").write_text(json.dumps(told), encoding="utf-8")
    (path / "0.0.0.0").write_bytes(content)
    return path


# ── code ──────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    "codecs",
    [
        {"dtype": "|O", "filters": [{"id": "vlen-utf8"}, {"id": "pickle", "protocol": 5}]},
        {"dtype": "|O", "filters": [{"id": "pickle"}]},
        {"dtype": "<c16", "filters": [{"id": "pickle"}]},
        {"dtype": "<c16", "compressor": {"id": "pickle"}},
        {"dtype": "<c16", "filters": [{"id": "delta", "dtype": "|O"}]},
        {"dtype": [["x", "|O"]], "filters": [{"id": "json2"}]},
    ],
)
def test_an_array_of_objects_is_refused_before_it_is_decoded(tmp_path: Path, codecs):
    import builtins

    path = v2(tmp_path / "walk.zarr", pickle.dumps(Bomb()), **codecs)
    with pytest.raises(InputError, match=r"which (is|are) not read"):
        read_all(path)
    assert not hasattr(builtins, MARK)


@pytest.mark.parametrize(
    "codec",
    ["numcodecs.pickle", "vlen-utf8", "vlen-bytes", "numcodecs.json2", "sharding_indexed", "new"],
)
def test_an_unknown_codec_of_version_3_is_refused_by_its_name(folder: Path, codec: str):
    change(folder / "zarr.json", codecs=[{"name": codec, "configuration": {}}])
    with pytest.raises(InputError, match=f"codec '{codec}', which is not read"):
        read_all(folder)


def test_a_stored_run_is_read_with_the_same_care(tmp_path: Path):
    """A run whose metadata name a codec that is not read is damaged, whatever it holds."""
    path = tmp_path / "run.zarr"
    root = zarr.create_group(store=path, zarr_format=3)
    version = {"format": "polychirp run", "format_version": FORMAT_VERSION}
    root.attrs.update({**version, "victims": ["front"], "radars": ["front"], "actors": []})
    root.attrs["provenance"] = dict.fromkeys(
        ["study_hash", "seed", "revision", "versions", "platform"], ""
    )
    victim = root.create_group("victim-0")
    victim.attrs.update({"name": "front", "array": "{}", "high_pass": None})
    victim.create_array("samples", shape=(1,), dtype="f8")
    change(path / "victim-0" / "samples" / "zarr.json", codecs=[{"name": "numcodecs.pickle"}])
    with pytest.raises(InputError, match="damaged"):
        load_run(path)


# ── Zarr ──────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    "compressor",
    [None, zarr.codecs.BloscCodec(), zarr.codecs.GzipCodec(), zarr.codecs.ZstdCodec()],
    ids=["none", "blosc", "gzip", "zstd"],
)
def test_what_zarr_writes_is_read(tmp_path: Path, compressor):
    path = tmp_path / "walk.zarr"
    array = zarr.create_array(
        path, shape=SHAPE, chunks=(1, 4, 1, 8), dtype=ARRAY.dtype, compressors=compressor
    )
    array[...] = ARRAY
    found = from_array(open_zarr(path), PARAMETERS, name="walk").frame(2)
    np.testing.assert_array_equal(found.samples, ARRAY[2].transpose(1, 0, 2))


def test_what_zarr_wrote_in_version_2_is_read(tmp_path: Path):
    path = tmp_path / "walk.zarr"
    array = zarr.create_array(
        path, shape=SHAPE, chunks=(1, 4, 2, 8), dtype=ARRAY.dtype, zarr_format=2
    )
    array[...] = ARRAY
    found = from_array(open_zarr(path), PARAMETERS, name="walk").frame(1)
    np.testing.assert_array_equal(found.samples, ARRAY[1].transpose(1, 0, 2))


def test_a_missing_chunk_is_not_read_as_zeros(folder: Path):
    (folder / "c" / "1" / "0" / "0" / "0").unlink()
    with pytest.raises(InputError, match="chunk c/1/0/0/0 is missing; copy all files again"):
        read_all(folder)


@pytest.mark.parametrize(
    "damage",
    [
        lambda old: old[: len(old) // 2],
        lambda _: b"",
        lambda _: b"x" * 100,
        lambda old: old[:5],
    ],
    ids=["cut", "empty", "garbage", "header"],
)
@pytest.mark.parametrize(
    "compressor",
    [None, zarr.codecs.BloscCodec(), zarr.codecs.GzipCodec(), zarr.codecs.ZstdCodec()],
    ids=["none", "blosc", "gzip", "zstd"],
)
def test_a_damaged_chunk_is_refused(tmp_path: Path, compressor, damage):
    path = tmp_path / "walk.zarr"
    array = zarr.create_array(
        path, shape=SHAPE, chunks=SHAPE, dtype=ARRAY.dtype, compressors=compressor
    )
    array[...] = ARRAY
    chunk = path / "c" / "0" / "0" / "0" / "0"
    chunk.write_bytes(damage(chunk.read_bytes()))
    with pytest.raises(InputError, match=r"walk.zarr: .*copy it again"):
        read_all(path)


@pytest.mark.parametrize(
    "content",
    [
        ("gzip", gzip.compress(bytes(1 << 20))),
        ("blosc", struct.pack("<BBBBIII", 2, 1, 0, 1, 1 << 31, 1 << 31, 100) + bytes(84)),
        ("lz4", struct.pack("<I", 1 << 31) + bytes(100)),
        ("zstd", b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 1 << 50) + bytes(10)),
    ],
    ids=lambda content: content[0],
)
def test_a_chunk_that_grows_beyond_its_size_is_refused_unread(tmp_path: Path, content):
    """A chunk of 3 kB announces, or becomes, from a megabyte to a petabyte."""
    name, data = content
    path = v2(tmp_path / "walk.zarr", data, compressor={"id": name})
    with pytest.raises(InputError, match=r"holds more than the 3072 bytes"):
        read_all(path)


@pytest.mark.parametrize("version", [2, 3])
def test_a_chunk_of_narrow_numbers_may_hold_no_more_than_they_take(tmp_path: Path, version: int):
    """48 kB of zeros in place of 3 kB: as many bytes as numbers of another type would take."""
    shape = (3, 4, 2, 128)
    path = tmp_path / "walk.zarr"
    codec = {"id": "zlib"} if version == 2 else zarr.codecs.GzipCodec()
    content = (zlib if version == 2 else gzip).compress(bytes(16 * 3072))
    if version == 2:
        v2(path, content, shape=shape, chunks=shape, dtype="|i1", compressor=codec)
    else:
        zarr.create_array(path, shape=shape, chunks=shape, dtype="i1", compressors=codec)[...] = 1
        (path / "c" / "0" / "0" / "0" / "0").write_bytes(content)
    with pytest.raises(InputError, match=r"holds more than the 3072 bytes"):
        open_zarr(path).whole()


@pytest.mark.parametrize("stored", ["i1", "i2", "i4"])
def test_numbers_that_a_filter_stores_in_another_width_are_read(tmp_path: Path, stored: str):
    path = tmp_path / "walk.zarr"
    values = np.arange(192, dtype="i2").reshape(SHAPE)
    delta = Delta(dtype="i2", astype=stored)
    array = zarr.create_array(
        path, shape=SHAPE, chunks=SHAPE, dtype="i2", zarr_format=2, filters=[delta]
    )
    array[...] = values
    np.testing.assert_array_equal(open_zarr(path).whole(), values)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        (
            {"dtype": "|i1", "filters": 4 * [{"id": "delta", "dtype": "<c16", "astype": "|i1"}]},
            "takes numbers of 16 bytes and gets numbers of 1;",
        ),
        (
            {
                "dtype": "|i1",
                "shape": [1 << 30],
                "chunks": [1 << 30],
                "filters": [{"id": "delta", "dtype": "|i1", "astype": "<i4"}],
            },
            "has chunks of 4.29e.09 bytes",
        ),
        ({"filters": [{"id": "zlib"}, {"id": "shuffle"}]}, "was compressed before a filter"),
    ],
)
def test_filters_that_would_fill_the_memory_are_refused(tmp_path: Path, changes, sentence):
    path = v2(tmp_path / "walk.zarr", bytes(3072), **changes)
    with pytest.raises(InputError, match=sentence):
        open_zarr(path).whole()


def test_sizes_of_decoded_chunks_are_those_that_come_out():
    from numcodecs import LZ4, Blosc, GZip, Zlib, Zstd

    for codec in (LZ4(), Blosc(), GZip(), Zlib(), Zstd()):
        for length in (1, 100, 300, 70_000, 3_000_000):
            content = bytes(codec.encode(np.zeros(length, dtype=np.uint8)))
            assert decoded_size(content, codec.codec_id, limit=10_000_000) == length


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"shape": [2**60, 4, 2, 8]}, "not lists of plausible lengths"),
        ({"shape": "all"}, "not lists of plausible lengths"),
        ({"shape": [-3, 4, 2, 8]}, "not lists of plausible lengths"),
        ({"shape": [3, 4, 2]}, "has 3 axes and chunks of 4"),
        ({"data_type": "string"}, "type 'string', which are not read"),
        ({"data_type": {"name": "numpy.datetime64"}}, "which are not read"),
        ({"fill_value": {"x": 1}}, "its fill value is not a number"),
        ({"codecs": None}, "has no list of codecs"),
        ({"codecs": [3]}, "its codec has no name"),
        ({"chunk_grid": {"name": "regular"}}, "not lists of plausible lengths"),
        (
            {"chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [2**30, 4, 2, 8]}}},
            "has chunks of 1.1e+12 bytes",
        ),
        ({"storage_transformers": [{"name": "x"}]}, "has storage transformers"),
        ({"node_type": "group"}, "cannot be read as one Zarr array"),
    ],
)
def test_implausible_metadata_are_refused(folder: Path, changes, sentence):
    change(folder / "zarr.json", **changes)
    with pytest.raises(InputError) as raised:
        read_all(folder)
    assert sentence in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("text", ["[1, 2]", "{", "[" * 100_000, "9" * 5000, "\xff"])
def test_metadata_that_are_no_json_object_are_refused(folder: Path, text: str):
    (folder / "zarr.json").write_text(text, encoding="latin-1")
    with pytest.raises(InputError, match=r"walk.zarr|integer|nested"):
        read_all(folder)


# ── samples ───────────────────────────────────────────────────────────────────


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf * 1j, 1e200])
def test_a_sample_that_is_no_number_is_refused_with_its_place(bad: complex):
    array = np.ones(SHAPE, dtype=np.complex128)
    array[1, 3, 1, 5] = array[1, 3, 1, 6] = bad
    recording = from_array(array, PARAMETERS, name="walk.npy")
    recording.frame(0)
    with pytest.raises(InputError, match=r"frame 1 has 2 .* at receiver 1, ramp 3, sample 5"):
        recording.frame(1)


def test_a_full_scale_that_makes_samples_overflow_is_refused():
    recording = from_array(1e10 * ARRAY, replace(PARAMETERS, full_scale=1e-300), name="walk.npy")
    with pytest.raises(InputError, match="correct full_scale"):
        recording.frame(0)


def npy(header: str, *, version: bytes = b"\x01\x00") -> bytes:
    text = header.encode() + b"\n"
    return b"\x93NUMPY" + version + struct.pack("<H", len(text)) + text + bytes(1024)


@pytest.mark.parametrize(
    ("header", "sentence"),
    [
        ("{'descr': '<c16', 'fortran_order': False, 'shape': (2**62, 4), }", "not a NumPy file"),
        (f"{{'descr': '<c16', 'fortran_order': False, 'shape': ({2**62}, 4), }}", "bytes short"),
        (f"{{'descr': '<c16', 'fortran_order': False, 'shape': ({2**70}, 0), }}", "no frame"),
        ("{'descr': '<c16', 'fortran_order': False, 'shape': (-3, 4, 2, 8), }", "not a NumPy file"),
        ("{'descr': '<c16', 'fortran_order': False, 'shape': (True, 4), }", "not a NumPy file"),
        ("{'descr': '|O', 'fortran_order': False, 'shape': (3, 4, 2, 8), }", "not numbers"),
        ("{'descr': [('x', '<f4')], 'fortran_order': False, 'shape': (1,), }", "not numbers"),
        ("(" * 5000 + ")" * 5000, "not a NumPy file"),
        ("[" * 9000, "not a NumPy file"),
        ("{" * 3000 + "}" * 3000, "not a NumPy file"),
    ],
)
def test_a_numpy_header_that_lies_is_refused(tmp_path: Path, header: str, sentence: str):
    path = tmp_path / "walk.npy"
    path.write_bytes(npy(header))
    with pytest.raises(InputError) as raised:
        open_numpy(path, PARAMETERS)
    assert sentence in str(raised.value)
    assert len(str(raised.value)) < 300


def test_a_range_of_frames_is_not_walked(tmp_path: Path):
    """``--frames 0-100000000000000000000`` is answered at once."""
    np.save(tmp_path / "walk.npy", ARRAY)
    with pytest.raises(InputError, match=r"0 to 2 are there, and --frames asks for frame 10{20};"):
        open_numpy(tmp_path / "walk.npy", PARAMETERS, frames=range(10**20 + 1))


# ── parameters ────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("num_ramps", "1" + "0" * 12, "num_ramps: 1000000000000 is too large"),
        ("num_samples", "9" * 5000, "an integer has thousands of digits"),
        ("num_samples", "10_000_000", "takes 22.4 TB|takes .* GiB of memory"),
        ("sample_rate", '"1e300 S/s"', "is outside of"),
        ("full_scale", "inf", "full_scale: inf is too large"),
        ("axes", "[" * 5000 + "]" * 5000, "nested"),
        ("axes", '[["frame"]]', "is not one of its values"),
    ],
)
def test_absurd_parameters_are_refused(tmp_path: Path, key: str, value: str, sentence: str):
    lines = {
        "start_frequency": '"77 GHz"',
        "slope": '"1 MHz/us"',
        "idle_time": '"10 us"',
        "ramp_end_time": '"20 s"',
        "adc_start": '"0 us"',
        "num_ramps": "1000",
        "sample_rate": '"1 MS/s"',
        "num_samples": "8",
        "num_receivers": "8",
    }
    lines[key] = value
    path = tmp_path / "walk.toml"
    path.write_text("".join(f"{k} = {v}\n" for k, v in lines.items()), encoding="utf-8")
    with pytest.raises(InputError, match=sentence):
        read_parameters(path)


# ── SigMF ─────────────────────────────────────────────────────────────────────


@pytest.mark.parametrize(
    ("part", "changes"),
    [
        ("global", {"core:datatype": ["cf32_le"]}),
        ("global", {"core:datatype": {"a": 1}}),
        ("global", {"core:sample_rate": 10**400}),
        ("global", {"core:sample_rate": 1e-300}),
        ("global", {"core:sample_rate": 1e300}),
        ("global", {"polychirp:num_samples": "many"}),
        ("global", {"polychirp:num_samples": -3}),
        ("global", {"polychirp:num_samples": True}),
        ("global", {"polychirp:start_time": 1e300}),
        ("global", {"polychirp:schedule": {"start_time": [10**400]}}),
        ("global", {"polychirp:schedule": "fast"}),
        ("captures", {"core:frequency": [1]}),
        ("captures", {"core:frequency": 1e300}),
        ("captures", {"core:frequency": "4 GHz"}),
    ],
)
def test_metadata_of_wrong_types_rates_and_counts_are_one_sentence(tmp_path: Path, part, changes):
    signal = Baseband(samples=np.ones(100, dtype=np.complex128), sample_rate=1e6)
    path = write_sigmf(tmp_path / "walk", signal)
    content = json.loads(path.read_text(encoding="utf-8"))
    (content[part] if part == "global" else content[part][0]).update(changes)
    path.write_text(json.dumps(content), encoding="utf-8")
    with pytest.raises(InputError) as raised:
        open_sigmf(path)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 300


def test_a_rate_that_needs_too_many_samples_is_refused():
    signal = Baseband(samples=np.ones(100, dtype=np.complex128), sample_rate=1.0)
    with pytest.raises(InputError, match=r"100 s at 1e.06 MS/s are 1e.14 samples"):
        signal.resampled(1e12)


@pytest.mark.parametrize("text", ["[" * 100_000, "[1]", '{"global": ' + "9" * 5000 + "}"])
def test_metadata_that_are_no_sigmf_are_one_sentence(tmp_path: Path, text: str):
    (tmp_path / "walk.sigmf-meta").write_text(text, encoding="utf-8")
    with pytest.raises(InputError):
        open_sigmf(tmp_path / "walk.sigmf-meta")

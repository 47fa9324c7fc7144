"""Untrusted Zarr arrays: checked before they are opened, and each chunk before it is decoded.

A Zarr array may use any codec that is installed, and the ``pickle`` codec runs code that the file
contains. So the metadata, which are plain JSON, are read first: an array is opened only if it holds
plain numbers, stored with codecs of the list below. A chunk is decoded only if its file announces
no more bytes than the chunk can have.

=========  ====================================================================================
version 2  compressors blosc, gzip, zlib, zstd, lz4 or none; filters delta and shuffle
version 3  codecs transpose, bytes, one of blosc, gzip and zstd, and crc32c
=========  ====================================================================================
"""

import json
import math
import re
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from polychirp.bounded_text import json_value, text_of
from polychirp.errors import InputError

TYPES: Final = frozenset(
    (
        "bool",
        *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
        *("float16", "float32", "float64", "complex64", "complex128"),
    )
)
"""Data types that are read: plain numbers."""

COMPRESSORS: Final[Mapping[int, frozenset[str]]] = {
    2: frozenset(("blosc", "gzip", "zlib", "zstd", "lz4")),
    3: frozenset(("blosc", "gzip", "zstd")),
}
"""Compressors that are read, by the version of the format."""

FILTERS: Final[Mapping[int, frozenset[str]]] = {
    2: frozenset(("delta", "shuffle")),
    3: frozenset(("transpose", "bytes", "crc32c")),
}
"""Other codecs that are read, by the version of the format."""

LARGEST_CHUNK: Final = 2 << 30
"""Greatest size of a decoded chunk, bytes. Chosen: Blosc has about the same limit."""

LARGEST_READ: Final = 8 << 30
"""Greatest size of a read, bytes. Chosen: 64 channels, 1024 ramps, 8192 samples in complex128."""

MOST_CHUNKS: Final = 1_000_000
"""Greatest number of chunks that are read at once. Chosen."""

LONGEST_AXIS: Final = 1 << 40
"""Greatest plausible length of an axis of an array or of a chunk. Chosen."""

_V2_TYPE: Final = re.compile(r"[<>|]([biufc])(1|2|4|8|16)")
_V2_KIND: Final = {"b": "bool", "i": "int", "u": "uint", "f": "float", "c": "complex"}
"""Data types of version 2: byte order, kind and bytes; names of the kinds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ZarrMetadata:
    """Description of a Zarr array that is safe to open.

    Parameters
    ----------
    version : version of the format, 2 or 3
    shape, chunks : lengths of all axes, of the array and of a chunk
    dtype : name of the data type, one of `TYPES`
    widths : bytes of a number as it is read, and after each filter that converts it for storage
    compressor : name of the compressor, or None
    prefix, separator : parts of a chunk's name, such as ``c`` and ``/`` in ``c/0/1``
    attributes : the array's attributes
    """

    version: Literal[2, 3]
    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: str
    widths: tuple[int, ...]
    compressor: str | None
    prefix: tuple[str, ...]
    separator: str
    attributes: Mapping[str, Any]

    @property
    def chunk_bytes(self) -> int:
        """Greatest size of a chunk while it is decoded, bytes."""
        return math.prod(self.chunks) * max(self.widths)

    @property
    def stored_bytes(self) -> int:
        """Size of a chunk after all filters and before compression, bytes, without a checksum."""
        return math.prod(self.chunks) * self.widths[-1]

    def chunk_name(self, place: tuple[int, ...]) -> str:
        """Path of a chunk in the folder of the array."""
        return self.separator.join((*self.prefix, *(str(n) for n in place)))


class ZarrArray:
    """A Zarr array that is checked as it is read; it is indexed like an array of NumPy.

    Parameters
    ----------
    path : folder of the array
    has_all_chunks : True if a chunk without a file is an error; otherwise it has the fill value
    """

    def __init__(self, path: Path, *, has_all_chunks: bool = True) -> None:
        self.path = path
        self.metadata = read_metadata(path)
        self._has_all_chunks = has_all_chunks

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of all axes."""
        return self.metadata.shape

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.metadata.shape)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Data type of the numbers."""
        return np.dtype(self.metadata.dtype)

    def __getitem__(self, place: tuple[slice, ...]) -> NDArray[Any]:
        """The numbers in a slice of every axis.

        `InputError` is raised if a chunk is missing, cut off or damaged, or too much would be read
        at once.
        """
        import zarr

        spans = [
            range(length)[part] for part, length in zip(place, self.metadata.shape, strict=True)
        ]
        wanted = math.prod(len(span) for span in spans) * self.dtype.itemsize
        if wanted > LARGEST_READ:
            raise InputError(
                f"{self.path.name}: {wanted:.3g} bytes would be read at once, more than "
                f"{LARGEST_READ:.3g}; store shorter frames"
            )
        for chunk in self._chunks(spans):
            self._check_chunk(chunk)
        try:
            array = zarr.open_array(self.path, mode="r", zarr_format=self.metadata.version)
            return np.asarray(array[place])
        except Exception as error:  # each codec raises its own types of exceptions
            raise InputError(
                f"{self.path.name}: cannot be decoded ({_first_line(error)}); copy it again"
            ) from None

    def whole(self) -> NDArray[Any]:
        """All numbers of the array."""
        return self[(slice(None),) * self.ndim]

    def _chunks(self, spans: list[range]) -> Iterator[str]:
        """Names of the chunks that hold the numbers of these spans."""
        if not all(spans):
            return
        along = [
            range(span[0] // size, span[-1] // size + 1)
            for span, size in zip(spans, self.metadata.chunks, strict=True)
        ]
        if math.prod(len(numbers) for numbers in along) > MOST_CHUNKS:
            raise InputError(
                f"{self.path.name}: more than {MOST_CHUNKS} chunks would be read at once; store "
                "it in larger chunks"
            )
        for place in product(*along):
            yield self.metadata.chunk_name(place)

    def _check_chunk(self, name: str) -> None:
        """Refuse a chunk that is missing, damaged, or larger than its array announces."""
        label = f"{self.path.name}: chunk {name}"
        try:
            content = (self.path / name).read_bytes()
        except FileNotFoundError:
            if self._has_all_chunks:
                raise InputError(
                    f"{label} is missing; copy all files again, or, if it holds nothing but "
                    "zeros, store it with write_empty_chunks"
                ) from None
            return
        except OSError as error:
            raise InputError(f"{label} cannot be read: {error.strerror}") from None
        limit = self.metadata.stored_bytes + 64
        size = decoded_size(content, self.metadata.compressor, limit=limit)
        if size is None:
            raise InputError(
                f"{label} is cut off or damaged: it is not {self.metadata.compressor} data; copy "
                "it again"
            )
        if size > limit:
            raise InputError(
                f"{label} holds more than the {self.metadata.stored_bytes} bytes that its array "
                "announces; it is damaged or unsafe: copy it again, or do not use it"
            )


def open_zarr(path: Path | str) -> ZarrArray:
    """A recording in a Zarr array; a chunk that is missing is an error.

    `InputError` is raised if the folder is not there, or it holds no array, or one that is not safe
    to open.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"there is no recording '{path}'")
    return ZarrArray(path)


def group_attributes(path: Path) -> dict[str, Any]:
    """Attributes of a Zarr group of version 3.

    `FileNotFoundError` is raised if there is no such group, and `InputError` if the metadata are
    not those of a group.
    """
    content = _object(path / "zarr.json", path.name)
    if content.get("zarr_format") != 3 or content.get("node_type") != "group":
        raise InputError(f"{path.name}: is not a Zarr group of version 3")
    return _attributes(content.get("attributes", {}), path.name)


def read_metadata(path: Path) -> ZarrMetadata:
    """Metadata of the Zarr array in a folder.

    `InputError` is raised if the folder holds no array, or one that is implausible or not safe to
    open.
    """
    name = path.name
    try:
        if (path / "zarr.json").exists():
            return _version_3(_object(path / "zarr.json", name), name)
        content = _object(path / ".zarray", name)
        has_attributes = (path / ".zattrs").exists()
        told = _object(path / ".zattrs", name) if has_attributes else {}
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(
            f"{name}: cannot be read as one Zarr array: it has no metadata of an array; name "
            "the folder of the array itself"
        ) from None
    return _version_2(content, told, name)


def _object(path: Path, name: str) -> dict[str, Any]:
    """The object in a JSON file; raises `FileNotFoundError` if there is no file."""
    try:
        content = json_value(text_of(path))
    except (FileNotFoundError, NotADirectoryError):
        raise
    except OSError as error:
        raise InputError(f"{name}: {path.name} cannot be read: {error.strerror}") from None
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        raise InputError(f"{name}: {path.name} is not JSON ({error}); copy it again") from None
    if not isinstance(content, dict):
        raise InputError(f"{name}: {path.name} is not a JSON object; copy it again")
    return content


def _version_3(content: Mapping[str, Any], name: str) -> ZarrMetadata:
    if content.get("zarr_format") != 3 or content.get("node_type") != "array":
        raise InputError(
            f"{name}: cannot be read as one Zarr array; name the folder of the array itself"
        )
    if content.get("storage_transformers"):
        raise InputError(
            f"{name}: has storage transformers, which are not read; store it without them"
        )
    dtype = content.get("data_type")
    if not (isinstance(dtype, str) and dtype in TYPES):
        raise _no_numbers(name, dtype)
    grid = _named(content.get("chunk_grid"), name, "chunk_grid")
    if grid[0] != "regular":
        raise InputError(
            f"{name}: has chunks of different sizes, which are not read; store equal ones"
        )
    keys = _named(content.get("chunk_key_encoding"), name, "chunk_key_encoding")
    separator = keys[1].get("separator", "/" if keys[0] == "default" else ".")
    if keys[0] not in ("default", "v2") or separator not in ("/", "."):
        raise InputError(f"{name}: has an unknown naming of its chunks; use Zarr's default")
    codecs = content.get("codecs")
    if not isinstance(codecs, list):
        raise InputError(f"{name}: has no list of codecs; copy it again")
    return _checked(
        ZarrMetadata(
            version=3,
            shape=_lengths(content.get("shape"), name, least=0),
            chunks=_lengths(grid[1].get("chunk_shape"), name, least=1),
            dtype=dtype,
            widths=(np.dtype(dtype).itemsize,),
            compressor=_compressor([_named(one, name, "codec")[0] for one in codecs], 3, name),
            prefix=("c",) if keys[0] == "default" else (),
            separator=separator,
            attributes=_attributes(content.get("attributes", {}), name),
        ),
        fill_value=content.get("fill_value"),
        name=name,
    )


def _version_2(content: Mapping[str, Any], told: dict[str, Any], name: str) -> ZarrMetadata:
    if content.get("zarr_format") != 2:
        raise InputError(f"{name}: its .zarray is not of version 2; copy it again")
    dtype = _v2_dtype(content.get("dtype"))
    if dtype is None:
        raise _no_numbers(name, content.get("dtype"))
    separator = content.get("dimension_separator", ".")
    if separator not in ("/", ".") or content.get("order", "C") not in ("C", "F"):
        raise InputError(
            f"{name}: has an unknown order or dimension separator; use Zarr's defaults"
        )
    filters = content.get("filters") or []
    if not isinstance(filters, list):
        raise InputError(f"{name}: its filters are not a list; copy it again")
    compressor = content.get("compressor")
    codecs = [*filters, *([] if compressor is None else [compressor])]
    return _checked(
        ZarrMetadata(
            version=2,
            shape=_lengths(content.get("shape"), name, least=0),
            chunks=_lengths(content.get("chunks"), name, least=1),
            dtype=dtype,
            widths=_widths(dtype, codecs, name),
            compressor=_compressor([_v2_id(codec, name) for codec in codecs], 2, name),
            prefix=(),
            separator=separator,
            attributes=told,
        ),
        fill_value=content.get("fill_value"),
        name=name,
    )


def _widths(dtype: str, codecs: list[Any], name: str) -> tuple[int, ...]:
    """`ZarrMetadata.widths` of an array of version 2; only the filter delta converts numbers."""
    widths = [np.dtype(dtype).itemsize]
    for codec in codecs:
        if not isinstance(codec, dict) or codec.get("dtype") is codec.get("astype") is None:
            continue
        taken = codec.get("dtype")
        for told in (taken, codec.get("astype") or taken):
            inner = _v2_dtype(told)
            if inner is None:
                raise _no_numbers(name, told)
            widths.append(np.dtype(inner).itemsize)
        if widths[-2] != widths[-3]:
            raise InputError(
                f"{name}: one of its filters takes numbers of {widths[-2]} bytes and gets numbers "
                f"of {widths[-3]}; copy it again"
            )
    return tuple(widths)


def _checked(metadata: ZarrMetadata, *, fill_value: object, name: str) -> ZarrMetadata:
    """The metadata themselves; raises `InputError` if their numbers disagree or are implausible."""
    if len(metadata.shape) != len(metadata.chunks) or not metadata.shape:
        raise InputError(
            f"{name}: has {len(metadata.shape)} axes and chunks of {len(metadata.chunks)}; copy it "
            "again"
        )
    if metadata.chunk_bytes > LARGEST_CHUNK:
        raise InputError(
            f"{name}: has chunks of {metadata.chunk_bytes:.3g} bytes, more than "
            f"{LARGEST_CHUNK:.3g}; store it in smaller chunks"
        )
    parts = fill_value if isinstance(fill_value, list) else [fill_value]
    if len(parts) > 2 or not all(
        part is None or isinstance(part, int | float | str) for part in parts
    ):
        raise InputError(f"{name}: its fill value is not a number; copy it again")
    return metadata


def _compressor(codecs: list[str], version: int, name: str) -> str | None:
    """The one compressor among the names of codecs, or None; all of them must be known."""
    for codec in codecs:
        if codec not in COMPRESSORS[version] | FILTERS[version]:
            known = ", ".join(sorted(COMPRESSORS[version] | FILTERS[version]))
            raise InputError(
                f"{name}: was stored with the codec '{codec[:40]}', which is not read, because a "
                f"codec may run code; store it with {known}"
            )
    found = [codec for codec in codecs if codec in COMPRESSORS[version]]
    if len(found) > 1:
        raise InputError(f"{name}: was compressed {len(found)} times; store it with one compressor")
    if found and version == 2 and codecs[-1] != found[0]:
        raise InputError(f"{name}: was compressed before a filter; store it with filters first")
    return found[0] if found else None


def _named(value: object, name: str, what: str) -> tuple[str, Mapping[str, Any]]:
    """Name and configuration of an extension point of version 3."""
    if isinstance(value, str):
        return value, {}
    if isinstance(value, dict):
        inner = value.get("configuration", {})
        if isinstance(value.get("name"), str) and isinstance(inner, dict):
            return value["name"], inner
    raise InputError(f"{name}: its {what} has no name; copy it again")


def _v2_id(codec: object, name: str) -> str:
    if not (isinstance(codec, dict) and isinstance(codec.get("id"), str)):
        raise InputError(f"{name}: one of its codecs has no id; copy it again")
    return str(codec["id"])


def _v2_dtype(told: object) -> str | None:
    """Name of a data type of version 2, such as "<f4"; None if it is no plain number."""
    match = _V2_TYPE.fullmatch(told) if isinstance(told, str) else None
    if match is None:
        return None
    kind = _V2_KIND[match[1]]
    found = kind if kind == "bool" else f"{kind}{8 * int(match[2])}"
    return found if found in TYPES else None


def _lengths(told: object, name: str, *, least: int) -> tuple[int, ...]:
    is_list = isinstance(told, list) and len(told) <= 32
    if not (is_list and all(_is_length(length, least) for length in told)):  # type: ignore[attr-defined]
        raise InputError(
            f"{name}: its shape or chunks are not lists of plausible lengths; copy it again"
        )
    return tuple(told)  # type: ignore[arg-type]


def _is_length(told: object, least: int) -> bool:
    return isinstance(told, int) and not isinstance(told, bool) and least <= told <= LONGEST_AXIS


def _attributes(told: object, name: str) -> dict[str, Any]:
    if not isinstance(told, dict):
        raise InputError(f"{name}: its attributes are not a JSON object; copy it again")
    return told


def _no_numbers(name: str, dtype: object) -> InputError:
    shown = str(dtype)[:40]
    return InputError(
        f"{name}: holds values of type '{shown}', which are not read; store plain numbers"
    )


def _first_line(error: Exception) -> str:
    lines = str(error).splitlines()
    return lines[0][:200] if lines else type(error).__name__


def decoded_size(content: bytes, compressor: str | None, *, limit: int) -> int | None:
    """Size of a decoded chunk, bytes, found in little memory; None if it cannot be decoded.

    Counting stops beyond ``limit`` bytes.

    >>> decoded_size(zlib.compress(bytes(1000)), "zlib", limit=5000)
    1000
    """
    match compressor:
        case None:
            return len(content)
        case "gzip":
            return _inflated_size(content, 31, limit)
        case "zlib":
            return _inflated_size(content, 15, limit)
        case "blosc":
            return _blosc_size(content)
        case "zstd":
            return _zstd_size(content)
        case _:  # lz4 as numcodecs writes it
            return int.from_bytes(content[:4], "little") if len(content) > 4 else None


def _inflated_size(content: bytes, window_bits: int, limit: int) -> int | None:
    """Size of decompressed zlib data, or of all members of gzip data, counted piece by piece."""
    total, rest = 0, content
    while rest:
        reader = zlib.decompressobj(window_bits)
        while not reader.eof:
            try:
                piece = reader.decompress(rest, 1 << 20)
            except zlib.error:
                return None
            total += len(piece)
            if total > limit:
                return total
            rest = reader.unconsumed_tail
            if not (piece or rest or reader.eof):
                return None  # cut off
        rest = reader.unused_data if window_bits == 31 else b""
    return total if content else None


def _blosc_size(content: bytes) -> int | None:
    """Size that a Blosc header names; None if the content is not as long as the header says."""
    if len(content) < 16 or int.from_bytes(content[12:16], "little") != len(content):
        return None
    return int.from_bytes(content[4:8], "little")


def _zstd_size(content: bytes) -> int | None:
    """Size that the header of a Zstandard frame names, if any (RFC 8878, section 3.1.1.1)."""
    if len(content) < 6 or content[:4] != b"\x28\xb5\x2f\xfd":
        return None
    descriptor = content[4]
    is_single = bool(descriptor & 0x20)
    width = (1 if is_single else 0, 2, 4, 8)[descriptor >> 6]
    start = 5 + (not is_single) + (0, 1, 2, 4)[descriptor & 3]
    if width == 0 or len(content) < start + width:
        return None
    size = int.from_bytes(content[start : start + width], "little")
    return size + 256 if width == 2 else size

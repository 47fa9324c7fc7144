"""`Recording`: frames of stored samples with their parameters, read one by one."""

import math
import os
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from polychirp.axes import ComplexArray
from polychirp.capture.parameters import COMBINED_AXES, CaptureParameters, Sampling
from polychirp.capture.zarr_file import ZarrArray
from polychirp.errors import InputError, ModelWarning
from polychirp.model.if_frame import IfFrame

LARGEST_SAMPLE: Final = 1e100
"""Greatest plausible I or Q as a ratio to full scale. Chosen: squares of spectra stay finite."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recording:
    """Frames of a recording; samples stay on disk until a frame is asked for.

    `from_array`, `open_numpy` and `open_raw` make it.

    Parameters
    ----------
    name : name of the file, for messages
    parameters : ramps, converter, antennas and file layout
    num_frames : number of frames in the file
    read : function from a frame's number to its samples ``(receiver, ramp, fast)`` as stored
    """

    name: str
    parameters: CaptureParameters
    num_frames: int
    read: Callable[[int], ComplexArray]

    def frame(self, number: int) -> IfFrame:
        """Frame ``number`` with samples as ratios to full scale, in polychirp's conventions.

        Of each tone in a real recording, one half of the amplitude is at the negative frequency.
        Real samples are doubled, so that the tone at the positive frequency has the whole.
        `InputError` is raised if there is no such frame, or a sample of it is NaN, infinite or too
        large.
        """
        if not 0 <= number < self.num_frames:
            raise InputError(
                f"{self.name}: there is no frame {number}; it has frames 0 to {self.num_frames - 1}"
            )
        parameters = self.parameters
        with np.errstate(all="ignore"):
            samples = np.asarray(
                self.read(number) / parameters.stored_full_scale, dtype=np.complex128
            )
        self._refuse_bad_samples(samples, number)
        self._warn_of_silent_receivers(samples)
        self._warn_of_small_samples(samples)
        if parameters.sampling == "real":
            samples = 2.0 * samples.real.astype(np.complex128)
        if parameters.conjugate:
            np.conjugate(samples, out=samples)
        if parameters.first_receiver == "left":
            samples = samples[::-1]
        return IfFrame(
            samples=samples,
            times=parameters.times,
            schedule=parameters.schedule,
            array=parameters.array,
        )

    def _warn_of_silent_receivers(self, samples: ComplexArray) -> None:
        silent = np.flatnonzero(~np.any(samples, axis=(1, 2)))
        if silent.size:
            names = ", ".join(str(n) for n in silent)
            warnings.warn(
                f"{self.name}: frames hold nothing but zeros of receiver {names}; check "
                "num_receivers, and which receivers the device had switched on",
                ModelWarning,
                stacklevel=3,
            )

    def _warn_of_small_samples(self, samples: ComplexArray) -> None:
        greatest = np.max(np.maximum(np.abs(samples.real), np.abs(samples.imag)), initial=0.0)
        is_within_a_count = 0.0 < greatest <= 1.0 / self.parameters.stored_full_scale
        if self.parameters.full_scale is None and is_within_a_count:
            warnings.warn(
                f"{self.name}: no sample exceeds one count of the converter, whose full scale is "
                f"{self.parameters.stored_full_scale:g} counts; powers in dBFS are wrong if the "
                "samples are stored over full scale: set full_scale=1.0 then",
                ModelWarning,
                stacklevel=3,
            )

    def _refuse_bad_samples(self, samples: ComplexArray, number: int) -> None:
        is_good = np.abs(samples.real) < LARGEST_SAMPLE
        is_good &= np.abs(samples.imag) < LARGEST_SAMPLE  # false for NaN as well
        if np.all(is_good):
            return
        receiver, ramp, fast = (int(n) for n in np.argwhere(~is_good)[0])
        raise InputError(
            f"{self.name}: frame {number} has {np.sum(~is_good)} samples that are not plausible "
            f"numbers, the first at receiver {receiver}, ramp {ramp}, sample {fast}; record it "
            "again, correct full_scale, or process other frames with --frames"
        )


def from_array(
    array: NDArray[Any] | ZarrArray,
    parameters: CaptureParameters,
    *,
    name: str,
    frames: Iterable[int] | None = None,
) -> Recording:
    """A recording from an array with ``parameters.axes``.

    `open_numpy` does the same with a file.

    Parameters
    ----------
    array : array of NumPy or of Zarr
    frames : numbers of the frames that will be read; if given, later frames may be missing

    Raises
    ------
    InputError
        The array has another shape than the parameters say, complex numbers instead of real ones or
        the reverse, or frames are missing.
    """
    axes = parameters.axes
    expected = [parameters.lengths.get(axis) for axis in axes]
    fits = len(axes) == array.ndim and all(
        length in (None, there) for length, there in zip(expected, array.shape, strict=True)
    )
    if not fits:
        told = ", ".join(
            axis if length is None else f"{axis} {length}"
            for axis, length in zip(axes, expected, strict=True)
        )
        raise InputError(
            f"{name}: the array has shape {_shown(array.shape)}, but its parameters say ({told}); "
            "correct axes or the numbers of ramps, samples, transmitters and receivers"
        )
    _refuse_other_sampling(array, parameters, name)
    num_frames = array.shape[axes.index("frame")] if "frame" in axes else 1
    needed = frames_needed(num_frames, parameters, frames)
    if num_frames < needed and frames is not None and num_frames:
        held = "only frame 0 is" if num_frames == 1 else f"only frames 0 to {num_frames - 1} are"
        asked = 0 if num_frames == 1 else f"0-{num_frames - 1}"
        raise InputError(
            f"{name}: {held} there, and --frames asks for frame {needed - 1}; process those with "
            f"--frames {asked}"
        )
    if num_frames < needed:
        raise InputError(
            f"{name}: only {num_frames} of {needed} frames are there"
            + way_out(num_frames, "num_frames")
        )

    def read(number: int) -> ComplexArray:
        place = tuple(slice(number, number + 1) if a == "frame" else slice(None) for a in axes)
        one = np.asarray(array[place])
        return _ordered(_signed(one) if parameters.stored_as == "unsigned" else one, parameters)

    return Recording(name=name, parameters=parameters, num_frames=num_frames, read=read)


def _refuse_other_sampling(
    array: NDArray[Any] | ZarrArray, parameters: CaptureParameters, name: str
) -> None:
    """Refuse real samples that are said to be complex, of which every target has a mirror image."""
    there: Sampling = "complex" if array.dtype.kind == "c" else "real"
    said = parameters.sampling
    if there == said:
        return
    other = "" if there == "complex" else ", or save I and Q as complex numbers"
    raise InputError(
        f"{name}: holds {there} samples, but its parameters say sampling = '{said}'; "
        f"set sampling = '{there}'{other}"
    )


def frames_needed(there: int, parameters: CaptureParameters, frames: Iterable[int] | None) -> int:
    """Number of frames that must be there: up to the last of ``frames``; if that is None, all."""
    if isinstance(frames, range):  # not iterated over, because it may have any length
        return max(frames[0], frames[-1]) + 1 if frames else 0
    if frames is not None:
        return max(frames, default=-1) + 1
    return parameters.num_frames or max(1, there)


def way_out(whole: int, mistake: str) -> str:
    """End of a message: how to process the frames that are whole, and what may be wrong."""
    if whole == 0:
        return f"; record it again, or correct {mistake}"
    frames, option = (
        ("frame 0, which is", "0")
        if whole == 1
        else (f"frames 0 to {whole - 1}, which are", f"0-{whole - 1}")
    )
    return f"; process {frames} whole, with --frames {option}, or correct {mistake}"


def _signed(array: NDArray[Any]) -> ComplexArray:
    """int16 values, as complex numbers, of an array that holds them as if they were uint16."""

    def wrap(values: NDArray[Any]) -> NDArray[np.float64]:
        words = values.astype(np.int64).astype(np.uint16)
        return words.view(np.int16).astype(np.float64)

    if np.iscomplexobj(array):
        return np.asarray(wrap(array.real) + 1j * wrap(array.imag))
    return wrap(array).astype(np.complex128)


def _ordered(array: NDArray[Any], parameters: CaptureParameters) -> ComplexArray:
    """Samples ``(receiver, ramp, fast)`` of an array of one frame with ``parameters.axes``."""
    lengths = {**parameters.lengths, "frame": 1}
    single = [part for name in parameters.axes for part in COMBINED_AXES.get(name, (name,))]
    split = array.reshape([lengths[name] for name in single])
    for name in ("frame", "transmitter", "receiver"):
        if name not in single:
            split, single = split[..., None], [*single, name]
    order = [single.index(name) for name in ("frame", "receiver", "sweep", "transmitter", "fast")]
    return np.asarray(
        split.transpose(order).reshape(
            parameters.num_receivers, parameters.num_ramps, parameters.num_samples
        ),
        dtype=np.complex128,
    )


def _numpy_header(file: BinaryIO) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and data type of a ``.npy`` file; a wrong header raises many types of exceptions."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0
    if version != (1, 0):
        read = np.lib.format.read_array_header_2_0
    shape, _, dtype = read(file)
    if not all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in shape):
        raise ValueError(shape)
    return shape, dtype


def _shown(value: object) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def open_numpy(
    path: Path | str, parameters: CaptureParameters, *, frames: Iterable[int] | None = None
) -> Recording:
    """A recording in a ``.npy`` file, mapped into memory.

    `InputError` is raised if the file cannot be read, is no array of numbers, was cut off, or has
    another shape.

    `from_array` does the same with an array.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            shape, dtype = _numpy_header(file)
            begin = file.tell()
            size = os.fstat(file.fileno()).st_size
    except FileNotFoundError:
        raise InputError(f"there is no recording '{path}'") from None
    except OSError as error:
        raise InputError(f"'{path}' cannot be read: {error.strerror}") from None
    except Exception:  # the header is a Python literal, whose parsers raise many types of errors
        raise InputError(f"{path.name}: is not a NumPy file; save one with numpy.save") from None
    if dtype.kind not in "iufc":
        raise InputError(f"{path.name}: holds {_shown(dtype)}, not numbers")
    if not shape or min(shape) < 1:
        raise InputError(f"{path.name}: has the shape {shape}, so it holds no frame; save it again")
    missing = begin + math.prod(shape) * dtype.itemsize - size
    if missing > 0:
        raise InputError(
            f"{path.name}: is {missing} bytes shorter than the {_shown(shape)} numbers that it "
            "announces; copy or save it again"
        )
    array = np.load(path, mmap_mode="r", allow_pickle=False)
    return from_array(array, parameters, name=path.name, frames=frames)

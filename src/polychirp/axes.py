"""Axis names of arrays: every array field of a data type names its axes; `seal` checks them."""

from dataclasses import fields
from functools import cache
from typing import Annotated, Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from polychirp.errors import InputError


class Axes:
    """Names of an array's axes, and its element type; an axis named by a number has that length."""

    def __init__(self, *names: str, dtype: type = np.float64) -> None:
        self.names = names
        self.dtype = dtype

    def __repr__(self) -> str:
        return f"Axes{self.names}"


FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
SingleComplexArray = NDArray[np.complex64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

PerRamp = Annotated[FloatArray, Axes("ramp")]
PerRampIndex = Annotated[IntArray, Axes("ramp", dtype=np.int64)]
PerPath = Annotated[FloatArray, Axes("path")]
PerPathIndex = Annotated[IntArray, Axes("path", dtype=np.int64)]
PerPathVector = Annotated[FloatArray, Axes("path", "3")]
PerDetection = Annotated[FloatArray, Axes("detection")]
PerTarget = Annotated[FloatArray, Axes("target")]
Vector = Annotated[FloatArray, Axes("3")]


@cache
def _array_fields(cls: type) -> tuple[tuple[str, Axes], ...]:
    hints = get_type_hints(cls, include_extras=True)
    found = []
    for field in fields(cls):
        for note in getattr(hints[field.name], "__metadata__", ()):
            if isinstance(note, Axes):
                found.append((field.name, note))
    return tuple(found)


def axes_of(cls: type) -> dict[str, tuple[str, ...]]:
    """Axis names of every array field of a data type.

    >>> from polychirp.model.ramp import RampSchedule
    >>> axes_of(RampSchedule)["slope"]
    ('ramp',)
    """
    return {name: axes.names for name, axes in _array_fields(cls)}


def seal(instance: Any) -> None:
    """Check that an instance's arrays agree in the lengths of their axes; make them read-only.

    A data type is `Sealed`, or calls it at the end of ``__post_init__``. Arrays are converted to
    the declared element type, without a copy if possible; the instance's own view of them cannot be
    written to. `InputError` is raised if an array has a wrong number of axes, or an axis has two
    different lengths.
    """
    lengths: dict[str, tuple[int, str]] = {}
    for name, axes in _array_fields(type(instance)):  # type: ignore[arg-type]
        given = np.asarray(getattr(instance, name))
        if given.dtype != axes.dtype:
            _refuse_loss(given, axes.dtype, f"{type(instance).__name__}.{name}")
        array: NDArray[Any] = np.asarray(given, dtype=axes.dtype).view()
        if array.ndim != len(axes.names):
            raise InputError(
                f"{type(instance).__name__}.{name} has {array.ndim} axes; it needs "
                f"({', '.join(axes.names)})"
            )
        for axis, length in zip(axes.names, array.shape, strict=True):
            expected, owner = lengths.setdefault(
                axis, (int(axis), "its definition") if axis.isdigit() else (length, name)
            )
            if length != expected:
                raise InputError(
                    f"{type(instance).__name__}.{name} has {length} along '{axis}', "
                    f"but {owner} has {expected}"
                )
        array.flags.writeable = False
        object.__setattr__(instance, name, array)


def _refuse_loss(given: NDArray[Any], dtype: type, place: str) -> None:
    """Refuse an array whose elements are not those of ``dtype``: text, halves, imaginary parts."""
    if given.size == 0:
        return
    if given.dtype.kind not in "biufcO" and np.issubdtype(dtype, np.number):
        raise InputError(f"{place} holds {given.dtype} instead of numbers; give numbers")
    if given.dtype.kind == "c" and not np.issubdtype(dtype, np.complexfloating):
        if np.any(given.imag != 0):
            raise InputError(
                f"{place} has complex numbers; it needs real ones, such as their real parts"
            )
    elif given.dtype.kind == "f" and np.issubdtype(dtype, np.integer):
        is_whole = np.isfinite(given) & (given == np.round(given))
        if not is_whole.all():
            raise InputError(
                f"{place} has the entry {given[~is_whole][0]:g}; it needs whole numbers"
            )


class Sealed:
    """Base of data types whose arrays are only sealed; one with further checks calls `seal`."""

    __slots__ = ()

    def __post_init__(self) -> None:
        seal(self)

"""Compilation of kernels by numba.

Importing numba takes a second: only modules of kernels import this one, and other modules import
those inside the functions that call them. `kernel_cache` compiles kernels ahead of their first use.

Compilation is a new user's first wait, so kernels are written such that it is short. Loops in
parallel would double it (``parallel=True``); `threads.in_ranges` runs a kernel on several cores
instead. Assignments to slices and ``np.linalg.solve`` compile the texts of their error messages,
some seconds of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

from numba import njit
from numba.core.dispatcher import Dispatcher

F = TypeVar("F", bound=Callable[..., object])

OPTIONS: Final[dict[str, Any]] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
}
"""Options of all kernels: stored beside the source, free of Python's lock, with IEEE divisions by
zero, and without the entry point for C."""


def compiled(function: F) -> F:
    """A kernel that Python calls, compiled on first use."""
    return cast("F", njit(**OPTIONS)(function))


def inner(function: F) -> F:
    """A kernel that only kernels call: it has no entry point for Python.

    Making that takes a fifth of the compilation where arguments are records.
    """
    return _without_entry(function)


def inlined(function: F) -> F:
    """A small inner kernel compiled into its callers: a call would count references to arrays."""
    return _without_entry(function, forceinline=True)


def reordered(function: F) -> F:
    """A kernel whose sums may be taken in any order, so that its loops use vector instructions."""
    return cast("F", njit(**OPTIONS, fastmath={"reassoc", "contract", "nsz"})(function))


def fast(function: F) -> F:
    """A kernel with fast arithmetic: its numbers are finite, and rounding does not matter."""
    return cast("F", njit(**OPTIONS, fastmath=True)(function))


def fast_inlined(function: F) -> F:
    """A small inner kernel with fast arithmetic, compiled into its callers."""
    return _without_entry(function, forceinline=True, fastmath=True)


def _without_entry(function: F, **options: bool) -> F:
    """A kernel without an entry point for Python; a call from there is refused.

    Numba itself would jump to the address of the missing entry point.
    """

    def refuse(*_arguments: object, **_names: object) -> None:
        raise TypeError(
            f"the kernel '{function.__name__}' has no entry point for Python: only kernels can "
            "call it; '@compiled' gives it one"
        )

    kernel = njit(**{**OPTIONS, **options, "no_cpython_wrapper": True})(function)
    if isinstance(kernel, Dispatcher):  # else compilation is off, and it is the function itself
        own = cast("Any", kernel)
        own._insert = lambda *_signature, **_options: None  # its entry is never called
        own._compile_for_args = refuse
    return cast("F", kernel)

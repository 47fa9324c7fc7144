"""Compilation of kernels by numba.

Importing numba takes a second: only modules with kernels import this module, and other modules
import those inside the functions that call kernels. `kernel_cache` compiles kernels ahead of use.

Compilation is a new user's first wait, so kernels are written such that it is short. Parallel loops
(``parallel=True``) would double its duration; `threads.in_ranges` runs a kernel on several cores
instead. Assignments to slices and ``np.linalg.solve`` take some seconds to compile, because the
texts of their error messages are compiled too.
"""

from collections.abc import Callable
from typing import Any, Final, TypeVar, cast

from numba import njit
from numba.core import cgutils, config, types
from numba.core.caching import IndexDataCacheFile
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

from polychirp.kernel_code import compile_reproducibly

F = TypeVar("F", bound=Callable[..., object])

OPTIONS: Final[dict[str, Any]] = {
    "cache": True,
    "nogil": True,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "fastmath": False,
    "forceinline": False,
}
"""Options of all kernels, in this order: machine code is kept on disk, Python's global lock is
released, a division by zero gives inf or NaN (IEEE 754), no entry point for C is made, sums are
taken in the order in which they are written, and the compiler decides what it inlines. What is not
set here, a kernel would inherit from the one during whose compilation it is first needed."""

IN_ANY_ORDER: Final = frozenset({"reassoc", "contract", "nsz"})
"""Freedoms of the compiler with sums: their order, fused products, and the sign of zero."""


def _forget_missing_types() -> None:
    """Let numba compile a kernel anew if its file in the cache names a type that is gone.

    Numba reads the types of its arguments there before it looks whether the source has changed, and
    raises an error where an earlier version of the package had a type that this one lacks.
    """
    load: Callable[..., Any] = IndexDataCacheFile._load_index

    def load_if_known(self: Any) -> Any:
        try:
            return load(self)
        except (AttributeError, ImportError):
            return {}

    IndexDataCacheFile._load_index = load_if_known  # type: ignore[method-assign]


compile_reproducibly()
_forget_missing_types()


def compiled(function: F) -> F:
    """A kernel that Python calls, compiled on first use."""
    return cast("F", njit(**OPTIONS)(function))


def inner(function: F) -> F:
    """A kernel that only kernels call: it has no entry point for Python.

    Making an entry point takes a fifth of the compilation's time if arguments are records.
    """
    return _without_entry(function)


def inlined(function: F) -> F:
    """A small inner kernel compiled into its callers, which saves counting references to arrays."""
    return _without_entry(function, forceinline=True)


def fused_inlined(function: F) -> F:
    """An inlined kernel whose products are added without being rounded before.

    Unlike fast arithmetic, this keeps the order of its sums and differences.
    """
    return _without_entry(function, forceinline=True, fastmath={"contract"})


def reordered(function: F) -> F:
    """A kernel whose sums may be taken in any order, so that its loops use vector instructions."""
    return cast("F", njit(**{**OPTIONS, "fastmath": set(IN_ANY_ORDER)})(function))


def reordered_inner(function: F) -> F:
    """An inner kernel whose sums may be taken in any order."""
    return _without_entry(function, fastmath=set(IN_ANY_ORDER))


def fast(function: F) -> F:
    """A kernel with fast arithmetic: its numbers must be finite, and their rounding may change."""
    return cast("F", njit(**{**OPTIONS, "fastmath": True})(function))


def fast_inlined(function: F) -> F:
    """A small inner kernel with fast arithmetic, compiled into its callers."""
    return _without_entry(function, forceinline=True, fastmath=True)


def _borrow(_typing: Any, value: Any) -> Any:
    """The type of what `borrowed` returns, and what makes its code."""

    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        return _disowned(context, builder, signature.return_type, given[0])

    return value(value), generate


def _as_it_is(value: Any) -> Any:
    return value


borrowed = cast(
    "Callable[[Any], Any]",
    _as_it_is if config.DISABLE_JIT else intrinsic(_borrow),  # type: ignore[attr-defined]
)
"""An array or a named tuple of arrays, to which compiled code counts no references.

Counting takes a fifteenth of the time of kernels that hand many arrays to small kernels. The arrays
must be arguments of the kernel that calls this, which keeps them, and must not be returned by it.
"""


def _disowned(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The code of `borrowed` for a value of a numba type ``kind``."""
    if isinstance(kind, types.BaseTuple):
        items = cgutils.unpack_tuple(builder, value)  # type: ignore[no-untyped-call]
        kinds = cast("Any", kind)
        parts = [_disowned(context, builder, *one) for one in zip(kinds, items, strict=True)]
        return context.make_tuple(builder, kind, parts)
    if not isinstance(kind, types.Array):
        return value
    array = make_array(kind)(context, builder, value)  # type: ignore[no-untyped-call]
    array.meminfo = cgutils.get_null_value(array.meminfo.type)  # type: ignore[no-untyped-call]
    return array._getvalue()


def _without_entry(function: F, **options: bool | set[str]) -> F:
    """A kernel without an entry point for Python; a call from Python raises a `TypeError`.

    Without this check, numba would jump to the address of the missing entry point.
    """

    def refuse(*_arguments: object, **_names: object) -> None:
        raise TypeError(
            f"the kernel '{function.__name__}' has no entry point for Python: only kernels can "
            "call it; '@compiled' gives it one"
        )

    kernel = njit(**{**OPTIONS, **options, "no_cpython_wrapper": True})(function)
    if isinstance(kernel, Dispatcher):  # with compilation off, kernel is the function itself
        own = cast("Any", kernel)
        own._insert = lambda *_signature, **_options: None  # there is no entry to register
        own._compile_for_args = refuse
    return cast("F", kernel)

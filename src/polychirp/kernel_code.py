"""Machine code of kernels that depends on nothing but the kernels.

Numba does not promise this. The rounding of sums depended on which kernel a process compiled first
and on which it loaded first, so that a study gave other last digits on the next day. Here numba's
compiler is changed in three places, for all kernels of a process, also those of other packages.
`jit` does so before it makes any.
"""

from collections.abc import Callable
from typing import Any

from llvmlite.binding import Linkage  # type: ignore[import-untyped]
from numba.core.codegen import CPUCodeLibrary
from numba.core.cpu import CPUContext, CPUTargetOptions


def compile_reproducibly() -> None:
    """Change numba such that it compiles kernels alike in any order."""
    _keep_arithmetic_apart()
    _keep_callees_apart()


def _keep_arithmetic_apart() -> None:
    """Let numba compile its own functions for the arithmetic of each kernel that uses them.

    Numba keeps functions of its own, such as the product of complex numbers, as it first compiled
    them in a process, with the arithmetic of the kernel that was compiled then. Here those that it
    calls for operators are kept for each arithmetic, and those that stand for functions of NumPy
    take sums in the written order always.
    """
    subtarget: Callable[..., Any] = CPUContext.subtarget
    finalize: Callable[..., None] = CPUTargetOptions.finalize
    kept: dict[tuple[str, ...], dict[Any, Any]] = {}

    def with_own_functions(self: Any, **changes: Any) -> Any:
        context = subtarget(self, **changes)
        if "fastmath" in changes:
            freedoms = tuple(sorted(context.fastmath.flags))
            context.cached_internal_func = kept.setdefault(freedoms, {})
        return context

    def without_inheritance(self: Any, flags: Any, options: Any) -> None:
        if not flags.is_set("fastmath"):
            flags.fastmath = False
        finalize(self, flags, options)

    CPUContext.subtarget = with_own_functions  # type: ignore[method-assign]
    CPUTargetOptions.finalize = without_inheritance  # type: ignore[method-assign]


def _keep_callees_apart() -> None:
    """Let every kernel call the copies of other kernels that its own machine code holds.

    The compiler optimises such a copy together with its caller. Numba gives all copies of a kernel
    one name, by which a process finds the one that it loaded first. Here copies have names inside
    of their callers alone. What further callers are compiled with keeps the common names.
    """
    finalize: Callable[..., None] = CPUCodeLibrary._finalize_final_module

    def with_own_callees(self: Any) -> None:
        if self._shared_module is None:  # it was compiled here, and not read from the cache
            self._shared_module = self._final_module.clone()
            for function in _defined(self._shared_module, Linkage.external):
                function.linkage = "linkonce_odr"
            for function in _defined(self._final_module, Linkage.linkonce_odr):
                function.linkage = "internal"
        finalize(self)

    CPUCodeLibrary._finalize_final_module = with_own_callees  # type: ignore[method-assign]


def _defined(module: Any, linkage: Any) -> list[Any]:
    """Functions of a module that have a body and this linkage."""
    return [f for f in module.functions if not f.is_declaration and f.linkage == linkage]

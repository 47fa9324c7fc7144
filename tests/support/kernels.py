"""Calls of inner kernels, which have no entry point for Python."""

from collections.abc import Callable
from typing import Any

from numba import njit


def callable_from_python(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """A kernel that calls another one, and that Python can call."""

    @njit
    def call(*arguments: Any) -> Any:
        return kernel(*arguments)

    return call

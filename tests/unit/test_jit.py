"""Kernels: who may call them."""

import pytest

from polychirp.jit import compiled, fast_inlined, inlined, inner


@inner
def double(x):
    return 2.0 * x


@inlined
def triple(x):
    return 3.0 * x


@fast_inlined
def half(x):
    return 0.5 * x


@compiled
def product(x):
    return double(x) * triple(x) * half(x)


def test_kernels_call_inner_kernels():
    assert product(2.0) == 24.0


@pytest.mark.parametrize("kernel", [double, triple, half])
def test_python_does_not_call_inner_kernels(kernel):
    product(1.0)  # compiles them
    for _ in range(2):
        with pytest.raises(TypeError, match="'@compiled' gives it one"):
            kernel(1.0)

"""Kernels: who may call them, and their arithmetic."""

import os
import re
import subprocess
import sys
from itertools import count
from typing import NamedTuple

import numba
import numpy as np
import pytest
from numba import complex64

from polychirp.jit import borrowed, compiled, fast_inlined, inlined, inner, reordered


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


@pytest.fixture
def made(monkeypatch, tmp_path):
    """Function that makes a kernel with an empty cache: `freedoms` cannot read cached ones."""

    def make(decorator, function):
        monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / str(next(numbers))))
        return decorator(function)

    numbers = count()
    return make


def freedoms(kernel):
    """What the compiler may do with the additions, products and quotients of a kernel."""
    (text,) = kernel.inspect_llvm().values()
    return set(re.findall(r"= f(?:add|sub|mul|div)([a-z ]*) (?:float|double) ", text))


IN_ORDER, IN_ANY_ORDER = {""}, {" reassoc nsz contract"}


@pytest.mark.parametrize(
    ("function", "is_strict_first"),
    [(lambda x, y: x * y, True), (lambda x, y: x / y, False)],
)
def test_complex_numbers_have_the_arithmetic_of_the_kernel(made, function, is_strict_first) -> None:
    """It does not depend on which kernel is compiled first.

    Other kernels have no complex numbers of single precision, so that numba compiles the product
    and the quotient of such numbers here for the first time in a process.
    """
    strict, free = made(compiled, function), made(reordered, function)
    for kernel in (strict, free) if is_strict_first else (free, strict):
        kernel.compile((complex64, complex64))
    assert freedoms(strict) == IN_ORDER
    assert freedoms(free) == IN_ANY_ORDER


@pytest.mark.parametrize("caller", [reordered, fast_inlined])
def test_a_kernel_takes_nothing_over_from_the_one_that_is_compiled_first(made, caller) -> None:
    """An inner kernel is compiled during the compilation of the first kernel that calls it."""
    total = made(inner, lambda x: x[0] + x[1] + x[2])
    calls = made(caller, lambda x: total(x) * 3.0)
    made(compiled, lambda x: 1.0 + calls(x))(np.ones(3))
    assert freedoms(total) == IN_ORDER
    (text,) = total.inspect_llvm().values()
    assert "alwaysinline" not in text


def test_a_kernel_holds_its_own_copies_of_those_that_it_calls(made) -> None:
    """Copies that a process could take from another kernel would be ``linkonce_odr``."""
    total = made(inner, lambda x: np.sort(x)[::2].sum())
    calls = made(compiled, lambda x: total(x) + total(x[1:]))
    assert calls(np.arange(5.0)) == 10.0
    (text,) = calls.inspect_llvm().values()
    assert re.search(r"^define internal .*lambda", text, re.MULTILINE)
    assert "define linkonce_odr" not in text


def test_functions_of_numpy_sum_in_the_written_order(made) -> None:
    total = made(reordered, lambda x: np.cumsum(x)[-1])
    total(np.ones(3))
    assert freedoms(total) == IN_ORDER


def test_a_type_that_is_gone_keeps_no_kernel_from_being_compiled(tmp_path):
    """A later version has another name for the type of an argument."""
    source = tmp_path / "versions.py"
    text = (
        "from typing import NamedTuple\n"
        "from polychirp.jit import compiled\n"
        "class Before(NamedTuple):\n    number: float\n"
        "@compiled\ndef twice(one):\n    return 2.0 * one.number\n"
        "print(twice(Before(3.0)))\n"
    )
    for name in ("Before", "Afterwards"):
        source.write_text(text.replace("Before", name), encoding="utf-8")
        ran = subprocess.run(
            [sys.executable, "-c", "import versions"],
            cwd=tmp_path,
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")},
            capture_output=True,
            text=True,
            check=False,
        )
        assert ran.stdout == "6.0\n", ran.stderr
    assert len(list((tmp_path / "cache").rglob("*.nbi"))) == 1


class Table(NamedTuple):
    """Arrays and a number, as kernels take them."""

    number: np.ndarray
    weight: np.ndarray
    scale: float


@compiled
def weighted(table, out):
    """Sum of the weights, taken from borrowed arrays, and written into one."""
    table, out = borrowed(table), borrowed(out)
    for i in range(len(table.number)):
        part = table.weight[table.number[i] :]
        out[0] += table.scale * part[0]


def test_borrowed_arrays_are_those_given_and_stay_alive():
    table = Table(np.array([2, 0]), np.array([1.0, 2.0, 4.0]), 0.5)
    out = np.zeros(1)
    counts = [sys.getrefcount(array) for array in (*table[:2], out)]
    for _ in range(3):
        weighted(table, out)
    assert out[0] == 3 * 0.5 * (4.0 + 1.0)
    assert [sys.getrefcount(array) for array in (*table[:2], out)] == counts

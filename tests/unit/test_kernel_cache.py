"""Kernels are compiled once, by workers, and a stamp knows what is there."""

import json
import os
import textwrap
from dataclasses import replace
from pathlib import Path

import pytest

from polychirp import kernel_cache
from polychirp.cli.progress import TimeLeft
from polychirp.kernel_cache import (
    Part,
    Stamp,
    _share_done,
    compile_ahead,
    kernel_modules,
    missing,
)

WORKER = """
from polychirp.kernel_cache import serve
from toy.kernels import first, second

def one():
    print("a library says hello")
    first(1.0)

def broken():
    raise ValueError("no such road")

if __name__ == "__main__":
    serve({"one": one, "two": lambda: second(1.0), "broken": broken})
"""

KERNELS = """
from numba import njit
from toy.leaf import leaf

@njit(cache=True)
def first(x):
    return leaf(x) + 1.0

@njit(cache=True)
def second(x):
    return leaf(x) + 2.0
"""

LEAF = """
from numba import njit
from toy.numbers import NUMBER

@njit(cache=True)
def leaf(x):
    return x + NUMBER
"""

ONE, TWO = (Part(name=name, duration=9.0, kernels=2) for name in ("one", "two"))


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A package of two kernels, with a cache of its own."""
    package = tmp_path / "toy"
    package.mkdir()
    for name, text in {
        "__init__": "",
        "worker": WORKER,
        "kernels": KERNELS,
        "leaf": LEAF,
        "numbers": "from toy.units import UNIT\n\nNUMBER = 1.0 * UNIT\nWORD = 'a'\n",
        "units/__init__": "from toy.units.metres import METRE as UNIT\n",
        "units/metres": "METRE = 1.0\n",
        "unrelated": "OTHER = 1.0\n",
    }.items():
        (package / f"{name}.py").parent.mkdir(exist_ok=True)
        (package / f"{name}.py").write_text(textwrap.dedent(text))
    home = str(Path(kernel_cache.__file__).parents[1])
    monkeypatch.setattr(kernel_cache, "PACKAGE", package)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([home, os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    kernel_cache.cache_folder.cache_clear()
    kernel_cache._machine.cache_clear()
    yield package
    kernel_cache.cache_folder.cache_clear()
    kernel_cache._machine.cache_clear()


def compiled(*parts, **options):
    return compile_ahead(parts, worker="toy.worker", **options)


def test_workers_compile_every_kernel_once_and_a_second_call_nothing(toy, capsys):
    steps = []
    done = compiled(ONE, TWO, progress=lambda _, *step: steps.append(step))
    names = [name.rpartition(".")[2] for name in done.kernels]
    assert sorted(names) == ["first", "leaf", "second"]
    assert sorted(done.parts) == ["one", "two"]
    assert (steps[0], steps[-1]) == ((0, 4), (4, 4))
    said = capsys.readouterr().err
    assert said.count("polychirp: compiling 4 kernels, once; about ") == 1
    assert missing(["one", "two"]) == ()
    again = compiled(ONE, TWO)
    assert (again.parts, again.kernels) == ((), ())
    assert capsys.readouterr().err == ""


def test_the_progress_grows_with_the_work_that_is_done():
    """After half of the slow kernels 45 of 100 s are over, although 5 of 105 kernels are done."""
    slow = Part(name="slow", duration=90.0, kernels=10)
    quick = Part(name="quick", duration=10.0, kernels=95)
    share = _share_done([slow, quick], counts={"slow": 5}, finished=())
    assert share == pytest.approx(0.45)
    more = _share_done([slow, quick], counts={"slow": 40, "quick": 19}, finished=())
    assert more == pytest.approx(0.92)
    assert _share_done([slow, quick], counts={}, finished=("slow", "quick")) == 1.0


def test_the_time_left_follows_the_rate_so_far(toy):
    """Each step that the callback sees is one of equal times; a slow machine's are longer."""
    left, seen = TimeLeft(0.0), []
    parts = [Part(name="a", duration=60.0, kernels=6), Part(name="b", duration=60.0, kernels=60)]
    for second in range(1, 240):  # twice as slow as expected
        counts = {"a": min(6, second // 20), "b": max(0, (second - 120) // 2)}
        share = _share_done(parts, counts=counts, finished=("a",) if second >= 120 else ())
        if (time := left.update(int(66 * share), 66, float(second))) is not None:
            seen.append((second, time))
    assert len(seen) > 100
    assert all(abs(time - (240 - second)) < 60.0 for second, time in seen)


def test_a_part_that_was_not_asked_for_is_missing(toy):
    compiled(ONE)
    assert missing(["one", "two"]) == ("two",)


def test_a_cache_file_that_is_gone_is_missed(toy):
    compiled(ONE)
    next(path for path in toy.parent.glob("cache/*/*.nbi")).unlink()
    assert missing(["one"]) == ("one",)


def test_a_change_of_a_number_reaches_the_kernels_that_take_it(toy):
    compiled(ONE)
    (toy / "numbers.py").write_text("NUMBER = 22.0\n")
    assert missing(["one"]) == ("one",)
    done = compiled(ONE)
    assert {name.rpartition(".")[2] for name in done.kernels} == {"first", "leaf"}


def test_a_change_reaches_kernels_that_no_part_names(toy):
    compiled(ONE)
    stamp = kernel_cache.read_stamp()
    kernel_cache._write_stamp(replace(stamp, parts={}))
    (toy / "numbers.py").write_text("NUMBER = 22.0\n")
    assert {name.rpartition(".")[2] for name in compiled(ONE).kernels} == {"first", "leaf"}


def test_a_change_of_a_number_behind_that_number_reaches_the_kernels(toy):
    """A module without kernels computes its constant from that of a package, which imports it."""
    before = kernel_modules()
    (toy / "units" / "metres.py").write_text("METRE = 22.0\n")
    changed = {name for name, hashed in kernel_modules().items() if hashed != before[name]}
    assert changed == {"toy.kernels", "toy.leaf", "toy.worker"} & set(before)


def test_a_change_that_no_kernel_sees_compiles_nothing(toy):
    compiled(ONE)
    (toy / "unrelated.py").write_text("OTHER = 22.0\n")
    assert missing(["one"]) == ("one",)
    assert compiled(ONE).parts == ()
    assert missing(["one"]) == ()


def test_a_part_that_fails_is_noted_once_and_the_others_go_on(toy, capsys):
    broken = Part(name="broken", duration=1.0, kernels=1)
    done = compiled(broken, ONE)
    assert set(done.parts) == {"broken", "one"}
    assert len(done.failures) == 1
    assert "'broken' could not be compiled ahead: ValueError: no such road" in (
        capsys.readouterr().err
    )
    assert missing(["broken", "one"]) == ()


def test_short_compilations_are_not_announced(toy, capsys):
    compiled(Part(name="one", duration=1.0, kernels=2))
    assert "compiling" not in capsys.readouterr().err


def test_nothing_is_compiled_where_numba_may_not(toy, monkeypatch):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert compiled(ONE).parts == ()


def test_a_folder_that_cannot_be_written_is_replaced_and_noted_once(toy, monkeypatch, capsys):
    monkeypatch.setattr(kernel_cache, "_is_writable", lambda _: False)
    folder = kernel_cache.cache_folder()
    assert folder.is_dir()
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)
    assert kernel_cache.cache_folder() == folder
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2  # the folder that was asked for, and all folders
    assert "compiled anew by every command" in said[1]


def test_an_unreadable_stamp_is_none(toy):
    kernel_cache.stamp_path().write_text("[")
    assert kernel_cache.read_stamp() is None
    kernel_cache.stamp_path().write_text(json.dumps({"sources": ""}))
    assert kernel_cache.read_stamp() is None


def test_a_stamp_is_read_as_it_was_written(toy):
    stamp = Stamp(sources="a", modules={"m": "b"}, parts={"one": ["f"]})
    kernel_cache._write_stamp(stamp)
    assert kernel_cache.read_stamp() == stamp


def test_kernel_modules_are_those_with_kernels():
    """Modules of ours: what decorates kernels is found in all of them."""
    names = kernel_modules()
    assert "polychirp.channel.geometry.bvh" in names
    assert "polychirp.synthesis.stretch.batch_kernels" in names
    assert "polychirp.study.trial" not in names
    # a change of the compiler changes all kernels
    assert "polychirp.kernel_code" in names

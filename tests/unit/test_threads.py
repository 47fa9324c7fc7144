"""Pieces of work side by side: the order, the errors, and each one's share of the cores."""

import threading

import numba
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from polychirp import threads
from polychirp.threads import side_by_side


@numba.njit(parallel=True, cache=True)
def total(count):
    """Anything in parallel: numba chooses its threading layer when it first has to."""
    found = 0
    for number in numba.prange(count):
        found += number
    return found


@pytest.fixture(autouse=True)
def two_cores():
    total(4)
    before = numba.get_num_threads()
    if numba.config.NUMBA_NUM_THREADS < 2:
        pytest.skip("numba has one thread here")
    numba.set_num_threads(2)
    yield
    numba.set_num_threads(before)


def shared():
    return numba.threading_layer() != "workqueue"


def test_results_come_in_the_order_of_the_pieces():
    """The first waits for the second."""
    if not shared():
        pytest.skip("numba's threading layer here is for one thread at a time")
    done = threading.Event()

    def first():
        assert done.wait(10.0)
        return 1

    def second():
        done.set()
        return 2

    assert list(side_by_side([first, second])) == [1, 2]


def test_each_piece_has_its_share_of_the_cores():
    counts = list(side_by_side([numba.get_num_threads] * 3))
    assert counts == [1, 1, 1] if shared() else [2, 2, 2]
    assert numba.get_num_threads() == 2


def test_kernels_of_two_pieces_run_at_once():
    assert list(side_by_side([lambda: total(10), lambda: total(100)])) == [45, 4950]


def test_an_error_ends_those_that_have_not_begun():
    begun = []

    def failing():
        raise ValueError("no road")

    with pytest.raises(ValueError, match="no road"):
        list(side_by_side([failing, *[lambda n=n: begun.append(n) for n in range(100)]]))
    assert len(begun) < 100


def test_without_a_shared_layer_one_goes_after_another(monkeypatch):
    monkeypatch.setattr(threads, "_may_be_shared", lambda: False)
    assert list(side_by_side([numba.get_num_threads] * 2)) == [2, 2]
    assert list(side_by_side([threading.get_ident] * 2)) == [threading.get_ident()] * 2


def test_linear_algebra_keeps_to_one_thread_meanwhile():
    def most():
        return max(p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas")

    if not shared():
        pytest.skip("numba's threading layer here is for one thread at a time")
    with threadpool_limits(2, user_api="blas"):
        assert list(side_by_side([most, most])) == [1, 1]
        assert most() == 2

"""Parallel work: the order, the errors, and the cores of each piece."""

import threading

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from polychirp import CoherentReceiver, Decoding, MfskReceiver, RangeDoppler
from polychirp.synthesis.stretch.engine import Stretch
from polychirp.threads import cores_here, in_ranges, limit_cores, one_blas_thread, side_by_side


@pytest.fixture(autouse=True)
def two_cores():
    limit_cores(2)
    yield
    limit_cores(None)


def test_results_come_in_the_order_of_the_pieces():
    """The first waits for the second."""
    done = threading.Event()

    def first():
        assert done.wait(10.0)
        return 1

    def second():
        done.set()
        return 2

    assert list(side_by_side([first, second])) == [1, 2]


def test_each_piece_has_its_share_of_the_cores():
    assert list(side_by_side([cores_here] * 3)) == [1, 1, 1]
    assert cores_here() == 2
    limit_cores(4)
    assert list(side_by_side([cores_here] * 2)) == [2, 2]


def test_an_error_ends_those_that_have_not_begun():
    begun = []

    def failing():
        raise ValueError("no road")

    with pytest.raises(ValueError, match="no road"):
        list(side_by_side([failing, *[lambda n=n: begun.append(n) for n in range(100)]]))
    assert len(begun) < 100


def test_on_one_core_one_goes_after_another():
    limit_cores(1)
    assert list(side_by_side([threading.get_ident] * 2)) == [threading.get_ident()] * 2


def blas_threads():
    return max(p["num_threads"] for p in threadpool_info() if p["user_api"] == "blas")


@pytest.mark.parametrize("cores", [1, 2])
def test_linear_algebra_keeps_to_one_thread_meanwhile(cores):
    limit_cores(cores)
    with threadpool_limits(2, user_api="blas"):
        assert list(side_by_side([blas_threads, blas_threads])) == [1, 1]
        assert blas_threads() == 2


def test_contexts_of_one_blas_thread_end_in_any_order():
    """The first that begins ends first, in another thread than the second."""
    first, second = one_blas_thread(), one_blas_thread()
    with threadpool_limits(2, user_api="blas"):
        first.__enter__()
        second.__enter__()
        other = threading.Thread(target=first.__exit__, args=(None, None, None))
        other.start()
        other.join()
        assert blas_threads() == 1
        second.__exit__(None, None, None)
        assert blas_threads() == 2


class Spy:
    """A frame or a scene that says how many threads linear algebra has when it is looked at."""

    def __getattr__(self, name):
        raise LookupError(blas_threads())


@pytest.mark.parametrize(
    "receiver",
    [CoherentReceiver(), RangeDoppler(), Decoding(), MfskReceiver()],
    ids=lambda receiver: receiver.kind,
)
def test_receivers_keep_linear_algebra_to_one_thread(receiver):
    """Two threads took twice the CPU time for a frame of a street, and were no faster."""
    with threadpool_limits(2, user_api="blas"):
        with pytest.raises(LookupError, match=r"^1$"):
            receiver.detect(Spy())
        assert blas_threads() == 2


def test_the_engine_keeps_linear_algebra_to_one_thread():
    with threadpool_limits(2, user_api="blas"), pytest.raises(LookupError, match=r"^1$"):
        Stretch().contribution(Spy(), [], [], victim=0, transmitter=0)


def test_an_error_gives_the_threads_of_linear_algebra_back():
    with threadpool_limits(2, user_api="blas"):
        with pytest.raises(ValueError, match="no road"), one_blas_thread():
            raise ValueError("no road")
        assert blas_threads() == 2


@pytest.mark.parametrize("cores", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 2, 7, 1000])
def test_ranges_cover_every_row_once(cores, count):
    limit_cores(cores)
    times = np.zeros(count, dtype=int)

    def fill(begin, end, out):
        out[begin:end] += 1

    in_ranges(fill, count, times)
    assert np.all(times == 1)


def test_ranges_run_at_once():
    """Each of two threads waits until the other has begun."""
    meeting = threading.Barrier(2, timeout=10.0)
    met = []

    def fill(begin, _end):
        if begin in (0, 1):
            meeting.wait()
            met.append(begin)

    in_ranges(fill, 4)
    assert sorted(met) == [0, 1]


def test_few_rows_are_one_range():
    calls = []
    in_ranges(lambda *rows: calls.append(rows), 19, least=10)
    assert calls == [(0, 19)]


def test_an_error_in_a_range_is_raised():
    def fill(begin, _end):
        if begin > 0:
            raise ValueError("no road")

    with pytest.raises(ValueError, match="no road"):
        in_ranges(fill, 10)

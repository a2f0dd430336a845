"""Work on both processors: the answers are those of one, in order, however it is nested and
whatever fails.
"""

import threading
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap import side_by_side
from epa_rt.gap.side_by_side import each


def is_helped() -> bool:
    """Whether a call gets a second thread: neither of two goes on before the other is there."""
    both = threading.Barrier(2, timeout=60.0)
    return each(lambda _: both.wait() >= 0, range(2)) == [True, True]


@given(st.lists(st.integers(), max_size=30))
@settings(deadline=None)
def test_answers_are_in_order(items):
    assert each(lambda x: 3 * x, items) == [3 * x for x in items]


@given(st.lists(st.lists(st.integers(), max_size=8), max_size=8))
@settings(deadline=None)
def test_what_is_worked_on_may_ask_for_help_itself(rows):
    assert each(lambda row: each(lambda x: x + 1, row), rows) == [
        [x + 1 for x in row] for row in rows
    ]


def test_two_threads_work_at_once():
    assert is_helped()


def test_there_are_never_more_than_two_at_work():
    working, most, lock = 0, 0, threading.Lock()

    def inner(_: int) -> None:
        nonlocal working, most
        with lock:
            working += 1
            most = max(most, working)
        time.sleep(1e-3)
        with lock:
            working -= 1

    each(lambda count: each(inner, range(count)), [3, 9, 1, 5, 0, 7])
    assert most == 2


def test_a_nested_call_is_helped_once_the_other_thread_has_run_out_of_work():
    def outer(long: bool) -> None:
        for _ in range(
            10000 if long else 0
        ):  # until the other thread of the outer call has nothing left
            seen = set()
            each(lambda _, seen=seen: (seen.add(threading.get_ident()), time.sleep(1e-3)), range(4))
            if len(seen) == 2:
                return
        assert not long, "found no help in 10000 calls, expected some"

    each(outer, [True, False])


@pytest.mark.parametrize("bad", [{0}, {1, 2}, {7}, {0, 1, 2, 3, 4, 5, 6, 7}])
def test_the_first_item_s_error_comes_out_and_not_all_are_begun_after_it(bad):
    begun = []

    def one(x: int) -> None:
        begun.append(x)
        time.sleep(
            0.02 if x == min(bad) else 0.01
        )  # the first one to fail is not the first in time
        if x in bad:
            raise ValueError(f"found {x}")

    with pytest.raises(ValueError, match=f"found {min(bad)}"):
        each(one, range(100))
    assert len(begun) < 100
    assert is_helped()


def test_an_interruption_of_the_caller_ends_both():
    begun, main = [], threading.get_ident()

    def one(x: int) -> None:
        begun.append(x)
        time.sleep(0.01)
        if threading.get_ident() == main:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        each(one, range(1000))
    assert len(begun) < 1000
    assert is_helped()


def test_a_thread_that_cannot_be_started_costs_no_helper(monkeypatch):
    class Full(side_by_side.ThreadPoolExecutor):
        def submit(self, *_):
            raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patched:
        patched.setattr(side_by_side, "ThreadPoolExecutor", Full)
        with pytest.raises(RuntimeError, match="start new thread"):
            each(abs, [1, 2])
    assert is_helped()

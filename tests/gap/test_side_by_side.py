"""Work on both processors: the answers are those of one, in order, however it is nested and whatever fails."""

import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.gap.side_by_side import each


@given(st.lists(st.integers(), max_size=30))
def test_answers_are_in_order(items):
    assert each(lambda x: 3 * x, items) == [3 * x for x in items]


@given(st.lists(st.lists(st.integers(), max_size=8), max_size=8))
def test_what_is_worked_on_may_ask_for_help_itself(rows):
    assert each(lambda row: each(lambda x: x + 1, row), rows) == [[x + 1 for x in row] for row in rows]


def test_two_threads_work_at_once():
    both = threading.Barrier(2, timeout=60.0)  # neither goes on before the other is there
    assert each(lambda x: both.wait() >= 0 and x, [1, 2]) == [1, 2]


def test_a_nested_call_is_helped_once_the_other_thread_has_run_out_of_work():
    both, seen = threading.Barrier(2, timeout=60.0), set()

    def outer(long: bool) -> None:
        if long:
            for _ in range(10000):  # until the helper of the outer call has gone
                seen.clear()
                each(lambda _: seen.add(threading.get_ident()) or threading.Event().wait(1e-3), range(4))
                if len(seen) == 2:
                    return
            raise AssertionError("found no help in 10000 calls, expected some")

    both.reset()
    each(outer, [True, False])


@pytest.mark.parametrize("bad", [0, 1, 2, 9])
def test_an_error_comes_out_and_nothing_is_begun_after_it(bad):
    begun = []

    def one(x: int) -> int:
        begun.append(x)
        if x == bad:
            raise ValueError(f"found {x}")
        return x

    with pytest.raises(ValueError, match=f"found {bad}"):
        each(one, range(10))
    assert max(begun) <= bad + 1  # the other thread may have had one in its hands
    assert each(lambda x: x, [1, 2, 3]) == [1, 2, 3]
    both = threading.Barrier(2, timeout=60.0)
    assert each(lambda x: both.wait() >= 0 and x, [1, 2]) == [1, 2]  # the helper is free again


def test_an_interruption_of_the_caller_ends_both():
    begun, main = [], threading.get_ident()

    def one(x: int) -> None:
        begun.append(x)
        if threading.get_ident() == main:
            raise KeyboardInterrupt
        threading.Event().wait(0.01)

    with pytest.raises(KeyboardInterrupt):
        each(one, range(1000))
    assert len(begun) < 1000

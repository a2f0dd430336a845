"""Costly tests take turns: over all turns each runs once, and what is cheap or a promise runs every
time.
"""

import json
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests import turns

FUNCTIONS = ("gap/test_a.py::test_a", "gap/test_b.py::test_b", "cli/test_c.py::test_c")
NODEIDS = [f"tests/{name}[{i}]@group" for name, i in product(FUNCTIONS, range(7))]


@given(st.integers(1, 12), st.sets(st.sampled_from(FUNCTIONS)))
def test_each_costly_test_runs_in_one_turn_and_any_other_in_each(count, costly):
    of_turn = [turns.chosen(NODEIDS, turn, count, costly) for turn in range(count)]
    for nodeid, *runs in zip(NODEIDS, *of_turn, strict=True):
        assert sum(runs) == (1 if turns.function_of(nodeid) in costly else count)


@given(st.integers(1, 7), st.integers(0, 6))
def test_a_test_with_a_parameter_for_each_turn_runs_in_each(count, turn):
    runs = turns.chosen(NODEIDS, turn % count, count, FUNCTIONS)
    ran = {turns.function_of(nodeid) for nodeid, now in zip(NODEIDS, runs, strict=True) if now}
    assert ran == set(FUNCTIONS)


def test_a_commit_has_one_turn():
    assert turns.turn_of("0000000b" + "f" * 32, 4) == 3


def test_what_waits_is_what_costs_and_as_long_as_the_time_asks():
    cheap = ("tests/gap/test_a.py::test_a@gap", 0.2)
    costly = ("tests/gap/test_b.py::test_b[0]@gap", 1e4)
    promise = ("tests/safety/test_c.py::test_c", 100.0)
    found = turns.costs([cheap, costly, promise])
    assert list(found["costly_s"]) == ["gap/test_b.py::test_b"]
    assert (found["every_time_s"], found["waiting_s"]) == (100, 10_000)
    spare_s = turns.spare_s(100.2)
    assert (found["turns"] - 1) * spare_s < 1e4 <= found["turns"] * spare_s


def test_what_runs_every_time_may_not_take_longer_than_ci():
    with pytest.raises(ValueError, match=r"found 20000 s .* expected less than"):
        turns.costs([("tests/safety/test_c.py::test_c", 2e4)])


def test_a_turn_of_the_file_fits_into_the_time_of_ci():
    """A new limit, or another list of what runs every time, asks for costs measured anew."""
    known = json.loads(turns.COSTS.read_text(encoding="utf-8"))
    assert known["waiting_s"] / known["turns"] <= turns.spare_s(known["every_time_s"])


def test_every_name_in_the_file_is_that_of_a_test():
    """A test that is renamed would run every time, and its old name wait for ever."""
    known = json.loads(turns.COSTS.read_text(encoding="utf-8"))
    assert known["turns"] >= 1
    for name in known["costly_s"]:
        file, _, function = name.partition("::")
        assert f"def {function}(" in (turns.TESTS / file).read_text(encoding="utf-8"), name
        assert turns.may_wait(name)

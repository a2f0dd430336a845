"""Costly tests take turns, so that CI ends within its time: a whole run takes every n-th of them,
and which ones follows from the commit. All others run every time.

  scripts/test.sh                            # this commit's turn
  EPA_TEST_TURN=all scripts/test.sh          # every test: before a release
  scripts/test.sh tests/gap                  # whoever names tests gets all of them
  EPA_TEST_TURN=all scripts/test.sh -p tests.processor_time --write-costs   # what is costly, anew

What is costly, and how many turns it takes, is in ``costs.json``.
"""

import json
import math
import os
import subprocess
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from zlib import crc32

import pytest

TESTS = Path(__file__).parent
COSTS = TESTS / "costs.json"
TURN, ALL = "EPA_TEST_TURN", "all"
CHOSEN = pytest.StashKey[str]()
COSTLY_S = 0.3  # of processor time, all parameters of a test together
CI_S = 15 * 60
# of that before the first test: the environment is made, and pytest collects in every process
BEFORE_TESTS_S = 200
PROCESSORS = 2
SLOWER = 1.26  # CI's time over what these sums say: costs are measured on a faster machine
# what a commit may never break, and what CI runs so that it does not rot: never waits for a turn
EVERY_TIME = (
    "benchmark/test_sealed_cases.py",
    "bus/driver/test_driver_conformance.py",
    "conformance/",
    "loop/",
    "replay/",
    "safety/",
    "test_architecture.py",
    "test_docs.py",
    "test_scripts.py::test_a_benchmark_gives_its_figures",
    "test_scripts.py::test_the_benchmark_of_the_bus_gives_its_figures",
    "test_types.py",
)
# of these: what tests the tests waits all the same
TESTS_OF_TESTS = ("safety/test_coverage.py", "safety/test_mutants.py")


def function_of(nodeid: str) -> str:
    """A test without its parameters and its group: ``gap/test_floor.py::test_it``."""
    return nodeid.partition("[")[0].partition("@")[0].removeprefix("tests/")


def may_wait(name: str) -> bool:
    """Whether a test, by ``function_of``, may wait for its turn."""
    return not name.startswith(EVERY_TIME) or name.startswith(TESTS_OF_TESTS)


def spare_s(every_time_s: float) -> float:
    """Processor time that CI has for tests that wait, s."""
    return (CI_S / SLOWER - BEFORE_TESTS_S) * PROCESSORS - every_time_s


def costs(seconds: Iterable[tuple[str, float]]) -> dict:
    """What ``costs.json`` holds: from every test's name and processor time, s."""
    of_function = defaultdict(list)
    for nodeid, one_s in seconds:
        of_function[function_of(nodeid)].append(one_s)
    together_s = {name: sum(all_s) for name, all_s in sorted(of_function.items())}
    costly_s = {
        name: round(all_s, 1)
        for name, all_s in together_s.items()
        if all_s >= COSTLY_S and may_wait(name)
    }
    waiting_s = sum(costly_s.values())
    every_time_s = sum(together_s.values()) - waiting_s
    left_s = spare_s(every_time_s)
    if left_s <= 0:
        raise ValueError(
            f"found {every_time_s:.0f} s of processor time in tests that run every time, expected"
            f" less than {spare_s(0.0):.0f} s"
        )
    return {
        "every_time_s": round(every_time_s),
        "waiting_s": round(waiting_s),
        "turns": max(1, math.ceil(waiting_s / left_s)),
        "costly_s": costly_s,
    }


def chosen(nodeids: list[str], turn: int, turns: int, costly: Iterable[str]) -> list[bool]:
    """Which of them run in turn ``turn`` of ``turns``: all that are cheap, and of each costly
    test's parameters every n-th.
    """
    costly, seen = set(costly), defaultdict(int)
    runs = []
    for nodeid in nodeids:
        name = function_of(nodeid)
        number = crc32(name.encode()) + seen[name]
        seen[name] += 1
        runs.append(name not in costly or number % turns == turn)
    return runs


def turn_of(commit: str, turns: int) -> int:
    """A commit's turn, by its hash: whoever runs a commit again runs the same tests."""
    return int(commit[:8], 16) % turns


def decide(config) -> None:
    """Whose turn it is: of this process, or what ``hand_on`` gave this process of xdist."""
    handed = getattr(config, "workerinput", {}).get(TURN)
    config.stash[CHOSEN] = handed or _turn(config)


def hand_on(node) -> None:
    """To a process of xdist, which is told no paths."""
    node.workerinput[TURN] = node.config.stash[CHOSEN]


def _turn(config) -> str:
    named = config.args_source is not type(config).ArgsSource.TESTPATHS or config.option.keyword
    if named:
        return ALL
    return os.environ.get(TURN) or str(turn_of(_commit(), _known()["turns"]))


def _known() -> dict:
    found: dict = json.loads(COSTS.read_text(encoding="utf-8"))
    return found


def _commit() -> str:
    """The hash of the commit that is checked out; zeros where there is none."""
    try:
        done = subprocess.run(
            ["git", "rev-parse", "HEAD"], cwd=TESTS, capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "0" * 8
    return done.stdout.strip()


def take_turns(config, items: list) -> None:
    """Deselects what waits for another commit."""
    if config.stash[CHOSEN] == ALL:
        return
    known = _known()
    turn = int(config.stash[CHOSEN]) % known["turns"]
    runs = chosen([item.nodeid for item in items], turn, known["turns"], known["costly_s"])
    waiting = [item for item, now in zip(items, runs, strict=True) if not now]
    if waiting:
        config.hook.pytest_deselected(items=waiting)
        items[:] = [item for item, now in zip(items, runs, strict=True) if now]


def told(config) -> str:
    """One line for whoever reads the report."""
    if config.stash[CHOSEN] == ALL:
        return "tests: all"
    turns = _known()["turns"]
    turn = int(config.stash[CHOSEN]) % turns
    return (
        f"tests: all cheap ones, and of the costly ones turn {turn + 1} of {turns}"
        f" (all: {TURN}={ALL} scripts/test.sh)"
    )

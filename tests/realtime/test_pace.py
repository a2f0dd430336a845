"""Pace on a clock of its own: no drift, missed edges skipped, lateness and busy time as they
are.
"""

import random

import pytest

from epa_rt.realtime import pace as module
from epa_rt.realtime.pace import Pace

PERIOD_NS = 1_000_000


class Clock:
    """A monotonic clock that only moves when told, and sleeps late by ``oversleep_ns``."""

    def __init__(self):
        self.now_ns, self.oversleep_ns, self.slept = 123_456_789, 0, []

    def monotonic_ns(self) -> int:
        return self.now_ns

    def sleep(self, seconds: float) -> None:
        assert seconds > 0.0
        self.slept.append(seconds)
        self.now_ns += round(seconds * 1e9) + self.oversleep_ns


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(module, "time", clock)
    return clock


def started(clock) -> Pace:
    pace = Pace(PERIOD_NS * 1e-9)
    pace.start()
    return pace


def test_edges_do_not_drift_however_late_the_wake_up(clock):
    pace, start, jitter = started(clock), clock.now_ns, random.Random(1)
    for n in range(1, 5001):
        clock.oversleep_ns = jitter.randrange(300_000)
        lateness, _ = pace.wait()
        assert clock.now_ns - lateness == start + n * PERIOD_NS
        assert lateness == clock.oversleep_ns
        clock.now_ns += jitter.randrange(600_000)  # work
        pace.mark()


def test_a_missed_edge_is_answered_at_once_and_missed_whole_ones_are_skipped(clock):
    pace, start = started(clock), clock.now_ns
    clock.now_ns = start + int(3.25 * PERIOD_NS)
    assert pace.wait()[0] == int(2.25 * PERIOD_NS) and clock.slept == []
    assert pace.wait()[0] == 0 and clock.now_ns == start + 4 * PERIOD_NS


def test_a_late_cycle_does_not_shift_those_after_it(clock):
    pace, start = started(clock), clock.now_ns
    pace.wait()
    clock.now_ns += 1_400_000
    assert pace.wait()[0] == 400_000
    assert pace.wait()[0] == 0 and clock.now_ns == start + 3 * PERIOD_NS


def test_exactly_on_the_edge_is_neither_late_nor_slept(clock):
    pace = started(clock)
    clock.now_ns += PERIOD_NS
    assert pace.wait() == (0, PERIOD_NS) and clock.slept == []


def test_waking_early_is_no_negative_jump(clock):
    pace, start = started(clock), clock.now_ns
    clock.oversleep_ns = -50
    assert pace.wait()[0] == -50
    clock.oversleep_ns = 0
    assert pace.wait()[0] == 0 and clock.now_ns == start + 2 * PERIOD_NS


def test_busy_time_counts_from_the_mark(clock):
    pace = started(clock)
    clock.now_ns += 70_000
    assert pace.wait()[1] == 70_000
    pace.mark()
    clock.now_ns += 250_000
    assert pace.wait()[1] == 250_000


@pytest.mark.parametrize("period_s", [1e-4, 1e-3, 0.0025, 1.0])
def test_the_period_is_kept_in_whole_nanoseconds(clock, period_s):
    pace, start = Pace(period_s), clock.now_ns
    pace.start()
    for n in range(1, 11):
        pace.wait()
        assert clock.now_ns == start + n * round(period_s * 1e9)

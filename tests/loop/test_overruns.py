"""When late cycles end a run: in a row as the policy says, and all the time under every policy."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.config.rig import Overrun
from epa_rt.loop.overruns import Overruns
from tests.loop.rigging import run_in_memory, tiny_inputs

PERIOD_S = 1e-3
LATE_NS = 300_000


def overruns(policy: str = "count", period_s: float = PERIOD_S, **more: object) -> Overruns:
    return Overruns(Overrun(policy=policy, **more), period_s)


def until(counted: Overruns, pattern: list[int], seconds: float, period_s: float = PERIOD_S):
    """Its answer, and the time until then; a late wake-up skips the edges that it missed."""
    t, k = 0.0, 0
    while t < seconds:
        lateness_ns = pattern[k % len(pattern)]
        if answer := counted.step(lateness_ns):
            return answer, t
        t, k = t + period_s * (1 + lateness_ns // round(period_s * 1e9)), k + 1
    return "", t


@pytest.mark.parametrize(("policy", "word"), [("count", ""), ("stop", "stop"), ("trip", "trip")])
def test_so_many_in_a_row_have_the_policys_word(policy, word):
    counted = overruns(policy, in_a_row=3)
    assert [counted.step(LATE_NS + 1) for _ in range(3)] == ["", "", word]
    assert counted.wants_stop == (word == "stop") and counted.count == 3
    assert counted.text == ("3 late cycles in a row, the last by 0.300 ms" if word else "")
    assert counted.step(LATE_NS) == "" and counted.in_a_row == 0
    assert counted.worst_ns == LATE_NS + 1


@pytest.mark.parametrize("policy", ["count", "stop", "trip"])
@pytest.mark.parametrize("period_s", [2e-3, 1e-3, 0.5e-3, 0.25e-3])
@pytest.mark.parametrize("lateness_ns", [300_001, 5_000_000])
def test_a_loop_that_is_always_late_ends_after_a_second(policy, period_s, lateness_ns):
    counted = overruns(policy, period_s, in_a_row=100_000)
    answer, after_s = until(counted, [lateness_ns], 10.0, period_s)
    assert answer == {"count": "stop", "stop": "stop", "trip": "trip"}[policy]
    assert 0.98 <= after_s <= 1.02
    assert counted.wants_stop == (answer == "stop")
    assert counted.text.startswith("this machine let the loop be late for")


@settings(deadline=None, max_examples=50)
@given(
    st.lists(st.integers(300_001, 999_999), min_size=1, max_size=20), st.integers(0, 20), st.data()
)
def test_a_machine_that_is_late_four_times_of_five_or_less_goes_on(late, more, data):
    pattern = data.draw(st.permutations([*late, *([0] * (-(-len(late) // 4) + more))]))
    counted = overruns()
    assert until(counted, list(pattern), 5.0) == ("", pytest.approx(5.0, abs=0.01))
    assert counted.count > 0 and counted.level_s <= 1.0


def test_a_stall_counts_for_as_long_as_it_took_and_is_paid_back():
    counted = overruns(late_time="100 ms", late_share=0.2)
    assert counted.step(99_000_000) == "" and counted.level_s == pytest.approx(0.1)
    for _ in range(400):
        assert counted.level_s > 0.0 and counted.step(0) == ""
    assert counted.level_s == pytest.approx(0.0, abs=1e-9)
    assert counted.step(150_000_000) == "stop"


def test_a_machine_that_stands_still_moves_no_simulated_rig(tmp_path):
    """A paced simulation moves by cycles: a stall of 14 ms is no contradiction of its sensors."""

    class Stalling:
        cycle = 0

        def start(self) -> None: ...

        def wait(self) -> tuple[int, int]:
            self.cycle += 1
            return (0 if self.cycle % 50 else 14_000_000), 0

        def mark(self) -> None: ...

    outcome = run_in_memory(tiny_inputs(tmp_path), pace=Stalling())
    assert outcome.result.outcome == "completed", outcome.result.cause
    assert outcome.result.worst_lateness_ns == 14_000_000

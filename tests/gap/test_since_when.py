"""Effects that begin, or change, within a log: found with place and size; none where none does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap.answer.named import by_log
from epa_rt.gap.answer.since_when import onset
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.likelihood.point import linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.posterior.calibrated import CALIBRATED
from tests.gap import toy

LOGS = 3
SECONDS = 40.0


def logs(sizes, column="force_n", seed=1, noise=1.0):
    """Three logs, to each of which ``sizes[i](t)`` is added in one reading."""
    made = []
    for i, size in enumerate(sizes):
        one = toy.recording(f"log_{i}", 10 * seed + i, seconds=SECONDS, noise=noise)
        one.columns[column] = one.columns[column] + size(np.arange(one.samples) / toy.RATE_HZ)
        made.append(one)
    return made


def asked(recordings, effects=(), values=None):
    subject = toy.Toy()
    problem = Problem(subject, recordings, toy.floors(subject, recordings, {}))
    return onset(problem, settled(problem, effects, values), CALIBRATED)


def nothing(t):
    return 0.0 * t


@settings(max_examples=10, deadline=None)
@given(
    log=st.integers(0, LOGS - 1),
    at_s=st.floats(4.0, SECONDS - 4.0),
    newton=st.sampled_from((-3.0, -1.5, 1.5, 3.0)),
    lasts=st.sampled_from(("log", "logs")),
)
def test_a_zero_that_jumps_is_found_with_its_place_and_its_size(log, at_s, newton, lasts):
    def size(i):
        return lambda t: (
            newton * (t >= at_s)
            if i == log
            else newton * np.ones(len(t)) * (lasts == "logs" and i > log)
        )

    found = asked(logs([size(i) for i in range(LOGS)]))
    assert found is not None
    assert (found.effect, found.on, found.log) == ("force_offset", False, f"log_{log}")
    assert abs(found.at_s - at_s) <= found.within_s
    assert found.after - found.before == pytest.approx(newton, rel=0.25)  # it lies within a block
    assert found.lasts == (lasts if log < LOGS - 1 else "log")
    assert found.explained_share > 0.9


def test_nothing_begins_where_a_fit_is_not_that_of_the_blocks_alone():
    subject, recordings = toy.Toy(), logs([nothing] * LOGS)
    problem = Problem(subject, recordings, toy.floors(subject, recordings, {}))
    knob = problem.knobs["spring.stiffness_n_m"]
    point = settled(problem).values
    off = {**point, knob.key: point[knob.key] + 2.5 * knob.spread}
    assert onset(problem, linearised(problem, (), off), CALIBRATED) is None


def test_what_is_on_changes_its_strength():
    def twice(t):
        return 0.0 * t

    recordings = logs([twice] * LOGS)
    for i, one in enumerate(recordings):
        stronger = (
            np.arange(one.samples) / toy.RATE_HZ >= 20.0 if i == 1 else np.full(one.samples, i > 1)
        )
        rubs = np.where(stronger, 3.0, 1.0)
        one.columns["force_n"] = one.columns["force_n"] + rubs * np.tanh(
            one.columns["speed_m_s"] / 0.01
        )
    found = asked(recordings, ("coulomb",), {"spring.coulomb_n": 2.0})
    assert found is not None
    assert (found.effect, found.on, found.log) == ("coulomb", True, "log_1")
    assert found.before == pytest.approx(1.0, abs=0.15)
    assert found.after == pytest.approx(3.0, abs=0.15)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(
    "size",
    (
        nothing,
        lambda t: 1.0 + 0.0 * t,  # constant: another question
        lambda t: 2.0 * np.sin(2.0 * np.pi * 0.31 * t) ** 2,  # goes with the motion
    ),
)
def test_what_is_the_same_all_along_begins_nowhere(seed, size):
    assert asked(logs([size] * LOGS, seed=seed + 2)) is None


def test_a_change_is_said_from_two_thirds_on():
    """A name that is wrong costs twice one that is missed."""
    found = [
        asked(logs([nothing, lambda t, by=by: by * (t >= 25.0), nothing]))
        for by in np.linspace(0.2, 0.5, 13)
    ]
    said = [one.probability for one in found if one is not None]
    assert 2 <= len(said) <= 10 and found[0] is None
    assert min(said) > 2.0 / 3.0


def test_a_change_in_one_log_of_many_does_not_hang_on_their_order():
    sizes = [nothing, lambda t: 1.0 * (t >= 25.0), nothing]
    recordings = logs(sizes)
    found = [asked([recordings[i] for i in order]) for order in ((0, 1, 2), (2, 1, 0), (1, 0, 2))]
    assert {(one.effect, one.log, one.at_s, one.lasts) for one in found} == {
        ("force_offset", "log_1", found[0].at_s, "log")
    }


@pytest.mark.parametrize("newton", ((1.0, 1.0, 1.0), (1.0, 1.5, 2.0)))
def test_the_strength_in_each_log_is_told(newton):
    recordings = logs([lambda t, by=by: by + 0.0 * t for by in newton])
    subject = toy.Toy()
    problem = Problem(subject, recordings, toy.floors(subject, recordings, {}))
    point = settled(problem, ("force_offset",), {"sensors.force_offset_n": 1.5})
    told = by_log(problem, point, "force_offset")
    assert [one.name for one in told] == ["log_0", "log_1", "log_2"]
    for one, true in zip(told, newton, strict=True):
        assert one.value == pytest.approx(true, abs=0.08)  # the pressure's area takes a part of it
        assert one.low < one.value < one.high < one.value + 0.1
    apart = told[0].high < told[2].low
    assert apart == (newton[0] != newton[2])


def test_one_log_has_no_strength_by_log():
    subject, recordings = toy.Toy(), logs([nothing])
    problem = Problem(subject, recordings, toy.floors(subject, recordings, {}))
    assert by_log(problem, settled(problem, ("coulomb",)), "coulomb") == ()


def test_the_answer_says_since_when():
    recordings = logs([nothing, lambda t: 1.0 * (t >= 20.0), lambda t: 1.0 + 0.0 * t])
    told = diagnose(toy.Toy(), recordings, floors=toy.floors, how_far=False)
    assert told.onset is not None
    assert told.onset.effect == "force_offset"
    assert "at about 20 s of log_1" in told.says
    assert told.as_json()["onset"]["log"] == "log_1"


def test_what_begins_beside_a_law_is_told_though_nothing_is_named():
    """Of friction and a zero that jumps neither explains much without the other."""
    recordings = logs([nothing, lambda t: 3.0 * (t >= 20.0), lambda t: 3.0 + 0.0 * t])
    for one in recordings:
        rubs = np.tanh(one.columns["speed_m_s"] / 0.01)
        one.columns["force_n"] = one.columns["force_n"] + 3.0 * rubs
    told = diagnose(toy.Toy(), recordings, floors=toy.floors, how_far=False)
    assert told.onset is not None
    assert (told.onset.effect, told.onset.log) == ("force_offset", "log_1")
    assert told.onset.at_s == pytest.approx(20.0, abs=told.onset.within_s)

"""Of several effects free run keeps those that it needs, and puts the one that is missed most
first.
"""

from types import SimpleNamespace

import pytest

from epa_rt.gap.as_one import AsOne, fitted, floor, meters_of, twins_of
from epa_rt.gap.fewer import fewer
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled
from epa_rt.gap.rules import Rules
from epa_rt.gap.select import Selection
from tests.gap import toy
from tests.gap.test_in_free_run import Chained, logs

DELAY, OFFSET = {"gas.delay_s": 0.02}, {"sensors.pressure_offset_pa": -1000.0}


def left_of(hidden, named):
    """What ``fewer`` keeps of ``named`` where ``hidden`` is true: names, and those of the fit in
    free run.
    """
    subject, recordings = Chained(), logs(hidden)
    problem = Problem(subject, recordings, toy.floors(subject, recordings, {}))
    meters = meters_of(recordings, twins_of(subject, recordings, {}))
    whole = Problem(AsOne(subject, meters), recordings, floor())
    base, final = settled(problem), settled(problem, named, hidden)
    roles = tuple(SimpleNamespace(best=SimpleNamespace(effect=name)) for name in named)
    selection, best = fewer(
        problem,
        whole,
        Selection(problem, base, roles, final, None),
        fitted(whole, named, hidden),
        Rules(),
    )
    assert set(selection.final.effects) == set(best.effects)
    return [role.best.effect for role in selection.roles], best


@pytest.mark.parametrize(
    "named", [("valve_delay", "force_offset"), ("force_offset", "valve_delay")]
)
def test_what_the_whole_plant_does_not_need_is_dropped(named):
    kept, best = left_of(DELAY, named)
    assert kept == ["valve_delay"]
    assert best.values["gas.delay_s"] == pytest.approx(0.02, abs=0.003)


@pytest.mark.parametrize(
    "named", [("valve_delay", "pressure_offset"), ("pressure_offset", "valve_delay")]
)
def test_what_it_needs_stays_and_the_one_that_is_missed_most_comes_first(named):
    kept, best = left_of(DELAY | OFFSET, named)
    without = {name: fitted_without(name) for name in named}
    assert kept == sorted(named, key=lambda name: -without[name])


def fitted_without(name):
    """Chi-square in free run with the other effect alone."""
    hidden = DELAY | OFFSET
    subject, recordings = Chained(), logs(hidden)
    whole = Problem(
        AsOne(subject, meters_of(recordings, twins_of(subject, recordings, {}))),
        recordings,
        floor(),
    )
    other = "valve_delay" if name == "pressure_offset" else "pressure_offset"
    return fitted(
        whole, (other,), {k: v for k, v in hidden.items() if k in whole.effects[other].knobs}
    ).normal.chi


def test_one_effect_stays_whatever_it_is_worth():
    assert left_of({}, ("force_offset",))[0] == ["force_offset"]


@pytest.mark.parametrize(
    ("little", "kept"), [((), ["b"]), (("a",), ["a"]), (("a", "b"), ["b", "a"])]
)
def test_each_effect_is_held_to_what_was_enough_of_it(monkeypatch, little, kept):
    """Without a 30 are lost, without b 35: neither is enough by itself; of what was found to be all
    that is missing 25 are.
    """
    lost = {"a": 30.0, "b": 35.0}

    def point(names):
        return SimpleNamespace(
            effects=names,
            normal=SimpleNamespace(
                chi=100.0 + sum(lost[name] for name in lost if name not in names)
            ),
        )

    monkeypatch.setattr(
        "epa_rt.gap.fewer._without",
        lambda whole, best, effect: point(tuple(name for name in best.effects if name != effect)),
    )
    monkeypatch.setattr(
        "epa_rt.gap.fewer.settled_with",
        lambda problem, effects, values: SimpleNamespace(effects=effects, values=values),
    )
    roles = tuple(SimpleNamespace(best=SimpleNamespace(effect=name)) for name in lost)
    chosen = Selection(None, None, roles, SimpleNamespace(effects=("a", "b"), values={}), None)
    selection, _ = fewer(None, None, chosen, point(("a", "b")), Rules(), little)
    assert [role.best.effect for role in selection.roles] == kept

"""What one more effect must do in free run to be named: enough, or all that is missing with nothing
else near it, and enough to act upon or all of a gap.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from epa_rt.gap.attribution import at_base
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.further import _relieves, _unworthy
from epa_rt.gap.point import Point
from epa_rt.gap.rules import Rules
from epa_rt.models.effect import Effect
from tests.gap import toy
from tests.gap.test_in_free_run import Chained, logs, without_gas

FAINT_SECOND = {
    "sensors.pressure_offset_pa": -1000.0,
    "gas.delay_s": 0.0014,
}  # the first alone leaves 36 of 501


def told(subject):
    return diagnose(subject, logs(FAINT_SECOND), floors=without_gas, how_far=False)


def test_a_second_effect_that_takes_the_plant_to_the_noise_is_named_though_it_is_little():
    answer = told(Chained())
    assert [one.name for one in answer.effects] == ["pressure_offset", "valve_delay"]
    assert answer.free_run.left < 5.0


def with_a_twin_of_the_delay() -> Chained:
    """The chain with a law of another family that does just what the valve's delay does."""
    subject = Chained()
    delay: Effect = next(effect for effect in toy.CATALOGUE if effect.name == "valve_delay")
    subject.catalogue = (*subject.catalogue, delay._replace(name="slow_valve", family="slow valve"))
    return subject


def test_not_where_another_law_does_as_much():
    answer = told(with_a_twin_of_the_delay())
    assert answer.verdict == "not_in_catalogue" and "chi-square of 36 of 501" in answer.says


def test_not_in_the_same_block():
    """What mends another one's formula is mostly of its block."""
    subject = Chained()
    subject.catalogue = tuple(
        effect._replace(block="sensors") if effect.name == "valve_delay" else effect
        for effect in subject.catalogue
    )
    assert told(subject).verdict == "not_in_catalogue"


FAINT = {"gas.delay_s": 0.0012}  # free run shows 31, and no block a gap


def test_what_is_all_of_a_faint_gap_is_named_and_nothing_where_rigs_without_a_gap_show_as_much():
    found = diagnose(Chained(), logs(FAINT), floors=without_gas, how_far=False)
    assert [one.name for one in found.effects] == [
        "valve_delay"
    ] and 25.0 < found.free_run.gap < 40.0
    assert (
        diagnose(
            Chained(), logs({"gas.delay_s": 0.0009}), floors=without_gas, how_far=False
        ).verdict
        == "no_gap"
    )


def test_of_a_faint_gap_all_that_do_half_as_much_cannot_be_told_apart():
    answer = diagnose(with_a_twin_of_the_delay(), logs(FAINT), floors=without_gas, how_far=False)
    assert answer.verdict == "not_separable" and {"valve_delay", "slow_valve"} == {
        answer.effects[0].name,
        *answer.effects[0].not_separable_from,
    }


@pytest.mark.parametrize(
    ("named", "missing", "gain", "unworthy"),
    [
        (0, 115.0, 114.0, False),  # all of what the whole plant shows
        (0, 115.0, 90.0, True),  # a part of it
        (0, 90.0, 89.0, True),  # of what is no gap by itself
        (1, 115.0, 114.0, True),  # beside another one
        (0, 1200.0, 1010.0, False),  # plain
    ],
)
def test_what_nobody_would_act_on_is_named_where_it_is_all_of_a_gap(named, missing, gain, unworthy):
    problem, _, _ = at_base(Chained(), logs({}), floors=without_gas)
    point = SimpleNamespace(
        values={"sensors.pressure_offset_pa": 100.0}
    )  # a thirtieth of a typical one
    found = _unworthy(
        problem,
        SimpleNamespace(roles=named * (None,)),
        "pressure_offset",
        point,
        gain,
        missing,
        Rules(),
    )
    assert found is unworthy
    strong = replace(Rules(), plain=0.0)
    assert not _unworthy(
        problem, SimpleNamespace(roles=()), "pressure_offset", point, gain, missing, strong
    )


def left(chi: float, strained: float = 0.0) -> Point:
    """A point that leaves so much, of which nominal parameters cost ``strained``."""
    return SimpleNamespace(
        normal=SimpleNamespace(chi=chi, prior=np.ones(1), z=np.full(1, np.sqrt(strained)))
    )


@pytest.mark.parametrize(
    ("left_over", "instead", "takes"),
    [
        (513.0, 92.0, True),  # slip elements for a Preisach braid
        (513.0, 260.0, False),  # more than half of it: neither is right
        (40.0, 16.0, False),  # too little to look for anything
    ],
)
def test_a_law_takes_its_kins_place_where_that_leaves_less_than_half(left_over, instead, takes):
    assert (
        Rules().in_its_place(left(1000.0 + left_over), left(1000.0 + instead), noise=1000.0)
        is takes
    )


@pytest.mark.parametrize(
    ("before", "after", "relieves"),
    [
        ((92.0, 50.0), (48.0, 8.0), True),
        ((92.0, 50.0), (56.0, 8.0), False),  # that little says nothing
        ((92.0, 30.0), (48.0, 8.0), False),  # they were believable
        ((92.0, 50.0), (48.0, 30.0), False),  # they still cost much
        ((46.0, 45.0), (9.0, 8.0), True),  # nothing else is left
        ((46.0, 45.0), (24.0, 8.0), False),  # that may be chance
        ((60.0, 45.0), (30.0, 8.0), False),  # something else is, and it is little for that
    ],
)
def test_an_effect_counts_that_makes_nominal_parameters_believable(before, after, relieves):
    best, point = left(*before), left(*after)
    assert _relieves(best, point, best.normal.chi - point.normal.chi, 0.0, Rules()) is relieves

"""What one more effect must do in free run to be named: enough, or all that is missing with nothing else near it, and enough to act upon or all of a gap."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from epa_rt.gap.attribution import at_base
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.further import _unworthy
from epa_rt.gap.rules import Rules
from epa_rt.models.effect import Effect
from tests.gap import toy
from tests.gap.test_in_free_run import Chained, logs, without_gas

FAINT_SECOND = {"sensors.pressure_offset_pa": -1000.0, "gas.delay_s": 0.0014}  # the first alone leaves 36 of 501


def told(subject):
    return diagnose(subject, logs(FAINT_SECOND), floors=without_gas, how_far=False)


def test_a_second_effect_that_takes_the_plant_to_the_noise_is_named_though_it_is_little():
    answer = told(Chained())
    assert [one.name for one in answer.effects] == ["pressure_offset", "valve_delay"]
    assert answer.free_run.left < 5.0


def test_not_where_another_law_does_as_much():
    subject = Chained()
    delay: Effect = next(effect for effect in toy.CATALOGUE if effect.name == "valve_delay")
    subject.catalogue = (*subject.catalogue, delay._replace(name="slow_valve", family="slow valve"))
    answer = told(subject)
    assert answer.verdict == "not_in_catalogue" and "chi-square of 36 of 501" in answer.says


def test_not_in_the_same_block():
    """What mends another one's formula is mostly of its block."""
    subject = Chained()
    subject.catalogue = tuple(effect._replace(block="sensors") if effect.name == "valve_delay" else effect for effect in subject.catalogue)
    assert told(subject).verdict == "not_in_catalogue"


@pytest.mark.parametrize(("named", "missing", "gain", "unworthy"), [
    (0, 115.0, 114.0, False),    # all of what the whole plant shows
    (0, 115.0, 90.0, True),      # a part of it
    (0, 90.0, 89.0, True),       # of what is no gap by itself
    (1, 115.0, 114.0, True),     # beside another one
    (0, 1200.0, 1010.0, False),  # plain
])
def test_what_nobody_would_act_on_is_named_where_it_is_all_of_a_gap(named, missing, gain, unworthy):
    problem, _, _ = at_base(Chained(), logs({}), floors=without_gas)
    point = SimpleNamespace(values={"sensors.pressure_offset_pa": 100.0})  # a thirtieth of a typical one
    found = _unworthy(problem, SimpleNamespace(roles=named * (None,)), "pressure_offset", point, gain, missing, Rules())
    assert found is unworthy
    strong = replace(Rules(), plain=0.0)
    assert not _unworthy(problem, SimpleNamespace(roles=()), "pressure_offset", point, gain, missing, strong)

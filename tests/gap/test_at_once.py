"""Two effects at once: a law that looks like both comes first when they are chosen one after the
other, and no single swap leads back.
"""

from collections.abc import Mapping

import numpy as np
import pytest

from epa_rt.gap.at_once import best_pair
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.refit import settled
from epa_rt.gap.role import Role, played
from epa_rt.gap.subject import Link
from epa_rt.models.effect import Effect, Knob
from tests.gap.one_link import OneLink, problem_of

TIME = np.arange(3000) / 100.0
A, B, C = np.sin(TIME), np.sin(2.3 * TIME), np.sin(5.1 * TIME)
WAVES = {"both": A + B + 0.1 * C, "rest": A - B + 0.3 * C, "one": A, "other": B, "far": C}


def knob_of(name: str) -> str:
    return f"joint.{name}_rad"


class Joint(OneLink):
    """An angle, and effects that are sums of one another but for a little."""

    name = "joint"
    links = (Link("joint", "joint", "angle_rad", "rad", "time to angle"),)
    nominal = (Knob("joint.zero_rad", "rad", 0.0, -1.0, 1.0, 0.01),)
    catalogue = tuple(
        Effect(name, name, "joint", (knob_of(name),), ((0.1,),), "a wave", "", "") for name in WAVES
    )
    knobs = {
        knob.key: knob
        for knob in (
            *nominal,
            *(Knob(knob_of(name), "rad", 0.0, -5.0, 5.0, 0.1, name) for name in WAVES),
        )
    }

    def residual(self, prepared: Recording, values: Mapping[str, float], link: str) -> np.ndarray:
        return (
            prepared.columns["angle_rad"]
            - values.get("joint.zero_rad", 0.0)
            - sum(values.get(knob_of(name), 0.0) * wave for name, wave in WAVES.items())
        )


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(Joint(), {knob_of("one"): 0.5, knob_of("other"): 0.4}, len(TIME), 0.01)


@pytest.fixture(scope="module")
def roles(problem) -> list[Role]:
    first = played(problem, settled(problem))
    assert first.best.effect == "both"
    return [first, played(problem, settled(problem, ("both",), first.best.values))]


def test_a_pair_that_leaves_far_less_takes_the_place_of_two_chosen_one_after_the_other(
    problem, roles
):
    found = best_pair(problem, roles[0], roles, settled(problem, ("both", "rest")))
    assert set(found.effects) == {"one", "other"}
    assert found.values[knob_of("one")] == pytest.approx(0.5, abs=0.005)


def test_no_pair_takes_the_place_of_two_that_leave_the_noise(problem, roles):
    assert best_pair(problem, roles[0], roles, settled(problem, ("one", "other"))) is None


def test_one_name_is_left_alone(problem, roles):
    assert best_pair(problem, roles[0], roles[:1], settled(problem, ("both",))) is None

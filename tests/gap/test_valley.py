"""What imitates an effect in its full strength: a load's mass and lever hide what it carries, and a
fit has to find the way back.
"""

from collections.abc import Mapping

import numpy as np
import pytest

from epa_rt.gap.likelihood import refit as room
from epa_rt.gap.likelihood.point import linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import refit, searched, settled
from epa_rt.gap.likelihood.screen import scaled, screen
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Link
from epa_rt.models.effect import Effect, Knob
from tests.gap.one_link import OneLink, problem_of

MASS, LEVER, CARRIED = "load.mass_kg", "load.lever_m", "load.payload_kg"
TRUE = {CARRIED: 0.4}
ANGLE = np.sin(np.arange(3000) / 150.0)


class Pendulum(OneLink):
    """The torque of a weight on a lever: mass and lever are only seen as a product, and that very
    sharply.
    """

    name = "pendulum"
    links = (Link("load", "load", "torque_nm", "N*m", "angle to torque"),)
    nominal = (Knob(MASS, "kg", 1.34, 0.1, 5.0, 0.027), Knob(LEVER, "m", 0.19, 0.05, 0.5, 0.0038))
    catalogue = (
        Effect("payload", "payload", "load", (CARRIED,), ((0.1,),), "carries something", "", ""),
        Effect("drag", "drag", "load", ("load.drag_nm",), ((0.1,),), "something else", "", ""),
    )
    knobs = {
        knob.key: knob
        for knob in (
            *nominal,
            Knob(CARRIED, "kg", 0.0, -10.0, 10.0, 0.1, "payload"),
            Knob("load.drag_nm", "N*m", 0.0, -1.0, 1.0, 0.1, "drag"),
        )
    }

    def residual(self, prepared: Recording, values: Mapping[str, float], link: str) -> np.ndarray:
        at = {key: values.get(key, knob.value) for key, knob in self.knobs.items()}
        torque = (at[MASS] + at[CARRIED]) * 9.81 * at[LEVER] * ANGLE + at["load.drag_nm"] * np.sign(
            np.gradient(ANGLE)
        )
        return prepared.columns["torque_nm"] - torque


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(Pendulum(), TRUE, 3000, 1e-3)


@pytest.fixture(scope="module")
def hidden(problem):
    found = settled(problem)
    assert (
        np.max(np.abs(found.normal.z)) > 5.0 and float(np.sum(found.normal.z**2)) > 60.0
    )  # mass and lever share it
    return found


def test_derivatives_show_what_nominal_parameters_hide_and_full_strength_does_not(problem, hidden):
    gain = {s.effect: s.gain for s in screen(problem, hidden, part=1e-3).signatures}
    assert gain["payload"] > 0.5 * float(np.sum(hidden.normal.z**2)) > 10.0 * gain["drag"]


def test_a_step_is_bent_along_the_valley(problem, hidden):
    begun = refit(problem, hidden, "payload", scaled(problem, "payload", {CARRIED: 0.1}, 0.05))
    found = settled(problem, ("payload",), begun.values)
    assert found.values[CARRIED] == pytest.approx(0.4, abs=0.03)
    assert float(np.sum((found.normal.z * found.normal.prior) ** 2)) < 1.0


def test_a_bent_step_gets_further_than_any_straight_one(problem, hidden, monkeypatch):
    start = linearised(
        problem, ("payload",), {**hidden.values, CARRIED: 0.005, MASS: hidden.values[MASS] - 0.005}
    )

    def fallen() -> float:
        return (
            start.normal.chi
            - linearised(problem, ("payload",), searched(problem, start, light=True)).normal.chi
        )

    bent = fallen()
    monkeypatch.setattr(room, "bent", lambda *a, **k: 0.0)
    assert bent > 3.0 * fallen()

"""A law whose numbers an early fit had led astray gets the better ones as soon as they are found,
and what had mended it is asked again.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap import select
from epa_rt.gap.problem import Problem
from epa_rt.gap.recording import Recording
from epa_rt.gap.refit import settled
from epa_rt.gap.role import played
from epa_rt.gap.select import _again, _tried_again
from epa_rt.gap.subject import Link
from epa_rt.models.effect import Effect, Knob
from tests.gap.one_link import OneLink, problem_of

TIME = np.arange(3000) / 100.0
SIZE, RATE, MEND = "joint.wave_rad", "joint.rate_rad_s", "joint.mend_rad"
TRUE, ASTRAY = {SIZE: 0.5, RATE: 2.3}, {SIZE: 0.1, RATE: 3.4, MEND: 0.05}


class Joint(OneLink):
    """An angle with a wave of unknown rate, whose chi-square has many valleys, and another wave
    that takes off a little in a wrong one.
    """

    name = "joint"
    links = (Link("joint", "joint", "angle_rad", "rad", "time to angle"),)
    nominal = (Knob("joint.zero_rad", "rad", 0.0, -1.0, 1.0, 0.01),)
    catalogue = (
        Effect("wave", "wave", "joint", (SIZE, RATE), ((0.1, 3.4), (0.1, 2.25)), "a wave", "", ""),
        Effect("mend", "mend", "joint", (MEND,), ((0.1,),), "a wave of one rate", "", ""),
    )
    knobs = {
        knob.key: knob
        for knob in (
            *nominal,
            Knob(SIZE, "rad", 0.0, -5.0, 5.0, 0.1, "wave"),
            Knob(RATE, "rad/s", 2.0, 0.5, 8.0, 0.05, "wave"),
            Knob(MEND, "rad", 0.0, -5.0, 5.0, 0.1, "mend"),
        )
    }

    def residual(self, prepared: Recording, values: Mapping[str, float], link: str) -> np.ndarray:
        wave = values.get(SIZE, 0.0) * np.sin(values.get(RATE, 2.0) * TIME) + values.get(
            MEND, 0.0
        ) * np.sin(2.36 * TIME)
        return prepared.columns["angle_rad"] - values.get("joint.zero_rad", 0.0) - wave


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(Joint(), TRUE, len(TIME), 0.01)


def test_better_numbers_of_the_same_law_take_the_place_of_those_that_were_led_astray(problem):
    astray = settled(problem, ("wave", "mend"), ASTRAY)
    assert astray.values[RATE] > 3.0
    roles, final = _tried_again(problem, [], astray, 1)
    assert final.effects == astray.effects and final.normal.chi < astray.normal.chi - 1000.0
    assert final.values[RATE] == pytest.approx(2.3, abs=0.005) and abs(final.values[MEND]) < 0.02
    assert (
        len(roles) == 2 and roles[1].best.effect == "mend"
    )  # asked again with the others where they are now
    assert roles[1].gains[0].sum() < 25.0


def test_no_role_is_played_worse_than_what_stands(problem):
    final = settled(problem, ("wave", "mend"), TRUE)
    assert _again(problem, final, 0).best.chi < final.normal.chi + 1.0
    without = settled(problem, ("mend",), {})
    assert played(problem, without, also={"wave": {SIZE: 0.45, RATE: 2.32}}).best.values[
        RATE
    ] == pytest.approx(2.3, abs=0.005)


def test_what_stands_well_stays(problem):
    final = settled(problem, ("wave", "mend"), TRUE)
    roles, after = _tried_again(problem, [], final, 2)
    assert after is final and [role.best.effect for role in roles] == ["wave", "mend"]


def test_what_a_refit_promises_and_does_not_keep_changes_nothing(problem, monkeypatch):
    """A refit takes links that its law does not touch for straight, so that its chi-square is a
    promise.
    """
    final, asked, again = settled(problem, ("wave", "mend"), TRUE), [], _again

    def promising(problem, final, i):
        asked.append(i)
        role = again(problem, final, i)
        return replace(role, fits=(replace(role.best, chi=0.5 * role.best.chi), *role.fits[1:]))

    monkeypatch.setattr(select, "_again", promising)
    roles, after = _tried_again(problem, [], final, 2)
    assert after is final and asked == [0, 1] and len(roles) == 2

"""A law that was chosen when it had two effects to explain is tried again with the other one on."""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.as_one import fitted
from epa_rt.gap.further import with_effect
from epa_rt.gap.problem import Problem
from epa_rt.gap.rules import Rules, above
from epa_rt.gap.select import Selection
from epa_rt.gap.swapped import swapped
from tests.gap.one_link import problem_of
from tests.gap.test_promising import TIME, Sum, knob_of

NOISE = float(len(TIME))


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(Sum(), {knob_of("drift"): 0.1, knob_of("quick"): 0.3}, len(TIME), 0.01)


def named(problem: Problem, *laws: str):
    """A selection of laws as free run has them, and the fits without any and with all."""
    none = fitted(problem, (), {})
    best = fitted(problem, laws, {knob_of(law): 0.1 for law in laws})
    selection = Selection(problem, none, (), none, None)
    for law in laws:
        selection = with_effect(problem, selection, law, best)
    return selection, none, best


def test_the_wrong_one_of_two_laws_makes_place_for_the_right_one(problem):
    selection, none, best = named(problem, "square", "quick")
    assert 100.0 < above(best, NOISE) < 0.25 * above(none, NOISE)
    found, point, as_well = swapped(problem, problem, selection, none, best, NOISE, Rules())
    assert (
        set(found.final.effects)
        == {"drift", "quick"}
        == {role.best.effect for role in found.roles}
        == set(point.effects)
    )
    assert point.values[knob_of("drift")] == pytest.approx(0.1, abs=0.01) and above(
        point, NOISE
    ) < 3.0 * np.sqrt(2.0 * NOISE)
    assert as_well == {"drift": ()}


def test_two_right_laws_stay_and_so_does_one_alone(problem):
    for laws in (("drift", "quick"), ("drift",)):
        selection, none, best = named(problem, *laws)
        assert swapped(problem, problem, selection, none, best, NOISE, Rules()) is None


def test_what_takes_a_part_of_what_is_left_takes_no_ones_place():
    """Of three waves that are there the two stronger ones leave a little less than those named
    do.
    """
    problem = problem_of(
        Sum(),
        {knob_of("square"): 0.2, knob_of("quick"): 1.0, knob_of("slow"): 0.3},
        len(TIME),
        0.01,
    )
    selection, none, best = named(problem, "square", "quick")
    assert (
        1000.0 < above(best, NOISE) < 0.25 * above(none, NOISE)
        and swapped(problem, problem, selection, none, best, NOISE, Rules()) is None
    )


def test_where_both_together_explain_little_none_is_tried(problem):
    selection, none, best = named(problem, "square", "shaped")
    assert (
        above(best, NOISE) > 0.25 * above(none, NOISE)
        and swapped(problem, problem, selection, none, best, NOISE, Rules()) is None
    )


def test_the_law_that_stays_keeps_what_the_blocks_came_near_to(problem):
    """Of the blocks' own selection, whose first role has several fits."""
    selection, none, best = named(problem, "quick", "square")
    first = selection.roles[0]
    rival = replace(first.best, effect="shaped")
    selection = replace(
        selection,
        roles=(
            replace(
                first, fits=(first.best, rival), gains=np.vstack([first.gains, 0.5 * first.gains])
            ),
            selection.roles[1],
        ),
    )
    found, point, _ = swapped(problem, problem, selection, none, best, NOISE, Rules())
    kept = next(role for role in found.roles if role.best.effect == "quick")
    assert [fit.effect for fit in kept.fits] == ["quick", "shaped"] and kept.gains.shape[0] == 2
    assert kept.best.values[knob_of("quick")] == pytest.approx(
        point.values[knob_of("quick")], rel=0.05
    )

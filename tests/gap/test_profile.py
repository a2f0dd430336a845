"""Intervals of numbers that a fit is not straight in: of a run-in whose way is not seen to its end,
of a number on its bound.
"""

from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from epa_rt.gap.likelihood.intervals import intervals
from epa_rt.gap.likelihood.point import linearised
from epa_rt.gap.likelihood.profile import NEAR, profiled, reached
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Link
from epa_rt.models.effect import Effect, Knob
from tests.gap.one_link import OneLink, problem_of

RATIO, WAY = "muscle.run_in_ratio", "muscle.run_in_m"
SEEN_M, NOISE, SAMPLES = 2.0, 0.05, 2000
AT_M = np.linspace(0.0, SEEN_M, SAMPLES)


class Braid(OneLink):
    """A force that falls by a part over a way: where the way is longer than what was gone, only how
    steeply it falls is seen.
    """

    name = "braid"
    links = (Link("muscle", "muscle", "force_n", "N", "way to force"),)
    nominal = (Knob("muscle.force_n", "N", 5.0, 1.0, 20.0, 0.1),)
    catalogue = (
        Effect("run_in", "braid", "muscle", (RATIO, WAY), ((0.1, 2.0),), "runs in", "", ""),
    )
    knobs = {
        knob.key: knob
        for knob in (
            *nominal,
            Knob(RATIO, "1", 0.0, -5.0, 5.0, 0.1, "run_in"),
            Knob(WAY, "m", 2.0, 0.01, 100.0, 1.0, "run_in"),
        )
    }

    def residual(self, prepared: Recording, values: Mapping[str, float], link: str) -> np.ndarray:
        at = {key: values.get(key, knob.value) for key, knob in self.knobs.items()}
        return prepared.columns["force_n"] - at["muscle.force_n"] * (
            1.0 - at[RATIO] * (1.0 - np.exp(-AT_M / max(at[WAY], 1e-3)))
        )


def found_of(true: Mapping[str, float], seed: int, moved: Mapping[str, float] | None = None):
    """The numbers, their straight half widths and their searched ends; ``moved``: to where
    something else than these logs has put them.
    """
    problem = problem_of(Braid(), true, SAMPLES, NOISE, seed)
    final = settled(problem, ("run_in",), {RATIO: 0.1, WAY: 2.0})
    final = linearised(problem, ("run_in",), {**final.values, **moved}) if moved else final
    width = intervals(final.normal, (RATIO, WAY))
    return (
        final.values,
        {key: half * problem.spread(key) for key, half in width.items()},
        profiled(problem, final, "run_in", width),
    )


def test_a_way_that_was_not_gone_to_its_end_may_be_any_longer():
    """Only the slope is seen: ratio and way may grow together up to their bounds, and neither may
    be next to nothing.
    """
    _, _, ends = found_of({RATIO: 0.5, WAY: 30.0}, 1)
    assert ends[WAY][1] == 100.0 and 2.0 < ends[WAY][0] < 30.0
    assert 0.02 < ends[RATIO][0] < 0.5 < ends[RATIO][1]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_an_end_on_this_side_of_zero_is_found_though_the_bound_lies_beyond_it(seed):
    """The straight interval reaches to the bound, where the other number must be elsewhere
    altogether; a valley's low end is to be found on the way back.
    """
    _, _, ends = found_of({RATIO: 0.5, WAY: 30.0}, seed, {RATIO: 1.4, WAY: 84.0})
    assert 0.02 < ends[RATIO][0] < 0.5


def test_numbers_that_are_seen_well_keep_their_straight_interval():
    values, straight, ends = found_of({RATIO: 0.5, WAY: 0.5}, 1)
    assert not ends and abs(values[WAY] - 0.5) < straight[WAY] < 0.05


def test_the_ends_hold_the_truth():
    """38 of 40 are to be expected."""
    held = 0
    for seed in range(40):
        values, straight, ends = found_of({RATIO: 0.2, WAY: 4.0}, seed)
        low, high = ends.get(WAY, (values[WAY] - straight[WAY], values[WAY] + straight[WAY]))
        held += low <= 4.0 <= high
    assert held >= 35


@pytest.mark.parametrize("way", [8.0, 12.0])
def test_ends_do_not_close_in_on_a_number_that_free_run_has_put_elsewhere(way):
    """These logs alone would have it at 3.5."""
    _, _, ends = found_of({RATIO: 0.2, WAY: 4.0}, 1, {WAY: way})
    assert ends[WAY][0] < 4.0 and ends[WAY][1] > 1.5 * way


@example(1.0, 3.0, 2.0078125)
@given(st.floats(0.05, 20.0), st.floats(0.01, 30.0), st.floats(1.0, 50.0))
def test_an_end_is_found_from_too_near_and_from_too_far(true, begun, bound):
    """Of a parabola whose end is known, to the part of its distance at which the search leaves
    off.
    """

    def costs(value: float) -> float:
        return 3.84 * (value / true) ** 2

    begun = min(begun, bound)
    end = reached(costs, 0.0, begun, bound, 3.84)
    if true >= bound:
        assert end == pytest.approx(bound, rel=1e-12)
    elif true > begun * 0.5**5:
        assert end == pytest.approx(true, rel=NEAR)
    assert 0.0 < end <= bound * (1.0 + 1e-12)


@given(st.floats(1e5, 3e6), st.floats(30.0, 1400.0))
def test_an_end_is_found_along_a_valley_that_steepens(strength, begun):
    """A time of which short logs show little more than its inverse: towards short ones what it
    costs climbs ever faster.
    """

    def costs(time_s: float) -> float:
        return strength * (1.0 / time_s - 1.0 / 1441.0) ** 2

    end = reached(costs, 1441.0, begun, 10.0, 3.84)
    assert 0.8 * 3.84 < costs(end) < 1.25 * 3.84

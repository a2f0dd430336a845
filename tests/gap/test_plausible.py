"""Nominal parameters that nobody believes hide a gap; held to what a plant file may be wrong by,
they show where it is.
"""

from types import SimpleNamespace as Thing

import numpy as np
import pytest

from epa_rt.gap.localise import localise
from epa_rt.gap.plausible import absorbed, beyond_belief, beyond_belief_together, within_belief
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled
from tests.gap import toy


def held_against(true):
    """Problem and nominal refit of a log whose nominal parameters are elsewhere."""
    subject, recordings = toy.Toy(), [toy.recording("log", 1, true)]
    problem = Problem(subject, recordings, toy.floors(subject, recordings, {}))
    return problem, settled(problem)


def test_what_a_nominal_parameter_hid_shows_in_its_own_link():
    problem, base = held_against({"gas.loss_per_s": 1.6})
    assert beyond_belief(base.normal) == ("gas.loss_per_s",)
    assert absorbed(base.normal, ("gas.loss_per_s",)) > 1e4
    point = within_belief(problem, base, ("gas.loss_per_s",))
    assert point.values["gas.loss_per_s"] == pytest.approx(0.8 * (1.0 + 3 * 0.05))
    places = localise(problem.subject, problem.prepared, point.values, problem.floors)
    assert places[0].block == "gas" and places[0].significance > 100.0
    assert max(abs(place.significance) for place in places[1:]) < 5.0


def test_the_others_stay_free():
    problem, base = held_against({"gas.loss_per_s": 1.6, "spring.stiffness_n_m": 1000.0})
    point = within_belief(problem, base, ("gas.loss_per_s",))
    assert point.values["spring.stiffness_n_m"] == pytest.approx(1000.0, rel=0.01)


def test_a_parameter_within_belief_stays_where_it_is():
    problem, base = held_against({"gas.loss_per_s": 0.84})
    assert beyond_belief(base.normal) == ()
    point = within_belief(problem, base, ("gas.loss_per_s",))
    assert np.isclose(point.values["gas.loss_per_s"], base.values["gas.loss_per_s"], rtol=1e-3)


@pytest.mark.parametrize(
    ("z", "named"),
    [
        ((4.9, 7.1, 7.1), "cba"),
        ((9.3, 0.0, 0.0), ""),
        ((4.0, 3.5, 6.0), ""),
        ((2.9, 11.0, 2.9), ""),
        ((-8.0, 8.1, 1.0), "ba"),
    ],
)
def test_what_no_plant_file_has_wrong_all_at_once_is_not_believed(z, named):
    """A shank's mass, inertia and lever for a weight on it; a sensor's lag by itself."""
    normal = Thing(keys=("a", "b", "c"), z=np.array(z), prior=np.ones(3))
    assert "".join(beyond_belief_together(normal)) == named
    assert not beyond_belief_together(
        Thing(keys=("a", "b"), z=np.array([20.0, 30.0]), prior=np.zeros(2))
    )

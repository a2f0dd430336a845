"""What the logs could not have shown is not said to explain nothing."""

import pytest

from epa_rt.gap.problem import Problem
from epa_rt.gap.unshown import could_sit, with_unshown
from epa_rt.gap.wording import Wording
from tests.gap import toy


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"odd": ("leak",), "links": ()},
        {"lost": 90.0, "links": ()},
        {"effects": ["creep"], "breaks": ("muscle0",)},
    ],
)
def test_every_sentence_that_says_none_explains_it_names_what_was_not_tested(more):
    """Written so that a verdict's sentence that is worded anew does not lose them."""
    says = Wording(
        **{
            "verdict": "not_in_catalogue",
            "effects": [],
            "sets": [],
            "links": ("position",),
            "part": 0.5,
            "not_tested": 2,
            "of": 9,
        }
        | more
    ).said()
    found = with_unshown(says, ("torque_limit", "viscous"))
    assert (
        "no effect of the catalogue that these logs could have shown explains it" in found
        and found.endswith("(not tested: torque_limit, viscous).")
    )
    assert with_unshown(says, ()) == says


def test_many_are_cut_short():
    found = with_unshown(
        "There is a gap, and no effect of the catalogue explains it. More.",
        [f"e{k}" for k in range(9)],
    )
    assert (
        found == "There is a gap, and no effect of the catalogue that these logs could have shown"
        " explains it (not tested: e0, e1, e2, e3, e4, e5 and 3 more). More."
    )


def test_other_verdicts_stay_as_they_are():
    says = Wording("explained", ["creep"], [], ("muscle0",), 0.98, 3, 9).said()
    assert with_unshown(says, ("leak",)) == says


def test_only_what_could_sit_where_the_gap_is_is_named():
    data = [toy.recording("log", 21, seconds=8.0)]
    problem = Problem(toy.Toy(), data, toy.floors(None, data, {}))
    silent = ("dahl", "coulomb", "pressure_offset")
    touched = {name: set(problem.touched(problem.effects[name].knobs)) for name in silent}
    assert could_sit(problem, (), silent) == silent
    for link in problem.links:
        assert could_sit(problem, (link,), silent) == tuple(
            name for name in silent if link in touched[name]
        )
    assert "dahl" in could_sit(problem, ("spring",), silent) and "dahl" not in could_sit(
        problem, ("drive",), silent
    )

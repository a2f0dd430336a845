"""What cannot be told apart, and what is the same law in more numbers."""

from types import SimpleNamespace as Thing

import numpy as np

from epa_rt.gap.separate import alike, become_best

LINE = np.linspace(-1.0, 1.0, 200)
KNOBS = {"drag": ("b",), "dry": ("f", "v0"), "other": ("k",), "bent": ("k", "h")}
SAYS = {
    "drag": 30.0 * LINE,
    "dry": 30.0 * LINE / np.sqrt(1.0 + (0.05 * LINE) ** 2),
    "other": 30.0 * LINE,
    "bent": 30.0 * LINE + 3.0 * LINE**2,
}


FAMILY = {"drag": "drag", "dry": "drag", "other": "spring", "bent": "spring"}


def names(*effects: str, gains=None, tied=(), families=FAMILY) -> list[str]:
    """Of fits that gain the same, those that stay beside the first."""
    problem = Thing(
        effects={name: Thing(knobs=knobs, family=families[name]) for name, knobs in KNOBS.items()},
        links=("muscle0",),
        each=lambda function, items: [function(item) for item in items],
        residual=lambda values, link: SAYS[values["of"]],
    )
    fits = tuple(Thing(effect=name, values={"of": name}) for name in effects)
    role = Thing(
        fits=fits, gains=np.array(gains or [[100.0, 110.0, 90.0]] * len(fits)), best=fits[0]
    )
    return [fit.effect for fit in alike(role, 0.0, become_best(problem, role), tied)]


def test_a_law_with_more_numbers_that_has_become_the_first_one_is_no_other_answer():
    assert names("drag", "dry") == ["drag"]


def test_a_law_that_says_something_else_or_has_no_more_numbers_stays():
    assert names("drag", "bent") == ["drag", "bent"]
    assert names("drag", "other") == ["drag", "other"]
    assert names("dry", "drag") == ["dry", "drag"]


def test_what_gains_clearly_less_is_told_apart():
    assert names("drag", "other", gains=[[100.0, 110.0, 90.0], [50.0, 60.0, 40.0]]) == ["drag"]


def test_a_law_for_another_thing_that_says_the_same_of_this_data_is_another_answer():
    """Dry and low-speed friction under one small sine."""
    assert names("drag", "dry", families={**FAMILY, "dry": "friction"}) == ["drag", "dry"]


def test_a_law_that_is_little_behind_block_by_block_stays_where_free_run_puts_nothing_between_them():  # noqa: E501
    """No law is the rig's own: 1.6 % behind with a z of 2.7 is what other words make. What the
    blocks agree on, with a z above 5, is told apart: free run does not hear it.
    """
    agreed, much = (
        [[100.0, 110.0, 90.0], [98.7, 108.4, 88.7]],
        [[100.0, 110.0, 90.0], [93.0, 101.0, 81.0]],
    )
    little = [[100.0, 110.0, 90.0], [97.5, 109.8, 88.0]]
    little, agreed, much = (
        [[100.0 * gain for gain in law] for law in gains] for gains in (little, agreed, much)
    )
    assert names("drag", "other", gains=agreed, tied=("other",)) == ["drag"]
    assert names("drag", "other", gains=little, tied=("other",)) == ["drag", "other"]
    assert names("drag", "other", gains=little) == ["drag"]
    assert names("drag", "other", gains=much, tied=("other",)) == ["drag"]

"""Which knobs of an effect are its strength: the fewest that switch it off together, each on its
own where one does.
"""

import numpy as np
import pytest

from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Link, Plain
from epa_rt.models.effect import Effect, Knob
from tests.gap import toy

T = np.arange(400) / 100.0
LAWS = {  # effect: knobs (name, plant file's value, a start or several), and what they add
    "single": ({"a": (0.0, 1.0)}, lambda v: v["a"] * np.sin(T)),
    "shaped": ({"a": (0.0, 1.0), "b": (2.0, 3.0)}, lambda v: v["a"] * np.sin(v["b"] * T)),
    "either": (
        {"a": (0.0, 1.0), "b": (0.0, 1.0), "c": (2.0, 3.0)},
        lambda v: v["a"] * v["b"] * np.sin(v["c"] * T),
    ),
    "both": (
        {"a": (0.0, 1.0), "b": (0.0, 1.0), "c": (2.0, 3.0)},
        lambda v: v["a"] * np.sin(v["c"] * T) + v["b"] * np.cos(v["c"] * T),
    ),
    "two_of_three": (
        {"a": (0.0, 1.0), "b": (0.0, 1.0), "c": (0.0, 1.0)},
        lambda v: v["a"] * (1.0 + v["c"]) * np.sin(T) + v["b"] * np.cos(T),
    ),
    "begins": (
        {"a": (0.0, 1.0), "p": (9.0, 2.0)},
        lambda v: v["a"] * np.maximum(T - v["p"], 0.0),
    ),  # at its plant-file place it never begins
    "gain": (
        {"g": (1.0, 1.1), "p": (9.0, 2.0)},
        lambda v: (v["g"] - 1.0) * np.maximum(T - v["p"], 0.0),
    ),
    "efficiency": (
        {"g": (1.0, 0.75), "b": (0.0, 3.0), "c": (0.0, 2.0)},
        lambda v: (1.0 - v["g"]) * (1.0 + v["b"] * np.exp(-v["c"] * T)) * np.sin(T),
    ),
    "unmoved": ({"a": (0.0, 1.0), "b": (0.0, 0.0)}, lambda v: (v["a"] + v["b"]) * np.sin(T)),
    "a_start_each": (
        {"a": (0.0, 1.0, 0.0), "b": (0.0, 0.0, 1.0)},
        lambda v: v["a"] * np.sin(T) + v["b"] * np.cos(T),
    ),
    "no_way_back": (
        {"a": (0.0, 1.0), "g": (1.0, 1.1)},
        lambda v: v["a"] * np.sin(T) + (v["g"] - 1.0) * np.cos(T),
    ),
}
EXPECTED = {
    "single": "a",
    "shaped": "a",
    "either": "ab",
    "both": "ab",
    "two_of_three": "ab",
    "begins": "a",
    "gain": "gp",
    "efficiency": "g",
    "unmoved": "a",
    "a_start_each": "ab",
    "no_way_back": "ag",
}


class Switches(Plain):
    """One link, noise plus every effect of LAWS; two threads may ask it."""

    name, rate_hz, nominal = "switches", 100.0, ()
    links = (Link("only", "block", "y", "", "nothing to y"),)
    catalogue = tuple(
        Effect(
            name,
            name,
            "block",
            tuple(f"{name}.{k}" for k in knobs),
            tuple(zip(*(starts for _, *starts in knobs.values()), strict=True)),
            "",
            "",
            "",
        )
        for name, (knobs, _) in LAWS.items()
    )
    knobs = {
        f"{name}.{k}": Knob(f"{name}.{k}", "", value, -10.0, 10.0, 1.0, name)
        for name, (knobs, _) in LAWS.items()
        for k, (value, *_) in knobs.items()
    }

    def touched(self, key):
        return ("only",)

    def prepare(self, recording):
        return recording

    def residual(self, prepared, values, link):
        found = prepared.columns["y"].copy()
        for name, (knobs, law) in LAWS.items():
            found -= law({k: values.get(f"{name}.{k}", value) for k, (value, *_) in knobs.items()})
        return found


@pytest.fixture(scope="module")
def problem() -> Problem:
    noise = np.random.default_rng(1).standard_normal(len(T))
    log = Recording(
        "log",
        "",
        "switches",
        "",
        "",
        0.01,
        np.arange(len(T)),
        {"y": noise},
        (Span("trial", 0, len(T), True),),
    )
    return Problem(Switches(), [log], {"only": toy.White("only", 1.0)})


@pytest.mark.parametrize("effect", LAWS)
def test_strength(effect, problem):
    assert problem.strength(effect) == tuple(f"{effect}.{k}" for k in EXPECTED[effect])


def test_strength_is_found_once_and_a_single_knob_is_not_asked(problem):
    problem.strength("both")
    before = problem.evaluations
    assert problem.strength("both") and problem.strength("single")
    assert problem.evaluations == before


def test_other_recordings_of_the_same_rig_are_not_asked_again(problem):
    """In free run an answer costs a run of the whole plant for each knob."""
    known = {effect: problem.strength(effect) for effect in LAWS}
    other = problem.on(problem.recordings)
    before = other.evaluations
    assert {effect: other.strength(effect) for effect in LAWS} == known
    assert other.evaluations == before

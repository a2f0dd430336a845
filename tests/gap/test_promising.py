"""What free run tries beside what is on, and from where: a point whose derivatives were kept while
a fit went on tells badly what imitates what.
"""

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from epa_rt.gap.likelihood import promising as room
from epa_rt.gap.likelihood.as_one import LINK
from epa_rt.gap.likelihood.point import linearised, normal_of
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.promising import Tried, afresh, promising
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Link
from epa_rt.models.effect import Effect, Knob
from tests.gap.one_link import OneLink, problem_of

SCALE = "load.scale_ratio"
TIME = np.arange(2000) / 100.0
WAVES = {
    "slow": np.sin(TIME),
    "quick": np.sin(7.0 * TIME),
    "square": np.sign(np.sin(3.0 * TIME)),
    "drift": TIME / 20.0 - 0.5,
    "shaped": np.sin(2.0 * TIME),
}


def knob_of(name: str) -> str:
    return f"load.{name}_n"


class Sum(OneLink):
    """A force that is a sum of waves; one of them has a phase besides."""

    name = "sum"
    links = (Link(LINK, LINK, "force_n", "N", "time to force"),)
    nominal = (Knob(SCALE, "1", 1.0, 0.5, 2.0, 0.02),)
    catalogue = tuple(
        Effect(
            name,
            name,
            "load",
            (knob_of(name), *(("load.phase_rad",) if name == "shaped" else ())),
            ((0.1, 0.3), (0.1, 1.0)) if name == "shaped" else ((0.1,),),
            "a wave",
            "",
            "",
        )
        for name in WAVES
    )
    knobs = {
        knob.key: knob
        for knob in (
            *nominal,
            *(Knob(knob_of(name), "N", 0.0, -5.0, 5.0, 0.1, name) for name in WAVES),
            Knob("load.phase_rad", "rad", 0.0, -3.0, 3.0, 0.3, "shaped"),
        )
    }

    def residual(self, prepared: Recording, values: Mapping[str, float], link: str) -> np.ndarray:
        at = {key: values.get(key, knob.value) for key, knob in self.knobs.items()}
        force = at[SCALE] * np.cos(TIME)
        for name, wave in WAVES.items():
            force = force + at[knob_of(name)] * (
                np.sin(2.0 * TIME + at["load.phase_rad"]) if name == "shaped" else wave
            )
        return prepared.columns["force_n"] - force


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of(Sum(), {knob_of("slow"): 0.3, knob_of("quick"): 0.02}, len(TIME), 0.01)


@pytest.mark.parametrize("slope", (0, 1))
def test_what_stale_derivatives_let_nominal_parameters_imitate_is_tried_for_its_slope(
    problem, monkeypatch, slope
):
    monkeypatch.setattr(room, "BY_SLOPE", slope)
    point = linearised(problem, (), {})
    positions, columns = point.columns[LINK]
    kept = {
        LINK: (
            positions,
            WAVES["slow"][:, None] * np.linalg.norm(columns) / np.linalg.norm(WAVES["slow"]),
        )
    }  # as if that were what a scale changes
    stale = replace(
        point, columns=kept, normal=normal_of(problem, point.normal.keys, {}, point.residual, kept)
    )
    tried = [one.effect for one in promising(problem, stale, 1)]
    assert ("slow" in tried) == bool(slope)


@pytest.mark.parametrize(
    ("name", "spreads", "begins"), (("shaped", 0.0, 2), ("slow", 0.0, 1), ("shaped", 6.0, 3))
)
def test_a_law_with_a_shape_begins_from_its_first_one_too_and_from_all_where_parameters_have_gone_far(  # noqa: E501
    problem, monkeypatch, name, spreads, begins
):
    begun = []
    monkeypatch.setattr(
        room,
        "fitted",
        lambda whole, effects, values, worth: (
            begun.append(values) or linearised(whole, effects, values)
        ),
    )
    best = linearised(problem, (), {SCALE: 1.0 + 0.02 * spreads})
    starts = tuple(
        dict(zip(problem.effects[name].knobs, start, strict=True))
        for start in problem.effects[name].starts
    )
    afresh(problem, best, Tried(name, starts, {knob_of(name): 0.7}, 1.0, None))
    assert begun == [{knob_of(name): 0.7}, *starts[: begins - 1]]


def test_another_start_is_worth_what_those_before_it_have_left(problem, monkeypatch):
    asked = []

    def fitted(whole, effects, values, worth):
        asked.append(worth)
        return linearised(whole, effects, values)

    monkeypatch.setattr(room, "fitted", fitted)
    far = linearised(problem, (), {SCALE: 1.12})
    starts = ({knob_of("slow"): 0.3}, {knob_of("slow"): -0.3})
    first = linearised(problem, ("slow",), {knob_of("slow"): 0.1})
    best = afresh(problem, far, Tried("slow", starts, {knob_of("slow"): 0.1}, 1.0, None), 1e9)
    left = [first.normal.chi, linearised(problem, ("slow",), starts[0]).normal.chi]
    assert left[1] < left[0] and best.values == starts[0]
    assert asked == [1e9, *((1.0 - room.SLOW) * np.array(left))]


@pytest.mark.parametrize(
    ("spreads", "far"), [((4.5, 0.0, 0.0), True), ((3.8, 3.2, 3.2), True), ((3.0, 1.0, 1.0), False)]
)
def test_parameters_have_gone_far_one_by_itself_or_several_together(spreads, far):
    normal = SimpleNamespace(z=np.array(spreads), prior=np.ones(len(spreads)))
    assert room._gone_far(SimpleNamespace(normal=normal)) is far

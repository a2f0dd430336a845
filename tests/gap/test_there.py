"""A name whose strength may as well be none is none; one that is far from none stays."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.point import Normal, Point
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import settled
from epa_rt.gap.select import Selection
from epa_rt.gap.there import maybe_none, without
from tests.gap import toy


def chosen(hidden, *names):
    """A selection that names ``names`` on a log with ``hidden``."""
    subject, recordings = toy.Toy(), [toy.recording("log", 1, hidden)]
    problem = Problem(subject, recordings, toy.floors(subject, recordings, {}))
    roles = tuple(SimpleNamespace(best=SimpleNamespace(effect=name)) for name in names)
    return problem, Selection(problem, settled(problem), roles, settled(problem, names), None)


def test_a_strength_beyond_its_interval_is_there():
    problem, selection = chosen({"sensors.force_offset_n": 1.0}, "force_offset")
    assert maybe_none(problem, selection, None) == ()


def test_a_strength_within_its_interval_may_be_none():
    problem, selection = chosen({}, "force_offset")
    selection = Selection(
        problem,
        selection.base,
        selection.roles,
        settled(problem, ("force_offset",), {"sensors.force_offset_n": 1e-4}),
        None,
    )
    assert maybe_none(problem, selection, None) == ("force_offset",)
    assert maybe_none(problem, selection, None, sure=("force_offset",)) == ()


def test_what_fits_of_twins_go_astray_by_counts():
    """However sharp the blocks are, a strength that twins without it reach as well says nothing."""
    problem, selection = chosen({"sensors.force_offset_n": 1.0}, "force_offset")
    far = np.zeros((5, len(selection.final.normal.keys)))
    far[:, selection.final.normal.keys.index("sensors.force_offset_n")] = [
        2.0,
        -1.5,
        1.8,
        -2.2,
        1.0,
    ]
    assert maybe_none(problem, selection, far) == ("force_offset",)


@pytest.mark.parametrize("strength_n", (0.0, 20.0))
def test_on_a_bound_it_is_none_only_where_it_is_at_none(strength_n):
    problem, selection = chosen({"spring.coulomb_n": strength_n}, "coulomb")
    values = {**selection.final.values, "spring.coulomb_n": strength_n}
    normal = replace(
        selection.final.normal,
        frozen=np.array([key == "spring.coulomb_n" for key in selection.final.normal.keys]),
    )
    selection = Selection(
        problem,
        selection.base,
        selection.roles,
        replace(selection.final, values=values, normal=normal),
        None,
    )
    assert maybe_none(problem, selection, None) == (("coulomb",) if strength_n == 0.0 else ())


def test_the_others_stay_and_are_fitted_without_it():
    problem, selection = chosen({"spring.coulomb_n": 2.0}, "coulomb", "force_offset")
    left = without(problem, selection, ("force_offset",))
    assert left.final.effects == ("coulomb",) and [role.best.effect for role in left.roles] == [
        "coulomb"
    ]
    assert (
        left.final.values["spring.coulomb_n"] == pytest.approx(2.0, abs=0.1)
        and "sensors.force_offset_n" not in left.final.values
    )
    assert without(problem, selection, ("coulomb", "force_offset")).final.effects == ()


def test_a_diagnosis_keeps_a_name_that_is_there():
    recordings = [toy.recording(f"log {i}", i, {"sensors.force_offset_n": 1.0}) for i in range(2)]
    assert [one.name for one in diagnose(toy.Toy(), recordings, floors=toy.floors).effects] == [
        "force_offset"
    ]


SHAPED = ("lock.stiffness", "lock.length")


def beside_a_shape(strength: float, off: np.ndarray | None = None) -> tuple[str, ...]:
    """What is said of an effect whose strength and shape go together along a valley: 20 half widths
    of a strength of 1 along it, 0.02 across.
    """
    along, across = np.array([1.0, 1.0]) / np.sqrt(2.0), np.array([1.0, -1.0]) / np.sqrt(2.0)
    inverse = 100.0 * np.outer(along, along) + 1e-4 * np.outer(across, across)
    scores = (
        np.linalg.inv(inverse)
        @ np.random.default_rng(1).multivariate_normal(np.zeros(2), inverse / 100.0, 100).T
    )
    blocks = np.tile(np.linalg.inv(inverse) / 100.0, (1, 100, 1, 1))
    normal = Normal(
        SHAPED,
        blocks,
        scores.T[None],
        np.zeros((1, 100)),
        np.zeros(2),
        np.zeros(2),
        np.zeros(2, bool),
    )
    point = Point(("lock",), {"lock.stiffness": strength, "lock.length": 2.0}, {}, {}, normal)
    problem = SimpleNamespace(
        effects={"lock": SimpleNamespace(knobs=SHAPED)},
        strength=lambda name: SHAPED[:1],
        spread=lambda key: 1.0,
        knobs={key: SimpleNamespace(value=0.0) for key in SHAPED},
    )
    role = SimpleNamespace(best=SimpleNamespace(effect="lock"))
    return maybe_none(problem, SimpleNamespace(roles=(role,), final=point), off)


@pytest.mark.parametrize(("strength", "gone"), [(0.05, True), (1.0, False), (40.0, False)])
def test_a_strength_that_a_shape_can_take_the_place_of_is_there_where_it_is_far_from_none_beside_that_shape(  # noqa: E501
    strength, gone
):
    assert beside_a_shape(strength) == (("lock",) if gone else ())


@pytest.mark.parametrize(("way", "gone"), [((10.0, 10.0), False), ((1.0, 0.0), True)])
def test_twins_that_go_along_the_valley_say_nothing_and_across_they_do(way, gone):
    off = np.array([way, [-step for step in way]])
    assert beside_a_shape(1.0, off) == (("lock",) if gone else ())

"""Laws of one family in free run: where the named one leaves much, the thing may be there in other
words.
"""

from dataclasses import replace
from types import SimpleNamespace as Thing

import numpy as np
import pytest

from epa_rt.gap.attribution import attributed
from epa_rt.gap.further import in_other_words
from epa_rt.gap.ground import ground_of
from epa_rt.gap.in_free_run import _kin, _shapes, _with_first, heard
from epa_rt.gap.problem import Problem
from epa_rt.gap.refit import Fit, settled
from epa_rt.gap.rules import Rules
from tests.gap import toy
from tests.gap.one_link import problem_of
from tests.gap.test_in_free_run import Chained, logs
from tests.gap.test_strength import Switches

COGS = {"drive.cogging_a": 0.3, "drive.cogging_per_m": 260.0}
DAHL = {"spring.dahl_n": 4.0, "spring.dahl_m": 4e-3}


def chosen(recordings, first: str):
    """What the blocks say of the recordings, with another law of the family put first as if it
    gained as much.
    """
    found = attributed(Chained(), recordings, floors=toy.floors)
    (role,) = found.selection.roles
    fit = next(fit for fit in role.fits if fit.effect == first)
    most = role.gains[np.argmax(role.gains.sum(axis=1))]
    role = _with_first(role, fit)
    role = replace(role, gains=np.concatenate([most[None], role.gains[1:]]))
    final = replace(found.selection.final, effects=(first,), values=dict(fit.values))
    problem = Problem(
        Chained(),
        recordings,
        found.problem.floors,
        {link: scale**2 for link, scale in found.problem.scale.items()},
    )
    return problem, replace(found.selection, problem=problem, roles=(role,), final=final)


def test_a_law_of_the_same_family_that_carries_the_plant_is_named_instead(monkeypatch):
    for other in (
        "completed.further",
        "in_free_run.one_alone",
    ):  # what would find it as well, later
        monkeypatch.setattr(f"epa_rt.gap.{other}", lambda *arguments: None)
    problem, selection = chosen(logs(DAHL), "coulomb")
    (role,) = selection.roles
    strayed = tuple(
        replace(fit, values=fit.values | {"spring.dahl_m": 2e-2}) if fit.effect == "dahl" else fit
        for fit in role.fits
    )
    selection = replace(selection, roles=(replace(role, fits=strayed),))
    ground = ground_of(problem, selection.base.values)
    found, said = heard(problem, selection, ground)
    assert list(found.final.effects) == ["dahl"] and said.to_noise
    assert found.roles[0].best.values["spring.dahl_m"] == pytest.approx(
        DAHL["spring.dahl_m"], rel=0.1
    )
    gained = found.roles[0].gains.sum(axis=1)
    assert (
        found.roles[0].best.effect == "dahl"
        and gained[0] > 0.99 * gained.max()
        and len(gained) == len(role.fits)
    )
    kept, said = heard(problem, selection, ground, Rules(kin=0))
    assert "dahl" not in kept.final.effects and not said.to_noise


def test_a_law_that_leaves_much_is_begun_again_from_its_other_shapes(monkeypatch):
    for other in ("completed.further", "in_free_run.one_alone"):
        monkeypatch.setattr(f"epa_rt.gap.{other}", lambda *arguments: None)
    problem, selection = chosen(logs(COGS), "cogging")
    (role,) = selection.roles
    fits = (
        replace(role.best, values=role.best.values | {"drive.cogging_per_m": 390.0}),
        *role.fits[1:],
    )
    selection = replace(
        selection,
        roles=(replace(role, fits=fits),),
        final=replace(selection.final, values=dict(fits[0].values)),
    )
    ground = ground_of(problem, selection.base.values)
    found, said = heard(problem, selection, ground)
    assert list(found.final.effects) == ["cogging"] and said.to_noise
    assert found.final.values["drive.cogging_per_m"] == pytest.approx(
        COGS["drive.cogging_per_m"], rel=0.01
    )
    _, strayed = heard(problem, selection, ground, Rules(shapes=0))
    assert strayed.left > 10.0 * said.left + 100.0


def test_a_law_that_leaves_nothing_stands_without_a_look_at_its_kin(monkeypatch):
    monkeypatch.setattr("epa_rt.gap.in_free_run._kin", lambda *arguments: pytest.fail("asked"))
    problem, selection = chosen(logs(DAHL), "dahl")
    assert list(
        heard(problem, selection, ground_of(problem, selection.base.values))[0].final.effects
    ) == ["dahl"]


@pytest.mark.parametrize(
    ("gap", "left", "much"),
    [
        (1329.0, 54.0, True),
        (1329.0, 29.0, False),
        (90_000.0, 400.0, False),
        (90_000.0, 500.0, True),
        (0.0, 0.0, False),
    ],
)
def test_much_is_more_than_the_right_law_in_other_words_leaves(gap, left, much):
    assert (left > in_other_words(gap)) is much


def test_kin_are_near_laws_of_the_best_ones_family_alone():
    effects = {
        name: Thing(family=family)
        for name, family in (("a", "F"), ("b", "F"), ("c", "G"), ("d", "F"), ("e", "F"), ("f", "F"))
    }
    fits = tuple(Thing(effect=name) for name in effects)
    role = Thing(
        best=fits[0], fits=fits, gains=np.array([[100.0], [95.0], [99.0], [50.0], [90.0], [85.0]])
    )
    assert [fit.effect for fit in _kin(Thing(effects=effects), role, Rules())] == ["b", "e"]


def test_shapes_are_refitted_and_the_best_comes_first():
    true = {"shaped.a": 0.5, "shaped.b": 2.0}
    subject = Switches()
    subject.catalogue = tuple(
        (
            effect._replace(starts=((1.0, 3.0), (1.0, 2.2), (1.0, 7.0)))
            if effect.name == "shaped"
            else effect
        )
        for effect in subject.catalogue
    )
    problem = problem_of(subject, true, 400, 0.01)
    role = Thing(point=settled(problem))
    strayed = Fit("shaped", {"shaped.a": 0.5, "shaped.b": 9.0}, 0.0, None)
    found = _shapes(problem, problem, role, strayed)
    assert len(found) == 3 and [found[0][key] for key in true] == pytest.approx(
        list(true.values()), rel=0.01
    )
    there = replace(strayed, values={"shaped.a": 0.5, "shaped.b": 2.2})
    assert (
        len(_shapes(problem, problem, role, there)) == 2
    )  # as it is already, a shape is not asked for again
    assert (
        _shapes(problem, problem, role, Fit("single", {"single.a": 0.3}, 0.0, None)) == []
    )  # strength alone

"""What is answered on a posterior: the answer that costs least, whatever the posterior says."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.gap.posterior.decide import HOLDS, decided
from epa_rt.gap.posterior.evidence import START
from epa_rt.gap.posterior.search import Model
from epa_rt.gap.posterior.unknown import Found
from epa_rt.gap.posterior.views import BLOCKS, Seen, View

FAMILIES = {
    "leak": "leak",
    "coulomb": "friction",
    "dahl": "friction",
    "play": "play",
    "spring": "spring",
    "late": "delay",
    "zero": "sensor",
}
SETS = (
    (),
    ("leak",),
    ("coulomb",),
    ("dahl",),
    ("play",),
    ("leak", "play"),
    ("spring",),
    ("late",),
    ("zero",),
)


def answer(shares, unknown=0.0, left=0.0):
    """``shares``: of SETS; ``left``: chi-square above noise that every model leaves."""
    view = {BLOCKS: View({"a": Seen(100.0, 100.0 + left)})}
    models = [(Model(one, view, {}), share) for one, share in zip(SETS, shares, strict=False)]
    found = Found(tuple(sorted(models, key=lambda one: -one[1])), unknown)
    return decided(found, FAMILIES, START)


def test_a_probable_name_is_given_with_its_probability():
    found = answer((0.02, 0.93), unknown=0.05)
    assert (found.kind, found.effects) == ("explained", ("leak",))
    assert found.probability == (0.93,)


def test_laws_of_one_family_stand_for_it_together():
    found = answer((0.0, 0.04, 0.5, 0.46))
    assert (found.kind, found.effects) == ("explained", ("coulomb",))
    assert abs(found.probability[0] - 0.96) < 1e-9


def test_two_that_are_as_probable_are_a_set():
    found = answer((0.0, 0.5, 0.0, 0.0, 0.5))
    assert found.kind == "not_separable"
    assert {found.effects, *found.instead} == {("leak",), ("play",)}


def test_where_many_laws_say_the_same_they_are_said_and_not_that_none_does():
    found = answer((0.0, 0.42, 0.09, 0.0, 0.22, 0.09, 0.08, 0.05, 0.04), unknown=0.01)
    assert (found.kind, found.effects) == ("not_separable", ("leak",))
    assert found.instead[0] == ("play",) and len(found.instead) == 5


def test_what_many_sets_share_is_named_and_none_of_what_they_differ_in():
    view = {BLOCKS: View({"a": Seen(100.0, 100.0)})}

    def of(besides: dict[str, float]) -> Found:
        sets = [(("leak", *filter(None, [more])), share) for more, share in besides.items()]
        return Found(tuple((Model(one, view, {}), share) for one, share in sets), 0.0)

    many = of({"play": 0.3, "spring": 0.25, "late": 0.2, "zero": 0.15, "": 0.1})
    found = decided(many, FAMILIES, START)
    assert (found.kind, found.effects) == ("partly_explained", ("leak",))
    assert found.probability == pytest.approx((1.0,))
    two = decided(of({"play": 0.5, "spring": 0.45, "": 0.05}), FAMILIES, START)
    assert two.kind == "not_separable"


def test_nothing_and_unknown():
    assert answer((0.9, 0.1)).kind == "no_gap"
    assert answer((0.0, 0.2), unknown=0.8).kind == "not_in_catalogue"


def test_what_is_left_beside_a_name_is_said():
    assert answer((0.0, 1.0), left=1e6).kind == "partly_explained"
    assert answer((0.0, 1.0), left=10.0).kind == "explained"


@pytest.mark.parametrize(
    ("share", "kind"), [(0.005, "explained"), (0.01, "explained"), (0.16, "partly_explained")]
)
def test_a_sixth_of_a_gap_left_is_something_besides_and_a_hundredth_is_the_law_s_own(share, kind):
    gap = 4e4  # chi-square above a noise of 100: 20 floors, of which the sixth is 8
    views = [{BLOCKS: View({"a": Seen(100.0, 100.0 + left)})} for left in (gap, share * gap)]
    models = ((Model(("leak",), views[1], {}), 1.0), (Model((), views[0], {}), 0.0))
    assert decided(Found(models, 0.0), FAMILIES, START).kind == kind


@given(st.lists(st.floats(0.001, 1.0), min_size=7, max_size=7))
def test_whatever_the_posterior_a_sure_name_is_never_improbable(weights):
    total = sum(weights)
    *shares, unknown = (weight / total for weight in weights)
    found = answer(shares, unknown)
    assert found.loss <= 0.5
    if found.kind in ("explained", "partly_explained"):
        assert max(found.probability) > 0.5
    if found.kind == "not_separable":
        held = [found.effects, *found.instead]
        named = {frozenset(FAMILIES[name] for name in one) for one in SETS if one}
        kinds = {frozenset(FAMILIES[name] for name in one) for one in held}
        assert len(kinds) == len(held) and kinds <= named
    assert HOLDS < 1.0

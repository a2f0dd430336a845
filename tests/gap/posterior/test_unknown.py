"""Something that the catalogue lacks: what a view shows of it, and where nominal parameters go."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.gap.posterior.evidence import START
from epa_rt.gap.posterior.prior import Prior
from epa_rt.gap.posterior.search import Model, Table
from epa_rt.gap.posterior.unknown import left_by_wrong, posterior, pushed_by_wrong
from epa_rt.gap.posterior.views import BLOCKS, FREE_RUN, Seen, View

NOISE, GAP = 4000.0, 4e5
FAMILIES = {name: name for name in ("leak", "play")}


def model(effects: tuple[str, ...], left: dict[str, float], push: float = 0.0) -> Model:
    """What it leaves of the gap by view. ``push``: of its nominal parameter, in spreads."""
    views = {
        name: View(
            {"a": Seen(NOISE, NOISE + part * GAP, 100.0 * np.eye(2))},
            ("nominal", "own"),
            np.array([push, 0.0]),
            np.array([True, False]),
        )
        for name, part in left.items()
    }
    return Model(effects, views, {})


def unknown(left: dict[str, float], push: float = 0.0) -> float:
    """Its probability where a leak leaves so much."""
    none = model((), dict.fromkeys(left, 1.0))
    return posterior(Table((none, model(("leak",), left, push)), Prior(FAMILIES)), START).unknown


def test_one_view_that_shows_it_is_enough():
    fine, bad = {BLOCKS: 0.01, FREE_RUN: 0.01}, {BLOCKS: 0.01, FREE_RUN: 0.6}
    assert unknown(fine) < 0.1 < 0.25 < unknown(bad)
    assert unknown(bad) == pytest.approx(unknown({BLOCKS: 0.6, FREE_RUN: 0.01}), abs=0.05)
    assert unknown({BLOCKS: 0.6, FREE_RUN: 0.6}) > unknown(bad)


@given(st.floats(0.0, 1.0), st.floats(-6.0, 0.0))
def test_however_little_is_left_wrong_laws_may_have_left_it(left, odds):
    none, of = model((), {BLOCKS: 1.0}), model(("leak",), {BLOCKS: left})
    ratio, _ = left_by_wrong(of, none, replace(START, imitated_odds=odds))
    assert ratio >= odds - np.log1p(np.exp(odds)) - 1e-9


def test_where_no_wrong_law_imitates_little_that_is_left_speaks_against_it():
    none, of = model((), {BLOCKS: 1.0}), model(("leak",), {BLOCKS: 0.01})
    never, often = (
        left_by_wrong(of, none, replace(START, imitated_odds=odds))[0] for odds in (-30.0, 0.0)
    )
    assert never < -2.0 < often


@given(st.floats(0.0, 200.0), st.floats(0.0, 200.0))
def test_nominal_parameters_that_go_farther_speak_more_for_it(one, other):
    near, far = sorted([one, other])
    ratios = [
        pushed_by_wrong(model(("leak",), {BLOCKS: 0.01}, push), START) for push in (near, far, -far)
    ]
    assert ratios[0] <= ratios[1] == ratios[2]


def test_a_nominal_parameter_at_its_place_speaks_against_it_and_one_far_off_for_it():
    left = {BLOCKS: 0.05}
    assert (
        unknown(left, push=0.5) < 0.2 < 0.8 < min(unknown(left, push=8.0), unknown(left, push=80.0))
    )
    without = model(("leak",), left)
    without.views[BLOCKS].nominal[:] = False
    assert pushed_by_wrong(without, START) == 0.0

"""Screening: what two effects explain together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.gap.likelihood.screen import Screening, Signature

FAMILIES = {"drag": "drag", "friction": "friction", "rise": "friction"}


def screened(signatures: dict[str, np.ndarray], residual: np.ndarray) -> Screening:
    """Of effects that change a residual so, nothing projected out of it."""
    table = np.column_stack(list(signatures.values()))
    right = table.T @ residual
    sizes = (table**2).sum(axis=0)
    return Screening(
        tuple(
            Signature(name, {}, size, by**2 / size, -by / size, 0.0)
            for name, size, by in zip(signatures, sizes, right, strict=True)
        ),
        table.T @ table,
        right,
    )


def alike(likeness: float) -> dict[str, np.ndarray]:
    """Drag and friction whose signatures have this cosine."""
    one, other = np.linalg.qr(np.random.default_rng(3).standard_normal((50, 2)))[0].T
    return {"drag": one, "friction": likeness * one + np.sqrt(1.0 - likeness**2) * other}


@given(likeness=st.floats(0.3, 0.99), strength=st.floats(0.9, 1.1))
def test_two_that_hide_each_other_are_found_with_their_strengths(likeness, strength):
    shapes = alike(likeness)
    drag = strength * likeness
    residual = drag * shapes["drag"] - shapes["friction"]
    pair = screened(shapes, residual).hidden_pair(FAMILIES)
    assert pair is not None
    found = {seen.effect: amplitude for seen, amplitude in (pair.one, pair.other)}
    assert found["friction"] == pytest.approx(1.0) and found["drag"] == pytest.approx(-drag)
    assert pair.gain == pytest.approx(float(residual @ residual))  # nothing is left


@given(likeness=st.floats(0.3, 0.99), strength=st.floats(0.1, 10.0))
def test_two_that_explain_less_together_than_in_sum_hide_nothing(likeness, strength):
    shapes = alike(likeness)
    residual = -shapes["drag"] - strength * shapes["friction"]
    assert screened(shapes, residual).hidden_pair(FAMILIES) is None


def test_no_family_is_in_a_pair_twice_or_beside_itself():
    one, other = alike(0.9).values()
    hidden = one - other
    assert screened({"rise": one, "friction": other}, hidden).hidden_pair(FAMILIES) is None
    both = screened({"drag": one, "friction": other}, hidden)
    assert both.hidden_pair(FAMILIES) is not None
    assert both.hidden_pair(FAMILIES, on={"drag"}) is None
    assert both.hidden_pair(FAMILIES, on={"drag", "friction"}) is None

"""Every entry of every catalogue on clean data: its knobs move the residual, neutral is absence,
and a fit finds them again.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from epa_rt.gap.likelihood.role import unlike
from tests.gap.foreign.made import HOSTS, blank, subject_of, with_output

KINDS = ("carriage", "piston", "chamber", "servo", "shaft")
EVERY = [(kind, effect.name) for kind in KINDS for effect in subject_of(kind).catalogue]
DRY = {
    "carriage": {"friction.coulomb_n": 12.0},
    "piston": {"friction.coulomb_n": 12.0},
    "shaft": {"friction.coulomb_nm": 0.3},
}  # what turns over gradually
STAIRS = (
    ("servo", "encoder_step"),
    ("servo", "stiction"),
    ("servo", "deadband_whole"),
)  # they act by jumps: no slope to follow


def parts(kind: str, name: str):
    subject = subject_of(kind)
    effect = next(e for e in subject.catalogue if e.name == name)
    host = {
        **HOSTS.get(kind, {}),
        **(DRY[kind] if name in ("coulomb_rounding", "presliding") else {}),
    }
    return subject, effect, dict(zip(effect.knobs, effect.starts[0], strict=True)), host


@pytest.mark.parametrize(("kind", "name"), EVERY)
def test_an_effect_moves_its_link_and_is_absent_at_neutral(kind, name):
    subject, effect, start, host = parts(kind, name)
    ready, link = subject.prepare(blank(kind)), subject.links[0].name
    base = subject.residual(ready, host, link)
    on = subject.residual(ready, {**host, **start}, link)
    assert np.array_equal(np.isnan(base), np.isnan(on))
    assert np.nanmax(np.abs(on - base)) > 1e-6 * max(np.nanmax(np.abs(base)), 1e-9)
    neutral = {key: subject.knobs[key].value for key in effect.knobs}
    assert np.array_equal(subject.residual(ready, {**host, **neutral}, link), base, equal_nan=True)
    amplitudes = [
        key for key in effect.knobs if subject.knobs[key].value in (0.0, 1.0)
    ]  # the others only shape it
    off = {**start, **{key: subject.knobs[key].value for key in amplitudes}}
    assert np.array_equal(subject.residual(ready, {**host, **off}, link), base, equal_nan=True)


@pytest.mark.parametrize(("kind", "name"), [one for one in EVERY if one not in STAIRS])
@settings(max_examples=2, deadline=None, derandomize=True)
@given(size=st.floats(0.6, 1.4))
def test_a_fit_finds_the_numbers_again(kind, name, size):
    subject, effect, start, host = parts(kind, name)
    truth = {
        key: subject.knobs[key].value + size * (start[key] - subject.knobs[key].value)
        for key in effect.knobs
    }
    ready, link = subject.prepare(with_output(kind, {**host, **truth})), subject.links[0].name
    spread = np.array([subject.knobs[key].spread for key in effect.knobs])
    low, high = (
        np.array([getattr(subject.knobs[key], side) for key in effect.knobs]) / spread
        for side in ("low", "high")
    )

    def left(x):
        found = subject.residual(
            ready, {**host, **dict(zip(effect.knobs, x * spread, strict=True))}, link
        )
        return found[np.isfinite(found)]

    def inside(one):
        return np.clip(
            np.array([one[key] for key in effect.knobs]) / spread, low + 1e-9, high - 1e-9
        )

    begins = [dict(zip(effect.knobs, one, strict=True)) for one in effect.starts]
    if effect.sets_in:  # valleys: from starts that take most off as they are, as in the search
        begins = unlike(sorted(begins, key=lambda one: float(np.sum(left(inside(one)) ** 2))), 6)
    else:
        begins = begins[:1]
    scale = np.sqrt(
        np.mean(left(np.array([subject.knobs[key].value for key in effect.knobs]) / spread) ** 2)
    )
    fits = []
    for one in begins:
        fit = least_squares(
            lambda x: left(x) / scale,
            inside(one),
            bounds=(low, high),
            diff_step=1e-4,
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-12,
            gtol=1e-12,
        )
        fits.append(fit)
        if fit.cost < 1e-9:
            break
    fit = min(fits, key=lambda one: one.cost)
    for key, value in zip(effect.knobs, fit.x * spread, strict=True):
        distance = abs(truth[key] - subject.knobs[key].value) or abs(truth[key])
        assert abs(value - truth[key]) < 0.02 * max(distance, 0.02 * subject.knobs[key].spread), key


@pytest.mark.parametrize(("kind", "name"), STAIRS)
def test_a_search_finds_the_number_of_a_law_that_jumps(kind, name):
    subject, effect, start, host = parts(kind, name)
    (key,) = effect.knobs
    ready, link = subject.prepare(with_output(kind, {key: start[key]})), subject.links[0].name
    sizes = np.array([0.5, 0.8, 0.9, 0.96, 1.0, 1.04, 1.1, 1.2, 1.5])
    left = [
        np.nanstd(subject.residual(ready, {**host, key: size * start[key]}, link)) for size in sizes
    ]
    assert (
        left[4] < 1e-9 < min(*left[:3], *left[6:])
    )  # within 10 %: between jumps every size is the same

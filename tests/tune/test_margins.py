"""Margins against formulas of known loops, and stability against the poles themselves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.tune.margins import Interpolated, interpolated, margins_of, shortfall

HERTZ = np.geomspace(0.01, 200.0, 1200)


def grid(plant: np.ndarray, radius: float = 0.0) -> Interpolated:
    return Interpolated(HERTZ, plant, np.full(len(plant), radius))


@given(gain=st.floats(0.5, 20.0), delay_s=st.floats(0.002, 0.05))
@settings(max_examples=30, deadline=None)
def test_an_integrator_with_a_delay_has_the_margins_of_its_formulas(gain, delay_s):
    s = 2j * np.pi * HERTZ
    plant = np.exp(-s * delay_s) / s
    found = margins_of(grid(plant), np.full(len(s), gain))
    assert found.crossover_hz == pytest.approx(gain / (2 * np.pi), rel=1e-3)
    assert found.stable == (gain * delay_s < np.pi / 2)
    if found.stable:
        assert found.phase_rad == pytest.approx(np.pi / 2 - gain * delay_s, abs=2e-3)
        assert found.delay_s == pytest.approx(np.pi / 2 / gain - delay_s, rel=5e-3, abs=1e-5)
        assert found.gain == pytest.approx(np.pi / 2 / (gain * delay_s), rel=2e-2)
        # what Ms promises of gain and phase
        assert found.gain >= found.peak / (found.peak - 1.0) - 0.02
        assert found.phase_rad >= 2.0 * np.arcsin(0.5 / found.peak) - 0.01


@given(gain=st.floats(0.1, 30.0))
@settings(max_examples=40, deadline=None)
def test_stability_is_what_the_poles_say(gain):
    """1 / (s (s/10 + 1) (s/20 + 1)): stable below 30, by Routh."""
    s = 2j * np.pi * HERTZ
    loop = 1.0 / (s * (s / 10.0 + 1.0) * (s / 20.0 + 1.0))
    poles = np.roots([1 / 200.0, 0.15, 1.0, gain])
    if abs(max(poles.real)) > 0.05:
        found = margins_of(grid(loop), np.full(len(s), gain))
        assert found.stable == bool(max(poles.real) < 0.0)


def test_uncertainty_that_reaches_minus_one_bounds_nothing():
    s = 2j * np.pi * HERTZ
    plant = 1.0 / s
    assert margins_of(grid(plant, 0.0), np.full(len(s), 5.0)).worst_peak < 1.1
    assert margins_of(grid(plant, 0.3), np.full(len(s), 5.0)).worst_peak == float("inf")


def test_what_falls_short_of_the_bound_is_said():
    plant = np.exp(-2j * np.pi * HERTZ * 0.01) / (2j * np.pi * HERTZ)
    said = [
        shortfall(margins_of(grid(plant, radius), np.full(len(HERTZ), gain)), 1.6)
        for gain, radius in ((10.0, 0.0), (70.0, 0.0), (10.0, 0.2), (200.0, 0.0))
    ]
    assert said[0] is None
    assert "Ms reaches" in said[1] and "does not exclude" in said[2] and "unstable" in said[3]


def test_a_resonance_between_two_points_keeps_its_peak():
    def shape(hertz):
        s = 2j * np.pi * hertz
        omega = 2.0 * np.pi * 2.0
        return omega**2 / (s**2 + 0.1 * omega * s + omega**2)

    known = np.array([0.5, 1.0, 1.5, 1.8, 2.3, 3.0, 5.0])
    found = interpolated(known, 1.1 * shape(known), np.zeros(7), shape)
    assert np.max(np.abs(found.plant)) == pytest.approx(11.0, rel=0.01)
    assert np.all(found.radius > 0.0)

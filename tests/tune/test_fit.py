"""Vector fitting finds known poles again and holds the response between the points."""

import numpy as np
import pytest

from epa_rt.tune.fit import fitted
from epa_rt.tune.margins import interpolated


def response(hertz: np.ndarray) -> np.ndarray:
    s = 2j * np.pi * hertz
    omega = 2.0 * np.pi * 2.0
    return 8.0 * omega**2 / (s**2 + 0.2 * omega * s + omega**2) * 80.0 / (s + 80.0)


def test_known_poles_are_found_again():
    hertz = np.geomspace(0.2, 15.0, 30)
    truth = response(hertz)
    found = fitted(hertz, truth, 0.01 * np.abs(truth), 0)
    between = np.geomspace(0.25, 14.0, 77)
    assert np.max(np.abs(found.at(between) / response(between) - 1.0)) < 0.02
    pair = found.poles[np.argmin(np.abs(found.poles - (-1.2566 + 12.503j)))]
    assert pair == pytest.approx(-1.2566 + 12.503j, rel=0.02)


def test_an_integrator_stays_one():
    hertz = np.geomspace(0.2, 50.0, 30)
    s = 2j * np.pi * hertz
    truth = np.exp(-0.003 * s) / s / (1.0 + 0.004 * s)
    found = fitted(hertz, truth, 0.01 * np.abs(truth), 1)
    assert found.integrators == 1 and found.misfit < 0.05
    assert np.all(found.poles.real < 0.0)
    assert abs(found.at(np.array([1e-4]))[0]) * 2.0 * np.pi * 1e-4 == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("at", range(16, 29, 3))
def test_a_point_that_differs_makes_no_resonance_beside_it(at):
    """As a plant that rubs does, where two sizes of excitation meet."""
    hertz = np.geomspace(0.2, 15.0, 30)
    measured = response(hertz)
    measured[at] *= 0.5
    found = fitted(hertz, measured, 0.01 * np.abs(measured), 0)
    none = np.zeros(len(hertz))
    grid = interpolated(hertz, measured, none, found.at)
    plain = interpolated(hertz, measured, none, lambda f: np.ones(len(f), complex))
    assert np.max(np.abs(np.log(np.abs(grid.plant / plain.plant)))) < np.log(1.5)


def test_the_sampled_model_answers_a_sine_as_the_response_says():
    hertz = np.geomspace(0.2, 15.0, 30)
    truth = response(hertz)
    found = fitted(hertz, truth, 0.01 * np.abs(truth), 0)
    a, b = found.sampled(1e-3)
    state, out = np.zeros(len(a), complex), np.empty(12000)
    omega = 2.0 * np.pi * 1.5
    for k in range(len(out)):
        out[k] = state.sum().real
        state = a * state + b * np.cos(omega * k * 1e-3)
    last = np.arange(8000, 12000)
    answer = 2.0 * np.mean(out[last] * np.exp(-1j * omega * last * 1e-3))
    held = np.exp(-0.5j * omega * 1e-3)  # a held command is half a cycle late
    assert abs(answer / (response(np.array([1.5]))[0] * held) - 1.0) < 0.03

"""The data-driven residual model: what it foresees of a large gap on blocks left out, and that noise stays noise."""

import numpy as np

from epa_rt.gap.floor import Floor
from epa_rt.gap.generic import designed, fit_generic

RATE_HZ = 100.0


def fitted(gap, seed: int = 1):
    """Three logs of a link whose floor is white with 0.01; ``gap(speed)`` in units of that floor."""
    random = np.random.default_rng(seed)
    states, residuals = {}, {}
    for i in range(3):
        t = np.arange(3000) / RATE_HZ
        place = np.sin(2 * np.pi * (0.3 + 0.1 * i) * t) + 0.4 * np.sin(2 * np.pi * 1.7 * t + i)
        speed = np.gradient(place) * RATE_HZ
        states[f"log{i}"] = {"place_m": place, "speed_m_s": speed, "force_n": 400.0 * place + 30.0 * random.standard_normal(3000)}
        residuals[f"log{i}"] = 0.01 * (gap(speed) + random.standard_normal(3000))
    floor = Floor("link", 0.01, np.zeros(16), 0.01)
    return fit_generic("link", residuals, designed(residuals, states, floor, RATE_HZ))


def test_large_gap_is_foreseen_on_blocks_left_out_and_its_terms_are_named():
    fit = fitted(lambda speed: 6.0 * np.sign(speed))
    assert fit.before > 30.0 and fit.after < 3.0
    assert "speed_m_s" in fit.ranked[0][0]


def test_noise_alone_is_left_as_it_is():
    fit = fitted(lambda speed: 0.0 * speed)
    assert abs(fit.before - 1.0) < 0.1 and fit.before - fit.after < 0.02

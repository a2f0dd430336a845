"""The data-driven residual model: what it foresees of a large gap on blocks left out, and that
noise stays noise.
"""

import numpy as np
import pytest

from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.generic import designed, fit_generic

RATE_HZ = 100.0


def fitted(gap, seed: int = 1, rate_hz: float = RATE_HZ, count: int = 3000):
    """Three logs of a link whose floor is white with 0.01; ``gap(speed)`` in units of that
    floor.
    """
    random = np.random.default_rng(seed)
    states, residuals = {}, {}
    for i in range(3):
        t = np.arange(count) / RATE_HZ
        place = np.sin(2 * np.pi * (0.3 + 0.1 * i) * t) + 0.4 * np.sin(2 * np.pi * 1.7 * t + i)
        speed = np.gradient(place) * RATE_HZ
        states[f"log{i}"] = {
            "place_m": place,
            "speed_m_s": speed,
            "force_n": 400.0 * place + 30.0 * random.standard_normal(count),
        }
        residuals[f"log{i}"] = 0.01 * (gap(speed) + random.standard_normal(count))
    floor = Floor("link", 0.01, np.zeros(16), 0.01)
    return fit_generic("link", residuals, designed(residuals, states, floor, rate_hz))


def test_large_gap_is_foreseen_on_blocks_left_out_and_its_terms_are_named():
    fit = fitted(lambda speed: 6.0 * np.sign(speed))
    assert fit.before > 30.0 and fit.after < 3.0
    assert "speed_m_s" in fit.ranked[0][0]


def test_noise_alone_is_left_as_it_is():
    fit = fitted(lambda speed: 0.0 * speed)
    assert abs(fit.before - 1.0) < 0.1 and fit.before - fit.after < 0.02


@pytest.mark.parametrize("rate_hz", [0.1, 1.0, 4.0])
def test_a_slow_logger_has_blocks_too(rate_hz):
    """Rows every second: four seconds of them are less than the whitening filter takes from every
    block.
    """
    fit = fitted(lambda speed: 6.0 * np.sign(speed), rate_hz=rate_hz, count=600)
    assert fit.samples > 600 and fit.before > 30.0


def test_what_stands_still_has_no_terms_and_a_residual_all_the_same():
    states = {"log": {"place_m": np.zeros(900)}}
    residuals = {"log": 0.01 * np.random.default_rng(1).standard_normal(900)}
    fit = fit_generic(
        "link",
        residuals,
        designed(residuals, states, Floor("link", 0.01, np.zeros(16), 0.01), RATE_HZ),
    )
    assert fit.samples > 700 and not fit.ranked and abs(fit.before - 1.0) < 0.2

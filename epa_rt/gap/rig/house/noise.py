"""How noisy a recording's instruments are, from the recording alone, with their steps taken into
account.
"""

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.gap.likelihood.colour import THIRD
from epa_rt.gap.rig.house.channels import Channel

if TYPE_CHECKING:
    from epa_rt.gap.rig.house.prepared import Prepared
    from epa_rt.gap.rig.house.readings import Readings

WINDOW = 32  # samples
# quantile of the windows that is taken for noise alone: elsewhere the signal itself may be rough
CALM = 0.1
SURE = 0.03  # of a step: less noise than this cannot be told from none
LOUD = 0.8  # of a step: noise that spreads the rounding error by itself
_THIRD = THIRD / np.sqrt(20.0)  # white noise passes with its own size


def noise_of(
    prepared: "Prepared | Readings",
    channels: dict[str, Channel],
    made: "Prepared | Readings | None" = None,
) -> dict[str, float]:
    """Port to the standard deviation of its noise before rounding, in the port's unit.

    ``made``: the same recording as the noise-free plant would have made it; what both have in
    common is no noise.
    """
    found = {}
    for port, channel in channels.items():
        step = (
            slice(prepared.phase, None, prepared.hold)
            if port in ("motor_angle_rad", "motor_speed_rad_s")
            else slice(None)
        )
        values = prepared.readings[port][step]
        found[port] = noise_level(values, channel.step)
        if made is not None and found[port] > 0.0:
            found[port] = min(
                found[port], noise_level(values - made.readings[port][step], channel.step)
            )
    return found


def noise_level(values: np.ndarray, step: float) -> float:
    """Standard deviation of white noise under a reading (N,) that is rounded to ``step``; 0 below
    SURE of a step.
    """
    count = len(values) // WINDOW
    if count < 8:
        return 0.0
    windows = values[: count * WINDOW].reshape(count, WINDOW)
    rough, moved = (
        _rough(windows),
        np.abs(windows[:, WINDOW // 2 :].mean(axis=1) - windows[:, : WINDOW // 2].mean(axis=1)),
    )
    white = float(np.quantile(rough, CALM)) / _quantile_of_white()
    if white > (LOUD * step) ** 2:  # the noise itself spreads the rounding error
        return float(np.sqrt(white - step**2 / 12.0))
    still = (moved < 0.3 * step) & (
        rough < 2.0 * (LOUD * step) ** 2
    )  # rougher than that moves within the window
    if still.sum() < 8:
        found = float(np.sqrt(max(white - step**2 / 12.0, 0.0)))
    else:
        found = _before_rounding(float(np.mean(rough[still])), step)
    return found if found > SURE * step else 0.0


def _rough(windows: np.ndarray) -> np.ndarray:
    """(windows,) mean square of the third differences."""
    third = sum(c * windows[:, i : windows.shape[1] - 3 + i] for i, c in enumerate(_THIRD))
    return np.mean(third**2, axis=1)


@cache
def _quantile_of_white() -> float:
    """The CALM quantile of a window's roughness over its mean, for white noise."""
    return float(
        np.quantile(_rough(np.random.default_rng(0).standard_normal((20000, WINDOW))), CALM)
    )


def _before_rounding(variance: float, step: float) -> float:
    """Noise of a still input whose rounded reading varies by ``variance``: there the rounding error
    itself stands still.
    """
    low, high = 0.0, float(np.sqrt(variance)) + step
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _rounded_variance(middle, step) < variance else (low, middle)
    return middle


def _rounded_variance(sigma: float, step: float) -> float:
    """Mean variance of a rounded reading of a still value, over all places of the value between two
    steps.
    """
    k = np.arange(1, 60)
    standing = np.sum(
        step**2 / (2.0 * np.pi**2 * k**2) * np.exp(-4.0 * np.pi**2 * k**2 * sigma**2 / step**2)
    )
    return sigma**2 + step**2 / 12.0 - float(standing)

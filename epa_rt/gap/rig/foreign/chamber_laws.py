"""Laws of a sealed chamber: how fast its gas leaves, what cooling takes from it, what adds to its
reading.
"""

import numpy as np

from epa_rt.gap.rig.foreign.component import Numbers

CRITICAL = 0.528  # pressure ratio below which air leaves at the speed of sound
KAPPA = 1.4


def rate_pa_s(p: np.ndarray, n: Numbers) -> np.ndarray:
    """dp/dt of the shut-in gas at measured pressure ``p``, (n,), by all leaks."""
    ambient, p = n["atmosphere"], p - n["sensor.zero_pa"]
    over = np.maximum(p - ambient, 0.0)
    rate = -(n["chamber.stand_leak_per_s"] + n["leak.linear_per_s"]) * over
    if n["leak.laminar_per_s"] != 0.0:
        rate = rate - n["leak.laminar_per_s"] * np.maximum(p**2 - ambient**2, 0.0) / (2.0 * ambient)
    if n["leak.orifice_per_s"] != 0.0:
        rate = rate - n["leak.orifice_per_s"] * p * _outflow(ambient / np.maximum(p, ambient))
    if n["leak.power_per_s"] != 0.0:
        rate = (
            rate
            - n["leak.power_per_s"]
            * over
            * np.maximum(over / ambient, 1e-12) ** n["leak.power_ratio"]
        )  # a power below 0 has no value where nothing stands over
    if n["leak.pressure_opened_per_s"] != 0.0:
        rate = rate - n["leak.pressure_opened_per_s"] * np.maximum(p - n["leak.opens_at_pa"], 0.0)
    if n["leak.supply_per_s"] != 0.0:
        rate = rate + n["leak.supply_per_s"] * np.maximum(n["supply"] - p, 0.0)
    if n["walls.stretch_per_pa"] != 0.0:
        rate = rate / (1.0 + n["walls.stretch_per_pa"] * np.maximum(2.0 * p - ambient, 0.0))
    return rate


def _outflow(ratio: np.ndarray) -> np.ndarray:
    """Flow through an orifice over its choked value, by outlet over inlet pressure (ISO 6358
    ellipse's isentropic original).
    """
    at = np.clip(ratio, CRITICAL, 1.0)
    flow = np.sqrt(np.maximum(at ** (2 / KAPPA) - at ** ((KAPPA + 1) / KAPPA), 0.0))
    return flow / np.sqrt(CRITICAL ** (2 / KAPPA) - CRITICAL ** ((KAPPA + 1) / KAPPA))


def added_pa(seconds: np.ndarray, p: np.ndarray, start_pa: float, n: Numbers) -> np.ndarray:
    """What adds to the pressure beside leaks, (n,), up to a constant."""
    return drifts_pa(seconds, p, n) + settling_pa(seconds, start_pa, n)


def drifts_pa(seconds: np.ndarray, p: np.ndarray, n: Numbers) -> np.ndarray:
    """What drifts of cell and ambient add at pressure ``p``, (n,); no leak is driven by it."""
    return n["sensor.drift_pa_s"] * seconds + n["gas.ambient_drift_per_s"] * seconds * p


def settling_pa(seconds: np.ndarray, start_pa: float, n: Numbers) -> np.ndarray:
    """What heat and walls add to the gas since it was filled, (n,), up to a constant."""
    added = np.zeros(np.shape(seconds))
    if n["gas.heat_ratio"] != 0.0:
        added = added + n["gas.heat_ratio"] * start_pa * np.exp(-seconds / n["gas.heat_s"])
    if n["walls.creep_ratio"] != 0.0:
        added = added - n["walls.creep_ratio"] * start_pa * np.log1p(seconds / n["walls.creep_s"])
    if n["walls.uptake_ratio"] != 0.0:
        added = added - n["walls.uptake_ratio"] * start_pa * np.sqrt(seconds)
    return added


def cooled_pa(rate: np.ndarray, period_s: float, n: Numbers) -> np.ndarray:
    """What the gas lacks because it cools as it leaks out, (n,): dh/dt = (kappa - 1) rate - h /
    T.
    """
    from scipy.signal import lfilter

    kept = np.exp(-period_s / n["gas.cooling_s"])
    return lfilter([n["gas.cooling_s"] * (1.0 - kept) * (KAPPA - 1.0)], [1.0, -kept], rate)


def run_pa(start_pa: float, seconds: np.ndarray, step: float, n: Numbers) -> np.ndarray:
    """Pressure from a start on: gas that leaks, and what it lacks by cooling, as two states; it
    leaks by the pressure that heat and walls give it.
    """
    twice = settling_pa(seconds[0] + 0.5 * step * np.arange(2 * len(seconds)), start_pa, n)
    twice -= twice[0]

    def slope(state: np.ndarray, settled_pa: float) -> np.ndarray:
        rate = float(rate_pa_s(state[0] + state[1] + settled_pa, n))
        lacking = (
            (KAPPA - 1.0) * rate - state[1] / n["gas.cooling_s"]
            if n["gas.cooling_s"] != 0.0
            else 0.0
        )
        return np.array([rate, lacking])

    states = np.empty((len(seconds), 2))
    states[0] = start_pa, 0.0
    for k in range(1, len(seconds)):
        here, (begin, middle, end) = states[k - 1], twice[2 * k - 2 : 2 * k + 1]
        k1 = slope(here, begin)
        k2 = slope(here + 0.5 * step * k1, middle)
        k3 = slope(here + 0.5 * step * k2, middle)
        k4 = slope(here + step * k3, end)
        states[k] = here + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    gas = states.sum(axis=1) + twice[: 2 * len(seconds) : 2]
    return gas + drifts_pa(seconds, gas, n)

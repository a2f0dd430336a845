"""A sealed chamber that may lack several effects at once, by an outsider's equations: mass and
energy of the gas, integrated in steps of 10 ms, after a fill of 2 s.

Its gas always cools as it leaks out and warms at the walls. Its plant file has the leak of the
stand alone, some percent off. Nothing here knows the catalogue but by the names of families.
"""

import math

import numpy as np
from numba import njit

from epa_rt.gap.recording import Recording
from scripts.outsider import Outsider, one_trial, strengths

PERIOD_S, SUBSTEPS, FILL_S, HOLD_S = 0.1, 10, 2.0, 120.0
FILLS_PA = (3.0e5, 4.5e5, 6.0e5, 7.5e5)  # absolute, of a log each
OUTSIDE_PA, SUPPLY_PA, ROOM_K, KAPPA = 101325.0, 9e5, 293.0, 1.4
STAND_PER_S, WALL_S = 2.2e-5, 3.0  # the stand's leak; in which gas warms at the walls
NOISE_PA, STEP_PA, RANGE_PA = 100.0, 50.0, 1e6  # of the gauge
CHOKED, CHOKED_FLOW = 0.528, 0.2588  # ratio of pressures below which a flow is no larger, and it
# effect to the families that may rightly name it
FAMILIES = {
    "hole": {"leak"},
    "gap": {"leak"},
    "valve": {"leak_in"},
    "stretch": {"walls"},
    "creep": {"relaxation"},
    "hot": {"relaxation"},
    "room": {"drift"},
    "drift": {"drift"},
    "zero": {"sensor"},
}
# in every chamber
EVERYWHERE = {"gas"}


def drawn(random: np.random.Generator, count: int) -> tuple[tuple[str, ...], np.ndarray]:
    """``count`` effects, each at 0.6 to 1.6 of a strength that one would meet: their names, and
    the numbers of the equations.
    """
    has, strength = strengths(random, FAMILIES, count)
    sign = random.choice([-1.0, 1.0])

    numbers = [
        strength("hole", 1e-3),
        strength("gap", 4e-4),
        strength("valve", 4e-4),
        strength("stretch", 3e-7),
        strength("creep", 2e-3),
        strength("hot", 12.0),
        strength("room", 2e-5) * sign,
        strength("drift", 10.0) * sign,
        strength("zero", 3000.0) * sign,
    ]
    return has, np.array(numbers)


@njit(cache=True)
def _held(filled_pa, rows, n):  # type: ignore[no-untyped-def]
    """(N,) absolute pressure of the hold, Pa."""
    hole, gap, valve, stretch, creep, hot, room, _, _ = n
    step = PERIOD_S / SUBSTEPS
    volume = 1.0 + stretch * (filled_pa - OUTSIDE_PA)
    kelvin = ROOM_K + hot
    gas = filled_pa * volume / kelvin  # amount over the volume that it has at rest
    found = np.zeros(rows)
    p = filled_pa
    for k in range(rows):
        found[k] = p
        for j in range(SUBSTEPS):
            t = (k * SUBSTEPS + j) * step
            ratio = max(OUTSIDE_PA / p, CHOKED)
            flow = math.sqrt(max(ratio ** (2.0 / KAPPA) - ratio ** ((KAPPA + 1.0) / KAPPA), 0.0))
            lost = hole * p * flow / CHOKED_FLOW * math.sqrt(ROOM_K / kelvin)
            lost += gap * (p * p - OUTSIDE_PA * OUTSIDE_PA) / (2.0 * OUTSIDE_PA)
            lost += STAND_PER_S * (p - OUTSIDE_PA)
            gained = valve * (SUPPLY_PA - p)
            wall = ROOM_K * (1.0 + room * t)
            energy = gas * kelvin + step * (
                KAPPA * (gained - lost * kelvin / ROOM_K) + gas * (wall - kelvin) / WALL_S
            )
            gas += step * (gained - lost) / ROOM_K
            kelvin = energy / gas
            for _ in range(3):  # the volume hangs on the pressure, and that on the volume
                volume = (1.0 + stretch * (p - OUTSIDE_PA)) * (
                    1.0 + creep * math.log(1.0 + t / 5.0)
                )
                p = gas * kelvin / volume
    return found


def recorded(
    numbers: np.ndarray, filled_pa: float, name: str, random: np.random.Generator
) -> Recording:
    """A log of a fill and a hold."""
    rows = round(HOLD_S / PERIOD_S)
    climb = np.linspace(OUTSIDE_PA, filled_pa, round(FILL_S / PERIOD_S), endpoint=False)
    pressure = np.concatenate([climb, _held(filled_pa, rows, numbers)])
    t = PERIOD_S * np.arange(len(pressure))
    *_, drift, zero = numbers
    read = pressure + drift * t + zero + random.normal(0.0, NOISE_PA, len(t))
    columns = {"pressure": np.round(read / STEP_PA) * STEP_PA}
    return one_trial(name, "chamber", PERIOD_S, columns)


def made(random: np.random.Generator, count: int) -> Outsider:
    """A chamber with ``count`` effects, its logs, and its files."""
    has, numbers = drawn(random, count)
    fills = [filled * random.uniform(0.95, 1.05) for filled in FILLS_PA]
    logs = [recorded(numbers, filled, f"log{i}", random) for i, filled in enumerate(fills)]
    off = random.uniform(0.8, 1.2)
    return Outsider(
        has,
        round(math.log2(RANGE_PA / STEP_PA)),
        logs,
        f"plant: chamber\nkind: chamber\nchamber: {{stand_leak: {STAND_PER_S * off:.4g} 1/s}}\n",
        "rig: chamber\nkind: chamber\nplant: plant.yaml\nrate: 5 Hz\nlowpass: 2.5 Hz\n"
        "channels: {pressure: pressure}\n"
        f"settings: {{atmosphere: {OUTSIDE_PA} Pa, supply: {SUPPLY_PA} Pa}}\n"
        f"steps: {{pressure: {STEP_PA} Pa}}\n",
    )

"""The rest state a plant starts from: muscles vented, motor still, load where it hangs."""

import math

import numpy as np

from epa_rt.models.blocks import load, muscle, transmission
from epa_rt.models.ports import ANGLE, GAS_C, GAS_MASS, LOAD_PLACE, STATE


def new_state(params: np.ndarray) -> np.ndarray:
    """State of shape (1,), dtype STATE, at rest: atmosphere in the muscles, spool at ``start_travel_m``.

    A mass or a knee lies where its own weight or bias and the end stops balance, vented muscles pulling nothing.
    ``params``: shape (1,), dtype PARAMS.
    """
    p = params[0]
    state = np.zeros(1, STATE)
    s = state[0]
    s["smooth"][ANGLE] = _angle_at(p["transmission"], p["load"]["start_travel_m"])
    s["travel_m"] = p["load"]["start_travel_m"]
    place = _hanging_place(p["load"])
    s["smooth"][LOAD_PLACE] = place
    q, _, _ = load.coordinate(p["load"], place, 0.0)
    for i in range(2):
        m, g = p["muscle"][i], p["gas"][i]
        length = (p["load"][f"rest{i}_m"] + p["load"][f"travel{i}_ratio"] * s["travel_m"]
                  + p["load"][f"load{i}_ratio"] * q)
        volume, _ = muscle.shape(m, g["dead_volume_m3"], length)
        s["length_m"][i] = length
        s["smooth"][GAS_C + i] = g["atmosphere_pa"] * volume ** g["polytropic_ratio"]
        s["smooth"][GAS_MASS + i] = g["atmosphere_pa"] * volume / (g["gas_constant_j_kg_k"] * g["temperature_k"])
    s["pressure_before_pa"][2] = s["pressure_reading_pa"][2] = p["gas"][0]["supply_gauge_pa"]
    s["encoder_angle_rad"] = s["smooth"][ANGLE]
    s["last_target_rad"] = s["smooth"][ANGLE]
    return state


def _angle_at(transmission_params, travel_m: float) -> float:
    """Motor angle at a strap travel, by Newton's method (one step where the spool is round)."""
    angle = travel_m * transmission_params["gear_ratio"] / transmission_params["spool_radius_m"]
    for _ in range(30):
        miss = transmission.geared_travel(transmission_params, angle) - travel_m
        angle -= miss / transmission.travel_per_angle(transmission_params, angle)
    return angle


def _hanging_place(p) -> float:
    """Where the load rests without muscle force, by bisection on its acceleration; 0 for a fixed load."""
    if p["kind_code"] == load.FIXED:
        return 0.0
    low, high = (p["low_m"], p["high_m"]) if p["kind_code"] == load.MASS else (p["low_rad"], p["high_rad"])
    low, high = low - 1.0, high + 1.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        if load.rates(p, middle, 0.0, 0.0, 0.0)[0] > 0.0:
            low = middle
        else:
            high = middle
    return math.nan if not low < high + 1e-6 else 0.5 * (low + high)

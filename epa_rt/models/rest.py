"""The rest state a plant starts from: muscles vented, motor still, load where it hangs."""

import numpy as np

from epa_rt.models.blocks import gas, instruments, load, muscle, sensors, transmission
from epa_rt.models.chain import lengths, write_truth
from epa_rt.models.compiled import compiled
from epa_rt.models.ports import ANGLE, GAS_C, GAS_MASS, LOAD_PLACE, MEMORY, STATE


def new_state(params: np.ndarray) -> np.ndarray:
    """State of shape (1,), dtype STATE, at rest: atmosphere in the muscles, spool at
    ``start_travel_m``.

    A mass or a knee lies where its own weight or bias and the end stops balance, vented muscles
    pulling nothing. ``params``: shape (1,), dtype PARAMS.
    """
    state = np.zeros(1, STATE)
    _lay(params[0], state[0], _hanging_place(params[0]))
    return state


@compiled
def _lay(p, s, place):
    """Writes the rest state with the load at ``place`` into a state of zeros."""
    y = s.smooth
    y[ANGLE] = _angle_at(p.transmission, p.load.start_travel_m)
    s.travel_m = p.load.start_travel_m
    s.geared_m = transmission.geared_travel(p.transmission, y[ANGLE])
    y[LOAD_PLACE] = place
    for i in range(2):
        m, g = p.muscle[i], p.gas[i]
        length = _length(p, i, place)
        volume, _ = muscle.shape(m, g.dead_volume_m3, length)
        s.length_m[i] = length
        y[GAS_C + i] = g.atmosphere_pa * volume ** gas.exponent(g)
        y[GAS_MASS + i] = g.atmosphere_pa * volume / (g.gas_constant_j_kg_k * g.temperature_k)
    other = p.gas[1].atmosphere_pa - p.gas[0].atmosphere_pa  # one gauge zero for both
    s.pressure_reading_pa[1] = s.tube_reading_pa[1] = other
    s.pressure_reading_pa[2] = p.gas[0].supply_gauge_pa
    for i in range(3):
        s.pressure_before_pa[i] = s.pressure_reading_pa[i]
    s.encoder_angle_rad = sensors.encoder(p.sensors, y[ANGLE])
    write_truth(p, s)
    instruments.settle(s, s.truth, p.gas[0].atmosphere_pa)


@compiled
def _angle_at(t, travel_m):
    """Motor angle at a strap travel, by Newton's method (one step where the spool is round)."""
    angle = travel_m * t.gear_ratio / t.spool_radius_m
    for _ in range(30):
        miss = transmission.geared_travel(t, angle) - travel_m
        angle -= miss / transmission.travel_per_angle(t, angle)
    return angle


@compiled
def _length(p, i, place):
    """Length of muscle i with the spool at its start and the load at ``place``."""
    q, _, _ = load.coordinate(p.load, place, 0.0)
    strap, _ = transmission.strap_travel(p.transmission, p.load.start_travel_m)
    return lengths(p.load, i, strap, 0.0, q, 0.0)[0]


@compiled
def _vented_force(p, i, place):
    """What muscle i holds without pressure: bladder and locked braid."""
    if p.muscle[i].present < 0.5:
        return 0.0
    return muscle.tension(
        p.muscle[i], 0.0, 0.0, _length(p, i, place), 0.0, np.zeros(MEMORY), 0.0, 0.0
    )


@compiled
def _balance(p, low, high):
    """Where the load's acceleration changes sign between two places, by bisection."""
    for _ in range(80):
        middle = 0.5 * (low + high)
        pull = load.along_load(p.load, _vented_force(p, 0, middle), _vented_force(p, 1, middle))
        if load.rates(p.load, middle, 0.0, 0.0, pull)[0] > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _hanging_place(p) -> float:
    """Where the load rests; 0 for a fixed load."""
    kind = p["load"]["kind_code"]
    if kind == load.FIXED:
        return 0.0
    unit = "m" if kind == load.MASS else "rad"
    return _balance(p, p["load"][f"low_{unit}"] - 1.0, p["load"][f"high_{unit}"] + 1.0)

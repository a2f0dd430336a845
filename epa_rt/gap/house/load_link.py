"""Torque or force balance of the load along its measured motion."""

from epa_rt.gap.house.compiled import compiled
from epa_rt.models.blocks import load


@compiled
def load_balance(params, place, speed, acceleration, force0, force1, period_s, out):
    """Inertia's torque (N m; of a mass its force, N) measured minus predicted from the muscles' forces, (N,)."""
    p = params[0].load
    stuck = 0.0
    inertia = p.mass_kg + p.payload_kg
    if p.kind_code == load.KNEE:
        inertia = p.inertia_kg_m2 + p.payload_kg * p.mass_lever_m * p.mass_lever_m
    for k in range(len(place)):
        pull = load.along_load(p, force0[k], force1[k])
        predicted, rate = load.rates(p, place[k], speed[k], stuck, pull)
        step = period_s * rate
        stuck += step
        out[k] = inertia * (acceleration[k] - predicted)

"""Acceleration of the load from the muscles' forces along its measured motion."""

import math

from epa_rt.gap.rig.house.compiled import compiled
from epa_rt.models.blocks import load


@compiled
def load_acceleration(params, place, speed, force0, force1, period_s, out):
    """Acceleration (rad/s^2 or m/s^2, (N,)) that forces (N) give a load at a measured place and
    speed.

    Predicted, not the balance of torques: the noise of a measured acceleration must not go into any
    knob's derivative.
    """
    p = params[0].load
    stuck = 0.0
    fade = math.exp(-period_s / p.presliding_time_s)
    for k in range(len(place)):
        out[k], rate = load.rates(
            p, place[k], speed[k], stuck, load.along_load(p, force0[k], force1[k])
        )
        if rate == load.sticking_rate(p, stuck, speed[k]):
            stuck += period_s * rate
        else:
            stuck += p.presliding_time_s * rate * (1.0 - fade)

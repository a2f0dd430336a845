"""Measured motion as the plant has it: motor angle past its encoder, muscle lengths past gear,
play, wiring and straps.
"""

import math

import numpy as np

from epa_rt.gap.rig.house.compiled import compiled
from epa_rt.models.blocks import braid, load, muscle, sensors, transmission
from epa_rt.models.chain import lengths
from epa_rt.models.ports import BRANCHES


@compiled
def true_angle(p, slow, fast, angle_fast_gain, out):
    """Motor angle (N,) from the part of the angle reading and that of the speed reading."""
    for k in range(len(out)):
        seen = (slow[k] - p.motor_angle_offset_rad) / p.motor_angle_gain_ratio + fast[
            k
        ] / angle_fast_gain
        angle = seen
        if p.encoder_eccentricity_rad != 0.0:
            for _ in range(3):
                angle = seen - sensors.out_of_round(p, angle)
        out[k] = angle


@compiled
def line_lengths(params, i, angle, speed, place, place_speed, out):
    """Length of muscle i's line (out[0]) and its speed (out[1]) from motor and load motion, the
    play centred at first.
    """
    t, l = params[0].transmission, params[0].load
    travel = before = transmission.geared_travel(t, angle[0])
    for k in range(len(angle)):
        geared = transmission.geared_travel(t, angle[k])
        travel, carried = transmission.play(t, geared, before, travel, speed[k])
        before = geared
        travel_speed = carried * transmission.travel_per_angle(t, angle[k]) * speed[k]
        q, q_speed, _ = load.coordinate(l, place[k], place_speed[k])
        out[0, k], out[1, k] = lengths(l, i, travel, travel_speed, q, q_speed)


@compiled
def crept(branch, rate, time_s, period_s):
    """Force of a creep branch (N) after a cycle in which its spring was loaded at ``rate``
    (N/s).
    """
    fall = math.exp(-period_s / time_s)
    return fall * branch + rate * time_s * (1.0 - fall)


@compiled
def pulls(params, state, i, gauge, length, speed, period_s, out):
    """Force of muscle i (N,) from gauge pressure, line length and its speed; the force of the cycle
    before stretches the strap. ``state``: a fresh STATE (1,), whose braid is moved: to an array of
    its own every cycle would count its references twice, which takes as long as the force itself.
    """
    m, memory = params[0].muscle[i], state[0].memory[i]
    creep, strap, before = np.zeros(BRANCHES), 0.0, length[0]
    for k in range(len(length)):
        fitted = length[k] - muscle.strap_stretch(m, strap)
        braid.settle(m, memory, fitted - before, speed[k])
        if m.creep_stiffness_n_m != 0.0:
            for j in range(BRANCHES):
                stiffness, time_s = muscle.creep_branch(m, j)
                creep[j] = crept(
                    creep[j], stiffness * 0.5 * (speed[k] + speed[max(k - 1, 0)]), time_s, period_s
                )
        _, slope = muscle.shape(m, 0.0, fitted)
        strap = muscle.tension(
            m, slope, gauge[k], fitted, speed[k], memory, 0.0, muscle.creep_force(creep, 0, 1)
        )
        out[k] = strap
        before = fitted

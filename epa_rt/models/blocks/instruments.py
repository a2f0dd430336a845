"""What instruments do to a truth before gain, offset and noise: late, swinging, slow, bowed,
warming up.
"""

import math

from epa_rt.models.compiled import compiled
from epa_rt.models.ports import (
    PAST_ANGLE,
    PAST_FORCE,
    PAST_GAUGE,
    PAST_JOINT,
    PAST_JOINT_SPEED,
    PAST_SPEED,
    RING,
)


@compiled
def lagged(reading, before, after, lag_s, period_s, decay):
    """First-order lag over one cycle, exact for a true value that runs straight from ``before`` to
    ``after``.

    ``decay`` = exp(-period/lag).
    """
    behind = (after - before) / period_s * lag_s
    return after - behind + (reading - before + behind) * decay


@compiled
def write_past(row, truth, force, atmosphere_pa):
    """One row of the ring that late sensors read."""
    for i in range(2):
        row[PAST_GAUGE + i] = truth.pressure_pa[i] - atmosphere_pa
    row[PAST_GAUGE + 2] = truth.supply_pa - atmosphere_pa
    row[PAST_FORCE] = force
    row[PAST_ANGLE], row[PAST_SPEED] = truth.motor_angle_rad, truth.motor_speed_rad_s
    row[PAST_JOINT], row[PAST_JOINT_SPEED] = truth.joint_angle_rad, truth.joint_speed_rad_s


@compiled
def settle(state, truth, atmosphere_pa):
    """Instruments as after a long rest at ``truth``: load cell, frame, and the past of late
    sensors.
    """
    force = truth.muscle_force_n[0]
    state.force_reading_n = state.force_before_n = state.frame_n = state.frame_before_n = force
    for k in range(RING):
        write_past(state.past[k], truth, force, atmosphere_pa)


@compiled
def late(state, column, present, skew_s, period_s):
    """A truth as it was ``skew_s`` ago, straight between cycles; before the first cycle as at
    rest.
    """
    if skew_s == 0.0:
        return present
    age = min(skew_s / period_s, RING - 2.0)
    whole = math.floor(age)
    part = age - whole
    k = state.cycle
    newer = state.past[(k - whole) % RING, column]
    older = state.past[(k - whole - 1) % RING, column]
    return newer + part * (older - newer)


@compiled
def swung(p, state, force, period_s):
    """The force (N) as the swinging frame passes it on: exact for a force that runs straight over
    the cycle.
    """
    if p.frame_mode_ratio == 0.0:
        return force
    rate = 2.0 * math.pi * p.frame_hz
    damp = p.frame_damping_ratio * rate
    swing = math.sqrt(rate * rate - damp * damp)
    slope = (force - state.frame_before_n) / period_s
    behind = 2.0 * p.frame_damping_ratio / rate * slope
    away, away_rate = state.frame_n - state.frame_before_n + behind, state.frame_n_s - slope
    fade, c, s = (
        math.exp(-damp * period_s),
        math.cos(swing * period_s),
        math.sin(swing * period_s) / swing,
    )
    state.frame_n = force - behind + fade * (away * c + (away_rate + damp * away) * s)
    state.frame_n_s = slope + fade * (away_rate * c - (damp * away_rate + rate * rate * away) * s)
    state.frame_before_n = force
    return force + p.frame_mode_ratio * (state.frame_n - force)


@compiled
def cell_force(p, state, force, period_s):
    """The force behind the load cell's own lag (N); ``force`` is late and swung already."""
    if p.force_lag_s == 0.0:
        return force
    state.force_reading_n = lagged(
        state.force_reading_n,
        state.force_before_n,
        force,
        p.force_lag_s,
        period_s,
        math.exp(-period_s / p.force_lag_s),
    )
    state.force_before_n = force
    return state.force_reading_n


@compiled
def behind_tube(p, state, i, before, period_s):
    """Gauge pressure (Pa) of muscle i as it comes through a slow tube or filter; ``before``: its
    sensor's own a cycle ago.
    """
    if p.gauge_lag_s == 0.0:
        return state.pressure_reading_pa[i]
    state.tube_reading_pa[i] = lagged(
        state.tube_reading_pa[i],
        before,
        state.pressure_reading_pa[i],
        p.gauge_lag_s,
        period_s,
        math.exp(-period_s / p.gauge_lag_s),
    )
    return state.tube_reading_pa[i]


@compiled
def warmed(drift, warm_up_s, cycle, period_s):
    """Shift of a reading that warms up with the run: 0 at the first cycle's start, ``drift`` at the
    end.
    """
    return 0.0 if drift == 0.0 else drift * (1.0 - math.exp(-(cycle + 1) * period_s / warm_up_s))


@compiled
def bowed(value, bow):
    """A value through a characteristic that is not straight but a parabola."""
    return value if bow == 0.0 else value * (1.0 + bow * value)

"""Sensors of the second simulator, written from docs/plant.md: readings of a whole log from the
truths at rest and at every cycle's end.
"""

import math

import numpy as np
from scipy.linalg import expm


def late(values, age_s, period):
    """The truths as old as that; before the first cycle those of the rest state."""
    k = np.arange(len(values))
    return np.interp(k - age_s / period, k, values) if age_s else values


def lagged(values, tau, period):
    if not tau:
        return values
    out = [values[0]]
    for before, now in zip(values, values[1:], strict=False):
        behind = (now - before) * tau / period
        out.append(now - behind + (out[-1] - before + behind) * math.exp(-period / tau))
    return np.array(out)


def framed(s, values, period):
    """A force of which part comes through a frame that swings; straight over a cycle, so that the
    exponential of a matrix solves it.
    """
    part, w = s["frame_mode_ratio"], 2 * math.pi * s["frame_hz"]
    if not part:
        return values
    step = expm(
        period
        * np.array(
            [
                [0, 1, 0, 0],
                [-w * w, -2 * s["frame_damping_ratio"] * w, w * w, 0],
                [0, 0, 0, 1],
                [0, 0, 0, 0],
            ]
        )
    )
    y, rate, out = values[0], 0.0, [values[0]]
    for before, now in zip(values, values[1:], strict=False):
        y, rate = (step @ [y, rate, before, (now - before) / period])[:2]
        out.append(y)
    return values + part * (np.array(out) - values)


def warming(values, bow, drift, tau, period):
    """A reading that bows and drifts; the drift counts from the run's start."""
    k = np.arange(len(values))
    return values * (1 + bow * values) + drift * -np.expm1(-k * period / tau)


def held(values, hold_s, period):
    """An encoder that renews now and then; values[0] is the rest state's."""
    step = max(math.floor(hold_s / period + 0.5), 1)
    k = np.arange(len(values) - 1)
    return np.concatenate([values[:1], values[1 + k - k % step]])


def values_of(p, truth, period):
    """What the devices find, before gain and offset."""
    s, atmosphere, out = p["sensors"], p["gas"][0]["atmosphere_pa"], {}
    for name in ("muscle0_gauge_pa", "muscle1_gauge_pa", "supply_gauge_pa"):
        out[name] = lagged(
            late(truth[name], s["gauge_skew_s"], period), s["pressure_lag_s"], period
        )
    out["muscle0_gauge_pa"] = (
        lagged(out["muscle0_gauge_pa"], s["gauge_lag_s"], period)
        + s["gauge_crosstalk_pa_n"] * truth["force_n"]
    )
    out["muscle1_gauge_pa"] = lagged(out["muscle1_gauge_pa"], s["gauge_lag_s"], period)
    for i in (0, 1):
        name = f"muscle{i}_gauge_pa"
        out[name] = warming(
            out[name],
            s[f"muscle{i}_gauge_bow_per_pa"],
            s[f"muscle{i}_gauge_drift_pa"],
            s["gauge_warm_up_s"],
            period,
        )
    force = lagged(
        late(framed(s, truth["force_n"], period), s["force_skew_s"], period),
        s["force_lag_s"],
        period,
    )
    force = force + s["force_crosstalk_n_pa"] * (truth["muscle0_pa"] - atmosphere)
    out["force_n"] = warming(
        force, s["force_bow_per_n"], s["force_drift_n"], s["force_warm_up_s"], period
    )
    angle = late(truth["motor_angle_rad"], s["encoder_skew_s"], period)
    turn = angle + s["encoder_phase_rad"]
    wave = (
        np.sin(turn)
        + s["encoder_twice_sine_ratio"] * np.sin(2 * turn)
        + s["encoder_twice_cosine_ratio"] * np.cos(2 * turn)
    )
    out["motor_angle_rad"] = held(
        angle + s["encoder_eccentricity_rad"] * wave, s["encoder_hold_s"], period
    )
    out["motor_speed_rad_s"] = held(
        late(truth["motor_speed_rad_s"], s["encoder_skew_s"], period), s["encoder_hold_s"], period
    )
    for name in ("joint_angle_rad", "joint_speed_rad_s"):
        out[name] = late(truth[name], s["joint_skew_s"], period)
    return {
        **out,
        "motor_current_a": truth["motor_current_a"],
        "load_position_m": truth["load_position_m"],
    }


def split(channel):
    """Name and unit of a channel: motor_angle, rad."""
    name = next(
        channel[: -len(u)]
        for u in ("_rad_s", "_rad", "_nm", "_pa", "_n", "_a", "_m")
        if channel.endswith(u)
    )
    return name, channel[len(name) + 1 :]


def readings(p, truth, period):
    """Noise-free readings of every channel, without the rest state's."""
    s, found = (
        p["sensors"],
        values_of(p, {name: np.array(values) for name, values in truth.items()}, period),
    )
    current = s["motor_current_gain_ratio"] * found["motor_current_a"] + s["motor_current_offset_a"]
    found["motor_torque_nm"] = p["drive"]["torque_constant_nm_a"] * current
    out = {}
    for channel, values in found.items():
        name, unit = split(channel)
        out[channel] = s[f"{name}_gain_ratio"] * values[1:] + s[f"{name}_offset_{unit}"]
    return out

"""Sensors: what the instruments put out at the end of a cycle, in SI, before any counts."""

import math

import numpy as np

from epa_rt.models.blocks.instruments import (
    behind_tube,
    bowed,
    cell_force,
    lagged,
    late,
    settle,
    swung,
    warmed,
    write_past,
)
from epa_rt.models.blocks.noise import gaussian
from epa_rt.models.blocks.wave import wave
from epa_rt.models.compiled import compiled
from epa_rt.models.ports import (
    PAST_ANGLE,
    PAST_FORCE,
    PAST_GAUGE,
    PAST_JOINT,
    PAST_JOINT_SPEED,
    PAST_SPEED,
    RING,
    SENSORS,
    STATE,
    TRUTH,
)


@compiled
def reading(seed, cycle, channel, true, gain, offset, noise):
    """A reading from its truth: gain, offset, and the channel's own noise."""
    value = gain * true + offset
    if noise != 0.0:
        value += noise * gaussian(seed, cycle, channel)
    return value


@compiled
def encoder(p, angle):
    """Motor angle as an encoder sees it that does not sit in the middle."""
    return angle if p.encoder_eccentricity_rad == 0.0 else angle + out_of_round(p, angle)


@compiled
def out_of_round(p, angle):
    """Error (rad) of an encoder whose disc sits off its centre, and tilted."""
    return p.encoder_eccentricity_rad * wave(
        angle + p.encoder_phase_rad, p.encoder_twice_sine_ratio, p.encoder_twice_cosine_ratio
    )


@compiled
def hold_cycles(p, period_s):
    """Cycles between two renewals of the encoder reading."""
    return max(int(p.encoder_hold_s / period_s + 0.5), 1)


@compiled
def read(p, state, truth, atmosphere_pa, sensors, period_s):
    """Writes all readings of cycle ``state.cycle`` from the truth at its end; moves lags and holds
    in ``state``.
    """
    k = state.cycle
    force = swung(p, state, truth.muscle_force_n[0], period_s)
    if (
        p.gauge_skew_s != 0.0
        or p.force_skew_s != 0.0
        or p.encoder_skew_s != 0.0
        or p.joint_skew_s != 0.0
    ):
        write_past(state.past[k % RING], truth, force, atmosphere_pa)
    decay = math.exp(-period_s / p.pressure_lag_s) if p.pressure_lag_s > 0.0 else 0.0
    before0, before1 = state.pressure_reading_pa[0], state.pressure_reading_pa[1]
    for i in range(3):
        gauge = (truth.pressure_pa[i] if i < 2 else truth.supply_pa) - atmosphere_pa
        gauge = late(state, PAST_GAUGE + i, gauge, p.gauge_skew_s, period_s)
        state.pressure_reading_pa[i] = lagged(
            state.pressure_reading_pa[i],
            state.pressure_before_pa[i],
            gauge,
            p.pressure_lag_s,
            period_s,
            decay,
        )
        state.pressure_before_pa[i] = gauge
    if k % hold_cycles(p, period_s) == 0:
        state.encoder_angle_rad = encoder(
            p, late(state, PAST_ANGLE, truth.motor_angle_rad, p.encoder_skew_s, period_s)
        )
        state.encoder_speed_rad_s = late(
            state, PAST_SPEED, truth.motor_speed_rad_s, p.encoder_skew_s, period_s
        )
    gauge0, gauge1 = (
        behind_tube(p, state, 0, before0, period_s),
        behind_tube(p, state, 1, before1, period_s),
    )
    if p.gauge_crosstalk_pa_n != 0.0:
        gauge0 += p.gauge_crosstalk_pa_n * truth.muscle_force_n[0]
    gauge0 = bowed(gauge0, p.muscle0_gauge_bow_per_pa) + warmed(
        p.muscle0_gauge_drift_pa, p.gauge_warm_up_s, k, period_s
    )
    gauge1 = bowed(gauge1, p.muscle1_gauge_bow_per_pa) + warmed(
        p.muscle1_gauge_drift_pa, p.gauge_warm_up_s, k, period_s
    )
    force = cell_force(p, state, late(state, PAST_FORCE, force, p.force_skew_s, period_s), period_s)
    if p.force_crosstalk_n_pa != 0.0:
        force += p.force_crosstalk_n_pa * (truth.pressure_pa[0] - atmosphere_pa)
    force = bowed(force, p.force_bow_per_n) + warmed(
        p.force_drift_n, p.force_warm_up_s, k, period_s
    )
    joint = late(state, PAST_JOINT, truth.joint_angle_rad, p.joint_skew_s, period_s)
    joint_speed = late(state, PAST_JOINT_SPEED, truth.joint_speed_rad_s, p.joint_skew_s, period_s)
    sensors.motor_angle_rad = reading(
        p.seed,
        k,
        0,
        state.encoder_angle_rad,
        p.motor_angle_gain_ratio,
        p.motor_angle_offset_rad,
        p.motor_angle_noise_rad,
    )
    sensors.motor_speed_rad_s = reading(
        p.seed,
        k,
        1,
        state.encoder_speed_rad_s,
        p.motor_speed_gain_ratio,
        p.motor_speed_offset_rad_s,
        p.motor_speed_noise_rad_s,
    )
    sensors.motor_current_a = reading(
        p.seed,
        k,
        2,
        truth.motor_current_a,
        p.motor_current_gain_ratio,
        p.motor_current_offset_a,
        p.motor_current_noise_a,
    )
    sensors.motor_torque_nm = reading(
        p.seed,
        k,
        3,
        truth.motor_torque_nm,
        p.motor_torque_gain_ratio,
        p.motor_torque_offset_nm,
        p.motor_torque_noise_nm,
    )
    sensors.muscle0_gauge_pa = reading(
        p.seed,
        k,
        4,
        gauge0,
        p.muscle0_gauge_gain_ratio,
        p.muscle0_gauge_offset_pa,
        p.muscle0_gauge_noise_pa,
    )
    sensors.muscle1_gauge_pa = reading(
        p.seed,
        k,
        5,
        gauge1,
        p.muscle1_gauge_gain_ratio,
        p.muscle1_gauge_offset_pa,
        p.muscle1_gauge_noise_pa,
    )
    sensors.supply_gauge_pa = reading(
        p.seed,
        k,
        6,
        state.pressure_reading_pa[2],
        p.supply_gauge_gain_ratio,
        p.supply_gauge_offset_pa,
        p.supply_gauge_noise_pa,
    )
    sensors.force_n = reading(
        p.seed, k, 7, force, p.force_gain_ratio, p.force_offset_n, p.force_noise_n
    )
    sensors.joint_angle_rad = reading(
        p.seed,
        k,
        8,
        joint,
        p.joint_angle_gain_ratio,
        p.joint_angle_offset_rad,
        p.joint_angle_noise_rad,
    )
    sensors.joint_speed_rad_s = reading(
        p.seed,
        k,
        9,
        joint_speed,
        p.joint_speed_gain_ratio,
        p.joint_speed_offset_rad_s,
        p.joint_speed_noise_rad_s,
    )
    sensors.load_position_m = reading(
        p.seed,
        k,
        10,
        truth.load_position_m,
        p.load_position_gain_ratio,
        p.load_position_offset_m,
        p.load_position_noise_m,
    )


def sensors_over_log(params, truth, period_s):
    """Readings, (N,) SENSORS, from a log of truths at the cycle ends, (N,) TRUTH (unmeasured fields
    may be zero).

    Lags start settled at the first truth.
    """
    state, out = np.zeros(1, STATE), np.zeros(len(truth), SENSORS)
    atmosphere_pa = params["gas"][0, 0]["atmosphere_pa"]
    state["pressure_reading_pa"][0, :2] = truth["pressure_pa"][0] - atmosphere_pa
    state["pressure_reading_pa"][0, 2] = truth["supply_pa"][0] - atmosphere_pa
    state["pressure_before_pa"] = state["pressure_reading_pa"]
    state["tube_reading_pa"] = state["pressure_reading_pa"][:, :2]
    settle(state[0], np.ascontiguousarray(truth[:1], TRUTH)[0], atmosphere_pa)
    _over_log(params, state, np.ascontiguousarray(truth, TRUTH), period_s, out)
    return out


@compiled
def _over_log(params, state, truth, period_s, out):
    s = state[0]
    for k in range(truth.shape[0]):
        read(params[0].sensors, s, truth[k], params[0].gas[0].atmosphere_pa, out[k], period_s)
        s.cycle += 1

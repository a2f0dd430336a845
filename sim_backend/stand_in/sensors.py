"""Readings of the stand-in at the end of a cycle. Equations: docs/plant.md (Sensors); hidden ones
said here.
"""

import math

import numpy as np

from sim_backend.stand_in import knee
from sim_backend.stand_in.compiled import compiled
from sim_backend.stand_in.records import (
    ANGLE,
    CURRENT,
    FORCE_LAG,
    LAG,
    LAG2,
    PLACE,
    RATE,
    RING,
    SPEED,
)
from sim_backend.stand_in.whole import tension, travel_of

_A, _B, _C = (
    np.uint64(6364136223846793005),
    np.uint64(1442695040888963407),
    np.uint64(0xD6E8FEB86659FD93),
)
_S32, _S11 = np.uint64(32), np.uint64(11)


@compiled
def scrambled(x):
    """64 mixed bits of a counter (two rounds of multiply and xor-shift)."""
    for _ in range(2):
        x = (x ^ (x >> _S32)) * _C
    return x ^ (x >> _S32)


@compiled
def normal(seed, cycle, channel):
    """A normal number (Box-Muller) of seed, cycle and channel."""
    key = (
        scrambled(np.uint64(seed) * _A + _B)
        + np.uint64(cycle) * np.uint64(32)
        + np.uint64(2 * channel)
    )
    u = (float(scrambled(key * _A + _B) >> _S11) + 0.5) / 9007199254740992.0
    v = (float(scrambled((key + np.uint64(1)) * _A + _B) >> _S11) + 0.5) / 9007199254740992.0
    return math.sqrt(-2.0 * math.log(u)) * math.cos(2.0 * math.pi * v)


@compiled
def drift(h, size, seconds):
    """Hidden drift of an instrument that warms: an exponential and a slope that goes on."""
    return size * (1.0 - math.exp(-seconds / h.drift_time_s) + 0.004 * seconds / h.drift_time_s)


@compiled
def _pressure(h, s, y, j):
    """A pressure sensor's reading before gain: lagged; hidden: it sticks within
    ``pressure_stick_pa``.
    """
    value = y[LAG2 + j] if h.pressure_time_s != 0.0 else y[LAG + j]
    if j < 2 and h.pressure_stick_pa != 0.0:
        half = 0.5 * h.pressure_stick_pa
        s.stick_pa[j] = min(max(s.stick_pa[j], value - half), value + half)
        value = s.stick_pa[j]
    return value


@compiled
def encoder(p, s, y, period_s):
    """Angle and speed as the drive's encoder has them; hidden: off its centre with a second
    harmonic, and some time old.
    """
    h, k = p.hidden, s.cycle
    angle = y[ANGLE]
    if h.encoder_wobble_rad != 0.0:
        turn = angle + h.encoder_phase_rad
        angle += h.encoder_wobble_rad * (math.sin(turn) + 0.2 * math.sin(2.0 * turn + 0.4))
    s.encoder[k % RING, 0], s.encoder[k % RING, 1] = angle, y[SPEED]
    hold = max(int(p.sensors.encoder_hold_s / period_s + 0.5), 1)
    if k % hold == 0:
        old = h.encoder_age_s / period_s
        whole = int(math.floor(old))
        part = old - whole
        a, b = max(k - whole, 0) % RING, max(k - whole - 1, 0) % RING
        for c in range(2):
            s.held[c] = (
                (1.0 - part) * s.encoder[a, c] + part * s.encoder[b, c]
                if old > 0.0
                else s.encoder[a, c]
            )


@compiled
def read(p, s, out, period_s):
    """Writes the readings of cycle ``s.cycle``."""
    h, z, y, k = p.hidden, p.sensors, s.y, s.cycle
    seconds = k * period_s
    travel, travel_speed, _ = travel_of(p, s, y)
    q, q_speed, _ = knee.coordinate(p.load, h, y[PLACE], y[RATE])
    encoder(p, s, y, period_s)
    force, _, _, _, _ = tension(p, s, y, 0, travel, travel_speed, q, q_speed)
    if h.force_time_s != 0.0:
        force = y[FORCE_LAG]
    gauge0 = y[LAG]
    if h.force_bend_per_n != 0.0 or h.force_cross_n_pa != 0.0:
        force += h.force_bend_per_n * force * force + h.force_cross_n_pa * gauge0
    force = (
        force * (1.0 + h.force_gain_ratio) + h.force_offset_n + drift(h, h.force_drift_n, seconds)
    )
    is_knee = p.load.kind_code == 2.0
    joint = y[PLACE] if is_knee else 0.0
    joint = (
        joint * (1.0 + h.joint_gain_ratio)
        + h.joint_offset_rad
        + h.joint_bend_per_rad * joint * joint
    )
    out.motor_angle_rad = s.held[0] + z.motor_angle_noise_rad * normal(z.seed, k, 0)
    out.motor_speed_rad_s = s.held[1] + z.motor_speed_noise_rad_s * normal(z.seed, k, 1)
    current = y[CURRENT] * (1.0 + h.current_gain_ratio) + h.current_offset_a
    out.motor_current_a = current + z.motor_current_noise_a * normal(z.seed, k, 2)
    out.motor_torque_nm = (
        z.motor_torque_gain_ratio * p.drive.torque_constant_nm_a * current
        + z.motor_torque_noise_nm * normal(z.seed, k, 3)
    )
    off = h.pressure_offset_pa + drift(h, h.pressure_drift_pa, seconds)
    out.muscle0_gauge_pa = (
        _pressure(h, s, y, 0) * (1.0 + h.pressure_gain_ratio)
        + off
        + z.muscle0_gauge_noise_pa * normal(z.seed, k, 4)
    )
    out.muscle1_gauge_pa = _pressure(h, s, y, 1) + z.muscle1_gauge_noise_pa * normal(z.seed, k, 5)
    out.supply_gauge_pa = _pressure(h, s, y, 2) + z.supply_gauge_noise_pa * normal(z.seed, k, 6)
    out.force_n = force + z.force_noise_n * normal(z.seed, k, 7)
    out.joint_angle_rad = joint + z.joint_angle_noise_rad * normal(z.seed, k, 8)
    out.joint_speed_rad_s = (y[RATE] if is_knee else 0.0) + z.joint_speed_noise_rad_s * normal(
        z.seed, k, 9
    )
    out.load_position_m = q + z.load_position_noise_m * normal(z.seed, k, 10)

"""Drive and motor along the measured motion: commands to current, and motion with load to
current.
"""

import math

from epa_rt.gap.rig.house.compiled import compiled
from epa_rt.models.blocks import bus, drive, motor, transmission
from epa_rt.models.blocks.friction import slider

STEPS = 2
# the speed loop's integral is led to the measured current this slowly: rounding must not add up in
# it
WATCH_S = 0.5
STANDING_S = (
    0.05  # and this fast where only rounding is left of the motion, or nothing is known of it
)


@compiled
def warmth(p, current, period_s, out):
    """What a current (N,) makes of motor.warmth (K, (N,)), from a cold start."""
    heat, slow_heat, part, slow_part = (
        0.0,
        0.0,
        period_s / p.winding_time_s,
        period_s / p.housing_time_s,
    )
    for k in range(len(current)):
        end = p.winding_thermal_k_w * p.winding_ohm * current[k] * current[k]
        heat += part * (end - heat)
        slow_heat += slow_part * (end - slow_heat)
        out[k] = motor.warmth(p, heat, slow_heat)


@compiled
def drive_current(params, state, commands, angle, speed, measured_a, led, warmth_k, period_s, out):
    """Winding current (N,) from the commands and the measured motion; its integral follows
    ``measured_a`` slowly, where it is ``led`` (N,) quickly.
    """
    p, s = params[0].drive, state[0]
    delay = params[0].bus.command_delay_s / period_s
    current, integral = 0.0, 0.0
    h = period_s / STEPS
    fade = math.exp(-h / p.current_lag_s)
    for k in range(len(angle)):
        bus.latch(s, commands[k], period_s)
        seen = k + math.floor(-delay)
        now, before = s.ring[seen % bus.RING], s.ring[(seen - 1) % bus.RING]
        integral = drive.integral_at_edge(now, before, integral, current)
        b = max(k - 1, 0)
        for j in range(STEPS):
            wanted = bus.motor_seen(s.ring, k, j / STEPS - delay, (j + 1) / STEPS - delay)
            a, w = drive.cubic(angle[b], angle[k], speed[b], speed[k], period_s, (j + 0.5) / STEPS)
            _, rate = drive.rates(p, wanted, 0.5, a, w, integral, current, warmth_k[k])
            di, _ = drive.rates(
                p, wanted, 0.5, a, w, integral + 0.5 * h * rate, current, warmth_k[k]
            )
            current += di * p.current_lag_s * (1.0 - fade)
            integral += h * rate
        if now[0] > 0.5:
            integral += period_s / (STANDING_S if led[k] else WATCH_S) * (measured_a[k] - current)
        s.cycle += 1
        out[k] = current


def balance_current(params, angle, speed, acceleration, spool_n, warmth_k, period_s, out):
    """Current (N,) that the measured motion needs against inertia, friction, gear and the spool's
    force (N,).
    """
    balance_torque(params, angle, speed, acceleration, spool_n, period_s, out)
    current_for(params, out, angle, warmth_k, out)


@compiled
def current_for(params, torque, angle, warmth_k, out):
    """Current (N,) that gives the shaft a torque (N,); ``out`` may be the torque's own array."""
    p = params[0].drive
    for k in range(len(angle)):
        out[k] = motor.current_for(p, torque[k], angle[k], warmth_k[k])


@compiled
def balance_torque(params, angle, speed, acceleration, spool_n, period_s, out):
    """Torque on the shaft (N,), N*m, that the measured motion needs: as ``balance_current``."""
    p, t = params[0].drive, params[0].transmission
    h = period_s / STEPS
    fade = math.exp(-h / p.presliding_time_s)
    stuck = 0.0
    for k in range(len(angle)):
        load = spool_n[k] * transmission.travel_per_angle(t, angle[k])
        b = max(k - 1, 0)
        for j in range(STEPS):
            w = speed[b] + (speed[k] - speed[b]) * (j + 0.5) / STEPS
            low, high = transmission.friction_limits(t, load, w)
            dry = motor.dry_limit(p, w, angle[k])
            force, rate = slider(
                p.presliding_stiffness_nm_rad, p.presliding_time_s, stuck, w, low - dry, high + dry
            )
            if rate == w:
                stuck += h * w
            else:
                stuck = (
                    force / p.presliding_stiffness_nm_rad
                    + (stuck - force / p.presliding_stiffness_nm_rad) * fade
                )
        low, high = transmission.friction_limits(t, load, speed[k])
        dry = motor.dry_limit(p, speed[k], angle[k])
        friction, _ = slider(
            p.presliding_stiffness_nm_rad,
            p.presliding_time_s,
            stuck,
            speed[k],
            low - dry,
            high + dry,
        )
        out[k] = (
            p.inertia_kg_m2 * acceleration[k]
            + friction
            + motor.drag(p, speed[k])
            + load
            + transmission.sliding_torque(t, p.inertia_kg_m2, load, speed[k])
        )

"""Drive, motor, gear and spool of the stand-in. Equations: docs/plant.md (Drive, Transmission);
hidden ones said here.
"""

import math

from sim_backend.stand_in.compiled import compiled

SPEED_LOOP, TORQUE_LOOP = 9.0, 10.0


@compiled
def new_line(line, command, period_s):
    """Straight lines of the targets over the cycle that begins; returns 1 where a speed loop
    starts, -1 where none runs.
    """
    was_on, was_mode = line[0] > 0.5, line[1]
    on, mode = command.enabled > 0.5, command.mode
    last_angle, last_slope, last_speed = line[3], line[5], line[7]
    line[0], line[1] = command.enabled, mode
    line[2] = line[3] = command.target_angle_rad
    line[4] = line[5] = 0.0
    line[6] = line[7] = command.target_speed_rad_s
    if on and was_on and mode == was_mode == SPEED_LOOP:
        line[6] = last_speed
    elif on and was_on and mode == 8.0 and was_mode == 8.0:
        line[2], line[4] = last_angle, last_slope
        line[5] = (line[3] - line[2]) / period_s
    elif on and was_on and mode == 8.0 and was_mode == SPEED_LOOP:
        line[4] = line[5] = last_speed
        line[2] = line[3] - last_speed * period_s
    if not on or mode == TORQUE_LOOP:
        return -1
    return 1 if (not was_on or was_mode == TORQUE_LOOP) else 0


@compiled
def loops(d, line, target, slope, wanted_speed, torque, angle, speed, integral):
    """Current command before the voltage limit and the rate of the speed loop's integral."""
    if line[0] <= 0.5:
        return 0.0, 0.0
    if line[1] == TORQUE_LOOP:
        return min(max(torque / d.torque_constant_nm_a, -d.max_current_a), d.max_current_a), 0.0
    if line[1] != SPEED_LOOP:
        wanted_speed = d.position_gain_per_s * (target - angle) + d.feedforward_ratio * slope
    error = min(max(wanted_speed, -d.max_speed_rad_s), d.max_speed_rad_s) - speed
    free = d.speed_gain_a_s_rad * error + integral
    held = min(max(free, -d.max_current_a), d.max_current_a)
    rate = d.speed_integral_a_rad * error
    if held != free:
        rate += d.speed_integral_a_rad / d.speed_gain_a_s_rad * (held - free)
    return held, rate


@compiled
def constant(d, h, heat, housing):
    """Torque constant; hidden: magnets of the whole motor lose it exponentially with winding and
    housing heat.
    """
    if h.heat_loss_per_k == 0.0:
        return d.torque_constant_nm_a
    return d.torque_constant_nm_a * math.exp(-h.heat_loss_per_k * (0.5 * heat + housing))


@compiled
def reachable(d, h, kt, wanted, current, speed):
    """The current command that the voltage can drive; hidden: a supply that sags with the power
    drawn, not the current.
    """
    volt = d.supply_v
    if h.sag_ohm != 0.0:
        power = max((d.winding_ohm * current + kt * speed) * current, 0.0)
        volt = 0.5 * (volt + math.sqrt(max(volt * volt - 4.0 * h.sag_ohm * power, 0.0)))
    high, low = (volt - kt * speed) / d.winding_ohm, (-volt - kt * speed) / d.winding_ohm
    return min(max(wanted, low), high)


@compiled
def torque(h, kt, current, angle):
    """Shaft torque; hidden: ripple as rectified sines of six steps a turn, cogging with its second
    harmonic.
    """
    out = kt * current
    if h.ripple_ratio != 0.0:
        out *= 1.0 + h.ripple_ratio * (
            2.356 * abs(math.sin(3.0 * angle + h.ripple_phase_rad)) - 1.5
        )
    if h.cogging_nm != 0.0:
        turn = 4.0 * angle + h.cogging_phase_rad
        out += h.cogging_nm * (math.sin(turn) + 0.25 * math.sin(2.0 * turn + 0.7))
    return out


@compiled
def dry(d, h, stuck, speed, angle, extra_nm):
    """Dry friction of the shaft and the rate of its deflection.

    Hidden: a Stribeck rise that falls as 1/(1 + (w/ws)^2), and a rub that comes and goes with the
    spool's turn (``extra_nm``).
    """
    limit = d.coulomb_nm + extra_nm
    if h.stribeck_nm != 0.0:
        limit += h.stribeck_nm / (1.0 + (speed / h.stribeck_rad_s) ** 2)
    force = d.presliding_stiffness_nm_rad * (stuck + d.presliding_time_s * speed)
    if -limit <= force <= limit:
        return force, speed
    force = limit if force > 0.0 else -limit
    return force, (force / d.presliding_stiffness_nm_rad - stuck) / d.presliding_time_s


@compiled
def gear_loss(t, h, load_nm, speed):
    """Hidden friction torque of the gear: a dry part and a part that grows with the load, both
    smooth in speed.
    """
    if h.gear_dry_n == 0.0 and h.mesh_loss_ratio == 0.0:
        return 0.0
    size = h.gear_dry_n * t.spool_radius_m / t.gear_ratio + h.mesh_loss_ratio * abs(load_nm)
    return size * math.tanh(speed / h.gear_smooth_rad_s)


@compiled
def wound(t, h, angle):
    """Strap wound by the motor angle and its slope; hidden: a spool off its centre, and layers that
    widen it.
    """
    turn = angle / t.gear_ratio
    travel, slope = t.spool_radius_m * turn, t.spool_radius_m
    if h.wobble_ratio != 0.0:
        e, f = h.wobble_ratio, h.wobble_phase_rad
        travel += t.spool_radius_m * (
            e * (math.sin(turn + f) - math.sin(f))
            + 0.25 * e * e * (math.sin(2.0 * (turn + f)) - math.sin(2.0 * f))
        )
        slope += t.spool_radius_m * (
            e * math.cos(turn + f) + 0.5 * e * e * math.cos(2.0 * (turn + f))
        )
    if h.layer_per_rad != 0.0:
        travel += 0.5 * t.spool_radius_m * h.layer_per_rad * turn * turn
        slope += t.spool_radius_m * h.layer_per_rad * turn
    return travel, slope / t.gear_ratio

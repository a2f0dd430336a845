"""Gear and spool: motor angle to strap travel, strap force to motor torque and to the gear's share
of dry friction.
"""

import math

import numpy as np

from epa_rt.models.compiled import compiled

SLIDING_RAD_S = 0.5  # speed at which friction that holds nothing at rest builds up at least
# and later where it would bring the shaft to rest sooner than this: what is steeper, a sub-step of
# a millisecond does not follow
FOLLOWED_S = 7e-4
FULL_DEPTH_M = 1e-3  # of an end stop, from which all of its damping is there
ALL_THERE = 1e9  # times the speed at which friction builds up, beyond which it is all there


@compiled
def geared_travel(p, motor_angle):
    """Strap travel before backlash (m)."""
    if p.eccentricity_ratio == 0.0 and p.wind_up_per_rad == 0.0:
        return p.spool_radius_m / p.gear_ratio * motor_angle
    turn = motor_angle / p.gear_ratio
    phase = p.eccentricity_phase_rad
    return p.spool_radius_m * (
        turn
        + 0.5 * p.wind_up_per_rad * turn * turn
        - p.eccentricity_ratio * (math.cos(turn + phase) - math.cos(phase))
    )


@compiled
def travel_per_angle(p, motor_angle):
    """Slope of strap travel over motor angle (m/rad)."""
    if p.eccentricity_ratio == 0.0 and p.wind_up_per_rad == 0.0:
        return p.spool_radius_m / p.gear_ratio
    turn = motor_angle / p.gear_ratio
    radius = (
        1.0
        + p.wind_up_per_rad * turn
        + p.eccentricity_ratio * math.sin(turn + p.eccentricity_phase_rad)
    )
    return p.spool_radius_m * radius / p.gear_ratio


@compiled
def play(p, geared, geared_before, travel_before, speed):
    """Strap travel behind the backlash (m): stays where it was until the play is used up, at once
    or gradually.

    ``geared``: travel before backlash, ``geared_before`` where that and ``travel_before`` stood
    last (m). Second value: part of the motion that is carried (0 to 1), where nothing moved for
    motion with ``speed`` (any unit: only its sign counts). How a play that is not the same all
    around changes meanwhile moves the strap, but has no part in that.
    """
    half = 0.5 * p.backlash_rad * p.spool_radius_m
    if p.uneven_backlash_rad != 0.0:
        wave = math.sin(
            p.backlash_per_turn_ratio * geared / p.spool_radius_m + p.backlash_phase_rad
        )
        if p.backlash_narrowness_ratio != 1.0:
            wave = 2.0 * (0.5 * (1.0 + wave)) ** p.backlash_narrowness_ratio - 1.0
        half += (
            0.5 * p.uneven_backlash_rad * p.spool_radius_m * (1.0 + p.backlash_wave_ratio * wave)
        )
    if half == 0.0:
        return geared, 1.0
    if p.backlash_roundness_ratio != 0.0:
        return round_play(
            p.backlash_roundness_ratio, half, geared, geared_before, travel_before, speed
        )
    if travel_before > geared + half:
        return geared + half, 1.0
    if travel_before < geared - half:
        return geared - half, 1.0
    # at a flank with nothing moved since, as at the start and end of a sub-step, the speed says
    # whether it is carried
    carried = (travel_before == geared - half and speed > 0.0) or (
        travel_before == geared + half and speed < 0.0
    )
    return travel_before, 1.0 if carried else 0.0


@compiled
def round_play(roundness, half, geared, geared_before, travel_before, speed):
    """As ``play`` with teeth that take up gradually: e' = slope(|e|) outwards, 1 inwards, of the
    gap e = geared - travel.
    """
    moved = geared - geared_before
    toward = 1.0 if moved > 0.0 or (moved == 0.0 and speed > 0.0) else -1.0
    at, way = toward * (geared_before - travel_before) / half, abs(moved) / half
    if at + way < 0.0:
        return travel_before, 0.0  # back inside the gap, which has no memory of how it was closed
    taken = used_up(roundness, min(max(at, 0.0), 1.0), way + min(at, 0.0))
    return geared - toward * half * taken, carried_at(roundness, taken)


@compiled
def used_up(roundness, at, way):
    """Part of half the play that is used up (0 to 1) after a ``way`` outwards (over half the play)
    from ``at``.

    From the middle it is (1 - exp(-x^(1/roundness)))^roundness over the way x. Inverted and moved
    on: exact for any step.
    """
    before = closed(roundness, at)
    if before == 1.0:
        return 1.0
    x = way + (at if before == 0.0 else at * (-math.log1p(-before) / before) ** roundness)
    grown = x ** (1.0 / roundness)
    if grown == 0.0:
        return x  # so far from the flank that nothing is carried yet
    if grown > 1.0:
        return (-math.expm1(-grown)) ** roundness
    return x * (-math.expm1(-grown) / grown) ** roundness


@compiled
def closed(roundness, at):
    """How far the teeth are in contact (0 to 1) where a part ``at`` of half the play is used up."""
    return at ** (1.0 / roundness)


@compiled
def carried_at(roundness, at):
    """Slope of the strap's travel over the gear's (0 to 1) for motion outwards from ``at``: 1 less
    the slope of ``used_up``.
    """
    w = closed(roundness, at)
    if w == 0.0 or w == 1.0:
        return w
    return 1.0 - (1.0 - w) * (-math.log1p(-w) / w) ** (1.0 - roundness)


@compiled
def strap_travel(p, travel):
    """How far the spool at a ``travel`` (m) has pulled the strap in (m), and the slope over travel.

    Where all of the strap is unwound, its end on the spool's rim swings through half a turn and
    lets it out a little further. From there on the spool winds it up the other way.
    """
    if p.strap_on_spool_m == 0.0 or travel >= -p.strap_on_spool_m:
        return travel, 1.0
    turn = -(travel + p.strap_on_spool_m) / p.spool_radius_m
    if turn < math.pi:
        return -p.strap_on_spool_m - p.spool_radius_m * math.sin(turn), math.cos(turn)
    return -p.strap_on_spool_m + p.spool_radius_m * (turn - math.pi), -1.0


@compiled
def stop_force(p, travel, speed):
    """Force (N) of the travel's end stops along positive travel (m, m/s): they push back only.

    Stiffness and damping set in together, so that a stop gives no energy.
    """
    if travel < p.low_stop_m:
        depth = p.low_stop_m - travel
        return max(p.travel_stop_stiffness_n_m * depth - _stop_drag(p, depth) * speed, 0.0)
    if travel > p.high_stop_m:
        depth = travel - p.high_stop_m
        return min(-p.travel_stop_stiffness_n_m * depth - _stop_drag(p, depth) * speed, 0.0)
    return 0.0


@compiled
def _stop_drag(p, depth):
    """Damping (N s/m) of an end stop at a depth: full from ``FULL_DEPTH_M`` on."""
    return p.travel_stop_viscous_n_s_m * min(depth / FULL_DEPTH_M, 1.0)


@compiled
def built_up(p, speed, build_up_speed):
    """Part of the gear's friction that is there at a speed (rad/s, not negative)."""
    if speed > ALL_THERE * build_up_speed:  # powers of what is larger overflow
        return 1.0
    s = speed / build_up_speed
    if p.gear_friction_sharpness_ratio == 1.0:
        return s / (1.0 + s)
    return s / (1.0 + s**p.gear_friction_sharpness_ratio) ** (1.0 / p.gear_friction_sharpness_ratio)


@compiled
def friction_limits(p, load_torque, speed):
    """Low and high limit of the gear's friction torque at the motor (N m), wider the more it
    transmits; without what is there in motion alone.

    It is there at once, or builds up with the motor's ``speed`` (rad/s): regularised Coulomb
    friction.
    """
    low, high = _limits(p, load_torque)
    if p.gear_friction_speed_rad_s != 0.0:
        there = built_up(p, abs(speed), p.gear_friction_speed_rad_s)
        low, high = low * there, high * there
    if p.gear_sliding_ratio != 0.0:
        low, high = low * (1.0 - p.gear_sliding_ratio), high * (1.0 - p.gear_sliding_ratio)
    return low, high


@compiled
def sliding_torque(p, inertia_kg_m2, load_torque, speed):
    """Torque (N m) against positive motion of that part of the gear's friction that holds nothing
    at rest, on a shaft of this inertia.
    """
    if p.gear_sliding_ratio == 0.0:
        return 0.0
    low, high = _limits(p, load_torque)
    build_up_speed = max(
        p.gear_friction_speed_rad_s,
        SLIDING_RAD_S,
        FOLLOWED_S * p.gear_sliding_ratio * max(high, -low) / inertia_kg_m2,
    )
    there = p.gear_sliding_ratio * built_up(p, abs(speed), build_up_speed)
    return there * high if speed >= 0.0 else there * low


@compiled
def _limits(p, load_torque):
    """Low and high limit of all of it (N m).

    Moving against the load costs load/eta, moving with it yields load*eta; the difference to the
    load is friction.
    """
    if p.gear_friction_n == 0.0 and p.gear_efficiency_ratio == 1.0:
        return 0.0, 0.0
    dry = p.gear_friction_n * p.spool_radius_m / p.gear_ratio
    eta = p.gear_efficiency_ratio
    against = abs(load_torque) * (1.0 / eta - 1.0)
    along = abs(load_torque) * (1.0 - eta)
    if load_torque >= 0.0:
        return -dry - along, dry + against
    return -dry - against, dry + along


def transmission_over_log(params, motor_angle_rad, spool_force_n):
    """Strap travel (m) and load torque at the motor (N m) from measured motor angle and spool
    force, all (N,).

    The play starts centred. Friction is not part of the load torque: see ``friction_limits``.
    """
    out = np.zeros((2, len(motor_angle_rad)))
    _over_log(params, np.asarray(motor_angle_rad, float), np.asarray(spool_force_n, float), out)
    return out[0], out[1]


@compiled
def _over_log(params, angle, force, out):
    p = params[0].transmission
    travel = before = geared_travel(p, angle[0])
    for k in range(angle.shape[0]):
        geared = geared_travel(p, angle[k])
        travel, _ = play(p, geared, before, travel, 0.0)
        before = geared
        out[0, k] = travel
        out[1, k] = force[k] * travel_per_angle(p, angle[k])

"""The joined blocks: rates of the whole plant at a state, and the noise-free values behind the
sensors.
"""

from epa_rt.models.blocks import drive, gas, load, motor, muscle, transmission
from epa_rt.models.compiled import compiled
from epa_rt.models.ports import (
    ANGLE,
    BRANCHES,
    CREEP,
    CURRENT,
    GAS_C,
    GAS_MASS,
    HEAT,
    INTEGRAL,
    LOAD_PLACE,
    LOAD_SPEED,
    LOAD_STICTION,
    SLOW_HEAT,
    SPEED,
    STICTION,
    SUPPLY_FLOW,
    SUPPLY_RATE,
)


@compiled
def lengths(p, i, travel, travel_speed, q, q_speed):
    """Length of muscle i's line and its speed, from spool travel and load coordinate (load
    parameters).
    """
    if i == 0:
        return (
            p.rest0_m + p.travel0_ratio * travel + p.load0_ratio * q,
            p.travel0_ratio * travel_speed + p.load0_ratio * q_speed,
        )
    return (
        p.rest1_m + p.travel1_ratio * travel + p.load1_ratio * q,
        p.travel1_ratio * travel_speed + p.load1_ratio * q_speed,
    )


@compiled
def pull(p, s, y, i, travel, travel_speed, q, q_speed):
    """Muscle i at state y: its volume, absolute pressure, line length, speed and force."""
    m, g = p.muscle[i], p.gas[i]
    length, speed = lengths(p.load, i, travel, travel_speed, q, q_speed)
    braid = length - muscle.strap_stretch(m, s.strap_force_n[i])
    volume, slope = muscle.shape(m, g.dead_volume_m3, braid)
    pressure = gas.pressure(g, y[GAS_C + i], volume)
    force = muscle.tension(
        m,
        slope,
        pressure - g.atmosphere_pa,
        braid,
        speed,
        s.memory[i],
        braid - s.length_m[i],
        0.0 if m.creep_stiffness_n_m == 0.0 else muscle.creep_force(y, CREEP + i, 2),
    )
    return volume, pressure, braid, speed, force


@compiled
def muscle_rates(p, s, y, dy, i, travel, travel_speed, q, q_speed):
    """Writes the rates of muscle i's gas and creep; returns its force (N) and the flow it draws
    (kg/s).
    """
    if p.muscle[i].present < 0.5:
        return 0.0, 0.0
    g = p.gas[i]
    volume, pressure, _, speed, force = pull(p, s, y, i, travel, travel_speed, q, q_speed)
    supply = gas.supply_pressure(g, y[SUPPLY_FLOW])
    dy[GAS_C + i], dy[GAS_MASS + i], drawn = gas.rates(
        g, y[GAS_C + i], y[GAS_MASS + i], volume, pressure, supply, s.opening[i, 0], s.opening[i, 1]
    )
    m = p.muscle[i]
    for branch in range(BRANCHES):
        k = CREEP + 2 * branch + i
        if m.creep_stiffness_n_m == 0.0:
            dy[k] = 0.0
        else:
            stiffness, time_s = muscle.creep_branch(m, branch)
            dy[k] = muscle.creep_rate(stiffness, time_s, y[k], speed)
    return force, drawn


@compiled
def rates(p, s, y, dy, seen, part):
    """Rates of all smooth states at y, a ``part`` (0 to 1) into a sub-step in which the drive sees
    ``seen``.
    """
    d, t, l = p.drive, p.transmission, p.load
    angle, speed, current = y[ANGLE], y[SPEED], y[CURRENT]
    travel, carried = transmission.play(
        t, transmission.geared_travel(t, angle), s.geared_m, s.travel_m, speed
    )
    per_angle = transmission.travel_per_angle(t, angle)
    torque = 0.0
    if t.travel_stop_stiffness_n_m != 0.0:
        torque = per_angle * transmission.stop_force(
            t, transmission.geared_travel(t, angle), per_angle * speed
        )
    travel, slope = transmission.strap_travel(t, travel)
    per_angle *= slope
    travel_speed = carried * per_angle * speed
    q, q_speed, _ = load.coordinate(l, y[LOAD_PLACE], y[LOAD_SPEED])
    force0, drawn0 = muscle_rates(p, s, y, dy, 0, travel, travel_speed, q, q_speed)
    force1, drawn1 = muscle_rates(p, s, y, dy, 1, travel, travel_speed, q, q_speed)
    warmth = motor.warmth(d, y[HEAT], y[SLOW_HEAT])
    dy[CURRENT], dy[INTEGRAL] = drive.rates(
        d, seen, part, angle, speed, y[INTEGRAL], current, warmth
    )
    dy[HEAT], dy[SLOW_HEAT] = motor.heat_rates(d, current, y[HEAT], y[SLOW_HEAT])
    load_torque = load.along_spool(l, force0, force1) * per_angle
    low, high = transmission.friction_limits(t, load_torque, speed)
    torque += motor.motor_torque(d, current, angle, warmth) - transmission.sliding_torque(
        t, d.inertia_kg_m2, load_torque, speed
    )
    dy[SPEED], dy[STICTION] = motor.acceleration(
        d, torque, load_torque, low, high, y[STICTION], speed, angle
    )
    dy[ANGLE] = speed
    dy[LOAD_PLACE] = y[LOAD_SPEED]
    dy[LOAD_SPEED], dy[LOAD_STICTION] = load.rates(
        l, y[LOAD_PLACE], y[LOAD_SPEED], y[LOAD_STICTION], load.along_load(l, force0, force1)
    )
    dy[SUPPLY_FLOW], dy[SUPPLY_RATE] = gas.droop_rates(
        p.gas[0], drawn0 + drawn1, y[SUPPLY_FLOW], y[SUPPLY_RATE]
    )


@compiled
def motion(p, s):
    """Travel of the spool behind the backlash, its speed, load coordinate and its speed, at the
    present state.
    """
    y = s.smooth
    travel, carried = transmission.play(
        p.transmission,
        transmission.geared_travel(p.transmission, y[ANGLE]),
        s.geared_m,
        s.travel_m,
        y[SPEED],
    )
    per_angle = transmission.travel_per_angle(p.transmission, y[ANGLE])
    q, q_speed, _ = load.coordinate(p.load, y[LOAD_PLACE], y[LOAD_SPEED])
    return travel, carried * per_angle * y[SPEED], q, q_speed


@compiled
def pulled_in(t, travel, travel_speed):
    """The strap's travel and its speed, from the spool's (transmission parameters)."""
    strap, slope = transmission.strap_travel(t, travel)
    return strap, slope * travel_speed


@compiled
def _write_drive_and_load(p, y, out, q):
    """What sensors see but for the muscles, with the load at coordinate q."""
    out.motor_angle_rad, out.motor_speed_rad_s, out.motor_current_a = y[ANGLE], y[SPEED], y[CURRENT]
    out.motor_torque_nm = drive.reported_torque(
        p.drive, p.sensors.motor_current_gain_ratio * y[CURRENT] + p.sensors.motor_current_offset_a
    )
    out.supply_pa = gas.supply_pressure(p.gas[0], y[SUPPLY_FLOW])
    knee = p.load.kind_code == load.KNEE
    out.load_position_m = q
    out.joint_angle_rad = y[LOAD_PLACE] if knee else 0.0
    out.joint_speed_rad_s = y[LOAD_SPEED] if knee else 0.0


@compiled
def write_seen(p, s):
    """Writes of ``write_truth``'s values those alone that sensors see."""
    y, out = s.smooth, s.truth
    travel, travel_speed, q, q_speed = motion(p, s)
    _write_drive_and_load(p, y, out, q)
    travel, travel_speed = pulled_in(p.transmission, travel, travel_speed)
    out.pressure_pa[0], out.pressure_pa[1] = p.gas[0].atmosphere_pa, p.gas[1].atmosphere_pa
    if p.muscle[0].present > 0.5:
        _, out.pressure_pa[0], _, _, out.muscle_force_n[0] = pull(
            p, s, y, 0, travel, travel_speed, q, q_speed
        )
    if p.muscle[1].present > 0.5:
        _, out.pressure_pa[1], _, _, _ = pull(p, s, y, 1, travel, travel_speed, q, q_speed)


@compiled
def write_truth(p, s):
    """Writes the noise-free values of the present state to ``state.truth``."""
    y, out = s.smooth, s.truth
    travel, travel_speed, q, q_speed = motion(p, s)
    _write_drive_and_load(p, y, out, q)
    out.winding_heat_k = y[HEAT]
    out.travel_m, out.travel_speed_m_s = travel, travel_speed
    travel, travel_speed = pulled_in(p.transmission, travel, travel_speed)
    for i in range(2):
        out.pressure_pa[i] = p.gas[i].atmosphere_pa
        if p.muscle[i].present > 0.5:
            volume, pressure, braid, speed, force = pull(
                p, s, y, i, travel, travel_speed, q, q_speed
            )
            out.volume_m3[i], out.pressure_pa[i], out.muscle_length_m[i] = volume, pressure, braid
            out.muscle_speed_m_s[i], out.muscle_force_n[i], out.gas_mass_kg[i] = (
                speed,
                force,
                y[GAS_MASS + i],
            )
            _, out.mass_flow_kg_s[i], _ = gas.rates(
                p.gas[i],
                y[GAS_C + i],
                y[GAS_MASS + i],
                volume,
                pressure,
                out.supply_pa,
                s.opening[i, 0],
                s.opening[i, 1],
            )
    out.spool_force_n = load.along_spool(p.load, out.muscle_force_n[0], out.muscle_force_n[1])
    out.load_speed_m_s = q_speed

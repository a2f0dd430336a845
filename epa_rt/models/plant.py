"""The whole plant: all blocks joined, moved by one cycle or over a whole log."""

import math

from epa_rt.models.blocks import bus, drive, gas, load, muscle, sensors, transmission
from epa_rt.models.compiled import compiled
from epa_rt.models.ports import (
    ANGLE,
    CREEP,
    CURRENT,
    GAS_C,
    GAS_MASS,
    HEAT,
    INTEGRAL,
    LOAD_PLACE,
    LOAD_SPEED,
    LOAD_STICTION,
    SMOOTH,
    SPEED,
    STICTION,
    SUPPLY_FLOW,
)
from epa_rt.models.rest import new_state

__all__ = ["advance", "new_state", "run"]


@compiled
def _lengths(p, travel, travel_speed, q, q_speed, i):
    """Length of muscle i's line between its ends, and its speed."""
    l = p.load
    if i == 0:
        return (l.rest0_m + l.travel0_ratio * travel + l.load0_ratio * q,
                l.travel0_ratio * travel_speed + l.load0_ratio * q_speed)
    return (l.rest1_m + l.travel1_ratio * travel + l.load1_ratio * q,
            l.travel1_ratio * travel_speed + l.load1_ratio * q_speed)


@compiled
def _pull(p, s, y, i, travel, travel_speed, q, q_speed):
    """Muscle i at state y: its volume, absolute pressure, line length, speed and force."""
    m, g = p.muscle[i], p.gas[i]
    length, speed = _lengths(p, travel, travel_speed, q, q_speed, i)
    braid = length - m.strap_compliance_m_n * s.strap_force_n[i]
    volume, slope = muscle.shape(m, g.dead_volume_m3, braid)
    pressure = gas.pressure(g, y[GAS_C + i], volume)
    force = muscle.tension(m, slope, pressure - g.atmosphere_pa, braid, speed, s.slip_m[i], s.dahl_ratio[i],
                           braid - s.length_m[i], y[CREEP + i])
    return volume, pressure, braid, speed, force


@compiled
def _rates(p, s, y, dy, motor, opening):
    """Rates of all smooth states at y. ``motor``: enabled, mode, target angle, its slope, speed, torque."""
    d, t, l = p.drive, p.transmission, p.load
    angle, speed, current = y[ANGLE], y[SPEED], y[CURRENT]
    travel, carried = transmission.play(t, transmission.geared_travel(t, angle), s.travel_m)
    per_angle = transmission.travel_per_angle(t, angle)
    q, q_speed, _ = load.coordinate(l, y[LOAD_PLACE], y[LOAD_SPEED])
    force0, force1, drawn_total = 0.0, 0.0, 0.0
    for i in range(2):
        if p.muscle[i].present > 0.5:
            volume, pressure, _, muscle_speed, force = _pull(p, s, y, i, travel, carried * per_angle * speed, q, q_speed)
            supply = gas.supply_pressure(p.gas[i], y[SUPPLY_FLOW])
            dy[GAS_C + i], dy[GAS_MASS + i], drawn = gas.rates(
                p.gas[i], y[GAS_C + i], y[GAS_MASS + i], volume, pressure, supply, opening[i, 0], opening[i, 1])
            dy[CREEP + i] = muscle.creep_rate(p.muscle[i], y[CREEP + i], muscle_speed)
            drawn_total += drawn
            if i == 0:
                force0 = force
            else:
                force1 = force
    dy[CURRENT], dy[INTEGRAL], dy[HEAT] = drive.rates(
        d, motor[0], motor[1], motor[2], motor[3], motor[4], motor[5], angle, speed, y[INTEGRAL], current, y[HEAT])
    load_torque = load.along_spool(l, force0, force1) * per_angle
    low, high = transmission.friction_limits(t, load_torque)
    torque = drive.motor_torque(d, current, angle, y[HEAT])
    dy[SPEED], dy[STICTION] = drive.acceleration(d, torque, load_torque, low, high, y[STICTION], speed)
    dy[ANGLE] = speed
    dy[LOAD_PLACE] = y[LOAD_SPEED]
    dy[LOAD_SPEED], dy[LOAD_STICTION] = load.rates(
        l, y[LOAD_PLACE], y[LOAD_SPEED], y[LOAD_STICTION], load.along_load(l, force0, force1))
    dy[SUPPLY_FLOW] = (drawn_total - y[SUPPLY_FLOW]) / p.gas[0].droop_time_s


@compiled
def _open_valves(p, s, valves, half_s):
    """Moves every valve's opening by half a sub-step."""
    for i in range(2):
        if p.muscle[i].present > 0.5 and (
                s.opening[i, 0] != valves[i] or s.opening[i, 1] != valves[2 + i]):
            decay = math.exp(-half_s / p.gas[i].valve_lag_s)
            s.opening[i, 0] = gas.opening_after(s.opening[i, 0], valves[i], decay)
            s.opening[i, 1] = gas.opening_after(s.opening[i, 1], valves[2 + i], decay)


@compiled
def _integrate(p, s, h, motor, target_end, valves):
    """Classical Runge-Kutta of fourth order over one sub-step; target and valve openings move with the stages."""
    y, stage, rate, total = s.smooth, s.work[0], s.work[1], s.work[2]
    enabled, mode, target, slope, target_speed, torque = motor
    middle = 0.5 * (target + target_end)
    _rates(p, s, y, rate, motor, s.opening)
    for i in range(SMOOTH):
        total[i] = rate[i]
        stage[i] = y[i] + 0.5 * h * rate[i]
    _open_valves(p, s, valves, 0.5 * h)
    for again in range(2):
        _rates(p, s, stage, rate, (enabled, mode, middle, slope, target_speed, torque), s.opening)
        reach = 0.5 * h if again == 0 else h
        for i in range(SMOOTH):
            total[i] += 2.0 * rate[i]
            stage[i] = y[i] + reach * rate[i]
    _open_valves(p, s, valves, 0.5 * h)
    _rates(p, s, stage, rate, (enabled, mode, target_end, slope, target_speed, torque), s.opening)
    for i in range(SMOOTH):
        y[i] += h / 6.0 * (total[i] + rate[i])


@compiled
def _motion(p, s):
    """Travel behind the backlash, its speed, load coordinate and its speed, at the present state."""
    y = s.smooth
    travel, carried = transmission.play(
        p.transmission, transmission.geared_travel(p.transmission, y[ANGLE]), s.travel_m)
    per_angle = transmission.travel_per_angle(p.transmission, y[ANGLE])
    q, q_speed, _ = load.coordinate(p.load, y[LOAD_PLACE], y[LOAD_SPEED])
    return travel, carried * per_angle * y[SPEED], q, q_speed


@compiled
def _settle(p, s, valves):
    """Takes the finished sub-step into the elements with memory: backlash, slip, strap, shut valves."""
    travel, travel_speed, q, q_speed = _motion(p, s)
    for i in range(2):
        m = p.muscle[i]
        if m.present > 0.5:
            _, _, braid, _, force = _pull(p, s, s.smooth, i, travel, travel_speed, q, q_speed)
            moved = braid - s.length_m[i]
            muscle.slip_settle(m, s.slip_m[i], moved)
            if m.dahl_ratio != 0.0:
                s.dahl_ratio[i] = muscle.dahl(m, s.dahl_ratio[i], moved)
            s.strap_force_n[i] = force
            s.length_m[i] = braid
            s.opening[i, 0] = gas.settled(s.opening[i, 0], valves[i])
            s.opening[i, 1] = gas.settled(s.opening[i, 1], valves[2 + i])
    s.travel_m = travel


@compiled
def write_truth(p, s):
    """Writes the noise-free values of the present state to ``state.truth``."""
    y, out = s.smooth, s.truth
    travel, travel_speed, q, q_speed = _motion(p, s)
    out.motor_angle_rad, out.motor_speed_rad_s, out.motor_current_a = y[ANGLE], y[SPEED], y[CURRENT]
    out.motor_torque_nm = drive.motor_torque(p.drive, y[CURRENT], y[ANGLE], y[HEAT])
    out.winding_heat_k = y[HEAT]
    out.travel_m, out.travel_speed_m_s = travel, travel_speed
    out.supply_pa = gas.supply_pressure(p.gas[0], y[SUPPLY_FLOW])
    for i in range(2):
        out.pressure_pa[i] = p.gas[i].atmosphere_pa
        if p.muscle[i].present > 0.5:
            volume, pressure, braid, speed, force = _pull(p, s, y, i, travel, travel_speed, q, q_speed)
            out.volume_m3[i], out.pressure_pa[i], out.muscle_length_m[i] = volume, pressure, braid
            out.muscle_speed_m_s[i], out.muscle_force_n[i], out.gas_mass_kg[i] = speed, force, y[GAS_MASS + i]
    out.spool_force_n = load.along_spool(p.load, out.muscle_force_n[0], out.muscle_force_n[1])
    out.load_position_m, out.load_speed_m_s = q, q_speed
    knee = p.load.kind_code == load.KNEE
    out.joint_angle_rad = y[LOAD_PLACE] if knee else 0.0
    out.joint_speed_rad_s = y[LOAD_SPEED] if knee else 0.0


@compiled
def _advance(p, s, command, reading, period_s, substeps):
    before = s.ring[(s.cycle - 1) % s.ring.shape[0]]
    bus.latch(s, command)
    y = s.smooth
    y[INTEGRAL] = drive.integral_at_edge(command.enabled, command.mode, before[bus.ENABLED], before[bus.MODE],
                                         y[INTEGRAL], y[CURRENT])
    motor_delay, valve_delay = p.bus.command_delay_s / period_s, p.bus.valve_delay_s / period_s
    h = period_s / substeps
    for j in range(substeps):
        start, end = j / substeps, (j + 1) / substeps
        motor, target_end = bus.motor_seen(s.ring, s.cycle, start - motor_delay, end - motor_delay, h)
        valves = bus.valves_seen(s.ring, s.cycle, start - valve_delay, end - valve_delay)
        _integrate(p, s, h, motor, target_end, valves)
        _settle(p, s, valves)
    write_truth(p, s)
    sensors.read(p.sensors, s, s.truth, p.gas[0].atmosphere_pa, reading, period_s)
    s.cycle += 1


@compiled
def advance(params, state, command, sensors_out, period_s, substeps):
    """Moves the plant by one bus cycle and writes the readings at its end.

    ``params`` PARAMS, ``state`` STATE (moved in place), ``command`` COMMAND (held over the cycle), ``sensors_out``
    SENSORS (written): all of shape (1,). ``substeps`` of the integrator per cycle; see docs/plant.md.
    """
    _advance(params[0], state[0], command[0], sensors_out[0], period_s, substeps)


@compiled
def run(params, state, commands, period_s, substeps, sensors_out):
    """As ``advance`` for every row of ``commands`` (N,), readings into ``sensors_out`` (N,), in one compiled call."""
    for k in range(commands.shape[0]):
        _advance(params[0], state[0], commands[k], sensors_out[k], period_s, substeps)

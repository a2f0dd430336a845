"""Bus timing: what command the drive and the valves see, cycle by cycle, when commands take time to
arrive.
"""

import math

import numpy as np

from epa_rt.models.compiled import compiled
from epa_rt.models.ports import RING, STATE

# Columns of the ring. A pair (x, x + 1) is a straight line over the cycle, a single one is held.
ENABLED, MODE, TARGET, SLOPE, TARGET_SPEED, TORQUE, INLET, EXHAUST = 0, 1, 2, 4, 6, 8, 9, 11
POSITION_MODE, SPEED_MODE = 8.0, 9.0


@compiled
def latch(state, command, period_s):
    """Takes this cycle's command into the ring.

    Position and speed targets, and the slope of the position target, become straight lines from the
    cycle before, as a drive interpolates them (0x60C2). A loop that starts begins at its target; a
    position loop that takes over from a speed loop begins on a line with that speed.
    """
    row = state.ring[state.cycle % RING]
    before = state.ring[(state.cycle - 1) % RING]
    running = command.enabled > 0.5 and before[ENABLED] > 0.5
    row[ENABLED], row[MODE] = command.enabled, command.mode
    _position_line(row, before, running, command.target_angle_rad, period_s)
    row[TARGET_SPEED + 1] = command.target_speed_rad_s
    row[TARGET_SPEED] = command.target_speed_rad_s
    if running and row[MODE] == SPEED_MODE and before[MODE] == SPEED_MODE:
        row[TARGET_SPEED] = before[TARGET_SPEED + 1]
    row[TORQUE] = command.target_torque_nm
    for i in range(2):
        row[INLET + i] = command.inlet[i]
        row[EXHAUST + i] = command.exhaust[i]


@compiled
def _position_line(row, before, running, target_angle, period_s):
    """Position target at the start and end of the cycle, and its slope at both."""
    slope = 0.0
    if running and row[MODE] == POSITION_MODE and before[MODE] == SPEED_MODE:
        slope = before[TARGET_SPEED + 1]
    row[TARGET], row[TARGET + 1] = target_angle - slope * period_s, target_angle
    row[SLOPE], row[SLOPE + 1] = slope, slope
    if running and row[MODE] == POSITION_MODE and before[MODE] == POSITION_MODE:
        row[TARGET] = before[TARGET + 1]
        row[SLOPE], row[SLOPE + 1] = before[SLOPE + 1], (target_angle - row[TARGET]) / period_s


@compiled
def held(ring, cycle, start, end, column):
    """Mean over [start, end] (in cycles, 0 = start of this cycle, at most one long) of a held,
    delayed command.
    """
    first, last = math.floor(start), math.ceil(end) - 1
    before = ring[(cycle + first) % RING, column]
    if last <= first:
        return before
    part = (end - last) / (end - start)
    return (1.0 - part) * before + part * ring[(cycle + last) % RING, column]


@compiled
def line(row, column, moment):
    """A target at a moment (0 to 1) of the cycle whose ring row this is."""
    return row[column] + (row[column + 1] - row[column]) * moment


@compiled
def motor_seen(ring, cycle, start, end):
    """What the drive sees in a sub-step from ``start`` to ``end`` (in cycles, 0 = start of this
    cycle).

    Enabled, mode, held torque, then pairs at start and end: target angle, its slope, target speed.
    Switches (enabled, mode) are those of the sub-step's end; a moment between two cycles belongs to
    the sub-step's side.
    """
    first, last = math.floor(start), math.ceil(end) - 1
    row0, row1 = ring[(cycle + first) % RING], ring[(cycle + last) % RING]
    start, end = start - first, end - last
    torque = row1[TORQUE]
    if last > first:
        part = end / (end + 1.0 - start)
        torque = (1.0 - part) * row0[TORQUE] + part * row1[TORQUE]
    return (
        row1[ENABLED],
        row1[MODE],
        torque,
        line(row0, TARGET, start),
        line(row1, TARGET, end),
        line(row0, SLOPE, start),
        line(row1, SLOPE, end),
        line(row0, TARGET_SPEED, start),
        line(row1, TARGET_SPEED, end),
    )


@compiled
def valve_delays(delay_s, skew_ratio):
    """(s, s) by which a valve opens and closes late."""
    return delay_s * (1.0 + min(skew_ratio, 0.0)), delay_s * (1.0 - max(skew_ratio, 0.0))


@compiled
def valves_seen(ring, cycle, start, end, opening, closing):
    """Commanded openings in a sub-step, means over it: inlet 0, inlet 1, exhaust 0, exhaust 1.

    ``opening``, ``closing``: delays in cycles. A valve is open from ``opening`` after its command
    until ``closing`` after its end.
    """
    if opening == closing:
        start, end = start - opening, end - opening
        first, last = math.floor(start), math.ceil(end) - 1
        row = ring[(cycle + last) % RING]
        if last <= first:
            return row[INLET], row[INLET + 1], row[EXHAUST], row[EXHAUST + 1]
        return (
            held(ring, cycle, start, end, INLET),
            held(ring, cycle, start, end, INLET + 1),
            held(ring, cycle, start, end, EXHAUST),
            held(ring, cycle, start, end, EXHAUST + 1),
        )
    return (
        _valve_seen(ring, cycle, start, end, opening, closing, INLET),
        _valve_seen(ring, cycle, start, end, opening, closing, INLET + 1),
        _valve_seen(ring, cycle, start, end, opening, closing, EXHAUST),
        _valve_seen(ring, cycle, start, end, opening, closing, EXHAUST + 1),
    )


@compiled
def _valve_seen(ring, cycle, start, end, opening, closing, column):
    found = held(ring, cycle, start - opening, end - opening, column)
    other = held(ring, cycle, start - closing, end - closing, column)
    return min(found, other) if closing < opening else max(found, other)


def bus_over_log(params, commands, period_s):
    """What the drive and the valves see of a log of commands, one row per cycle.

    ``commands``: (N,) COMMAND. Returns (N, 10): enabled, mode, torque (mean over the cycle), target
    angle, its slope and target speed at the cycle's end, and the openings inlet 0, inlet 1, exhaust
    0, exhaust 1 (means).
    """
    seen = np.zeros((len(commands), 10))
    _over_log(params, np.zeros(1, STATE), commands, period_s, seen)
    return seen


@compiled
def _over_log(params, state, commands, period_s, seen):
    s = state[0]
    motor_delay = params[0].bus.command_delay_s / period_s
    opening_s, closing_s = valve_delays(params[0].bus.valve_delay_s, params[0].bus.valve_skew_ratio)
    for k in range(commands.shape[0]):
        latch(s, commands[k], period_s)
        motor = motor_seen(s.ring, s.cycle, -motor_delay, 1.0 - motor_delay)
        valves = valves_seen(s.ring, s.cycle, 0.0, 1.0, opening_s / period_s, closing_s / period_s)
        seen[k, 0], seen[k, 1], seen[k, 2] = motor[0], motor[1], motor[2]
        seen[k, 3], seen[k, 4], seen[k, 5] = motor[4], motor[6], motor[8]
        for i in range(4):
            seen[k, 6 + i] = valves[i]
        s.cycle += 1

"""Bus timing: what command the drive and the valves see, cycle by cycle, when commands take time to arrive."""

import math

import numpy as np

from epa_rt.models.compiled import compiled
from epa_rt.models.ports import RING, STATE

ENABLED, MODE, START, END, TARGET_SPEED, TORQUE, INLET, EXHAUST = 0, 1, 2, 3, 4, 5, 6, 8
POSITION_MODE = 8.0


@compiled
def latch(state, command):
    """Takes this cycle's command into the ring; a position target becomes a straight line from the one before."""
    row = state.ring[state.cycle % RING]
    tracking = command.enabled > 0.5 and command.mode == POSITION_MODE
    target = command.target_angle_rad
    row[START] = state.last_target_rad if tracking and state.tracking > 0.5 else target
    row[END] = target
    row[ENABLED] = command.enabled
    row[MODE] = command.mode
    row[TARGET_SPEED] = command.target_speed_rad_s
    row[TORQUE] = command.target_torque_nm
    for i in range(2):
        row[INLET + i] = command.inlet[i]
        row[EXHAUST + i] = command.exhaust[i]
    state.tracking = 1.0 if tracking else 0.0
    state.last_target_rad = target


@compiled
def held(ring, cycle, start, end, column):
    """Mean over [start, end] (in cycles, 0 = start of this cycle, at most one long) of a held, delayed command."""
    first = math.floor(start)
    last = math.ceil(end) - 1
    before = ring[(cycle + first) % RING, column]
    if last <= first:
        return before
    part = (end - last) / (end - start)
    return (1.0 - part) * before + part * ring[(cycle + last) % RING, column]


@compiled
def line(ring, cycle, moment):
    """The position target at ``moment`` (in cycles, 0 = start of this cycle), on the line of the cycle it lies in."""
    piece = math.floor(moment)
    row = ring[(cycle + piece) % RING]
    return row[START] + (row[END] - row[START]) * (moment - piece)


@compiled
def line_end(ring, cycle, moment):
    """As ``line``, but a moment on the border of two cycles belongs to the earlier one."""
    piece = math.ceil(moment) - 1
    row = ring[(cycle + piece) % RING]
    return row[START] + (row[END] - row[START]) * (moment - piece)


def bus_over_log(params, commands, period_s):
    """What the drive and the valves see of a log of commands, one row per cycle.

    ``commands``: (N,) COMMAND. Returns (N, 9): enabled, mode, target angle at the cycle's end, target speed, target
    torque, inlet 0, inlet 1, exhaust 0, exhaust 1. Held values are means over the cycle.
    """
    seen = np.zeros((len(commands), 9))
    _over_log(params, np.zeros(1, STATE), commands, period_s, seen)
    return seen


@compiled
def _over_log(params, state, commands, period_s, seen):
    s = state[0]
    motor = params[0].bus.command_delay_s / period_s
    valve = params[0].bus.valve_delay_s / period_s
    for k in range(commands.shape[0]):
        latch(s, commands[k])
        for column, source in ((0, ENABLED), (1, MODE), (3, TARGET_SPEED), (4, TORQUE)):
            seen[k, column] = held(s.ring, s.cycle, -motor, 1.0 - motor, source)
        seen[k, 2] = line_end(s.ring, s.cycle, 1.0 - motor)
        for i in range(4):
            seen[k, 5 + i] = held(s.ring, s.cycle, -valve, 1.0 - valve, INLET + i)
        s.cycle += 1


@compiled
def motor_seen(ring, cycle, start, end, sub_step_s):
    """What the drive sees in a sub-step from ``start`` to ``end`` (in cycles): its command tuple, and the last target.

    The tuple: enabled, mode, target angle at the start, slope of the target, target speed, target torque. Switches
    (enabled, mode) are those of the sub-step's end.
    """
    row = ring[(cycle + math.ceil(end) - 1) % RING]
    first, last = line(ring, cycle, start), line_end(ring, cycle, end)
    motor = (row[ENABLED], row[MODE], first, (last - first) / sub_step_s,
             held(ring, cycle, start, end, TARGET_SPEED), held(ring, cycle, start, end, TORQUE))
    return motor, last


@compiled
def valves_seen(ring, cycle, start, end):
    """Commanded openings in a sub-step: inlet 0, inlet 1, exhaust 0, exhaust 1."""
    return (held(ring, cycle, start, end, INLET), held(ring, cycle, start, end, INLET + 1),
            held(ring, cycle, start, end, EXHAUST), held(ring, cycle, start, end, EXHAUST + 1))

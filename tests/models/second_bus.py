"""Bus of the second simulator, written from docs/plant.md: the straight lines of the targets, and
commands that arrive late.
"""

import math

NOTHING = {
    "enabled": False,
    "mode": 0,
    "angle": (0.0, 0.0),
    "slope": (0.0, 0.0),
    "speed": (0.0, 0.0),
    "torque": 0.0,
    "valves": (0.0,) * 4,
}


def lines(commands, period):
    """Per cycle the straight lines of the targets at its start and end, and what is held."""
    rows = []
    for command in commands:
        enabled, mode, last = (
            command["enabled"] > 0.5,
            int(command["mode"]),
            rows[-1] if rows else NOTHING,
        )
        target, speed = float(command["target_angle_rad"]), float(command["target_speed_rad_s"])
        running = enabled and last["enabled"]
        row = {
            "enabled": enabled,
            "mode": mode,
            "speed": (speed, speed),
            "torque": float(command["target_torque_nm"]),
            "valves": (*map(float, command["inlet"]), *map(float, command["exhaust"])),
        }
        slope = last["speed"][1] if running and mode == 8 and last["mode"] == 9 else 0.0
        row["angle"], row["slope"] = (target - slope * period, target), (slope, slope)
        if running and mode == last["mode"] == 8:
            start = last["angle"][1]
            row["angle"], row["slope"] = (
                (start, target),
                (last["slope"][1], (target - start) / period),
            )
        if running and mode == last["mode"] == 9:
            row["speed"] = (last["speed"][1], speed)
        rows.append(row)
    return rows


def row_at(rows, place):
    """Row whose cycle starts at or before `place` (cycles)."""
    k = math.floor(place + 1e-9)
    return rows[k] if k >= 0 else NOTHING


def row_before(rows, place):
    """Row whose cycle ends at or after `place`."""
    k = math.ceil(place - 1e-9) - 1
    return rows[k] if k >= 0 else NOTHING


def seen(rows, start, end, delay):
    """What the drive sees over a part of a cycle, both ends in cycles."""
    a, b = start - delay, end - delay
    first, last = row_at(rows, a), row_before(rows, b)
    row = {
        "enabled": last["enabled"],
        "mode": last["mode"],
        "torque": mean(rows, a, b, lambda r: r["torque"]),
    }
    for name in ("angle", "slope", "speed"):
        row[name] = (
            along(first[name], a - math.floor(a + 1e-9)),
            along(last[name], b - math.ceil(b - 1e-9) + 1),
        )
    return row


def along(line, part):
    return line[0] + part * (line[1] - line[0])


def mean(rows, a, b, value):
    """Mean of a held command over the interval."""
    total = 0.0
    for k in range(math.floor(a), math.ceil(b)):
        total += value(row_at(rows, k)) * max(min(b, k + 1) - max(a, k), 0.0)
    return total / (b - a)


def valves(rows, start, end, delay, skew):
    """Commands of the valves, that open and close with delays of their own (cycles)."""
    late_open, late_close = delay * (1 + min(skew, 0.0)), delay * (1 - max(skew, 0.0))
    out = []
    for v in range(4):
        opened, closed = (
            mean(rows, start - d, end - d, lambda r, v=v: r["valves"][v])
            for d in (late_open, late_close)
        )
        out.append(min(opened, closed) if late_close < late_open else max(opened, closed))
    return out


def speed_loop(row):
    return row["enabled"] and row["mode"] in (8, 9)


def integral(rows, k, delay, before, current):
    """Integral of the speed loop as a cycle starts."""
    now, last = speed_loop(row_at(rows, k - delay)), speed_loop(row_at(rows, k - 1 - delay))
    return 0.0 if not now else before if last else current

"""A servo's joint that may lack several effects at once, by an outsider's equations: a motor that
follows a command in proportion to its error, behind a gear, integrated in steps of 0.2 ms.

The command is a sum of sines and four steps, encoder and command have 12 bits. Its plant file has
gain, lag and zero alone, the first two some percent off. Nothing here knows the catalogue but by
the names of families.
"""

import math

import numpy as np
from numba import njit

from epa_rt.gap.recording import Recording
from scripts.outsider import Outsider, one_trial, sines, strengths

PERIOD_S, SUBSTEPS, SECONDS, LOGS, BITS = 0.02, 100, 40.0, 2, 12
GAIN_PER_S, LAG_S = 18.0, 0.06
SINES_HZ_RAD = ((0.07, 0.6), (0.23, 0.3), (0.6, 0.12), (1.4, 0.04))
STEPS, STEP_RAD = 4, 0.3  # of the command, at most so large
# effect to the families that may rightly name it
FAMILIES = {
    "dry": {"friction"},
    "by_direction": {"friction"},
    "breakaway": {"stiction", "friction"},
    "gap": {"backlash"},
    "dead": {"deadband"},
    "late": {"delay"},
    "weight": {"load"},
    "constant": {"offset"},
    "slow": {"limit"},
    "weak": {"gain"},
    "scale": {"sensor"},
}
EVERYWHERE: set[str] = set()


def drawn(random: np.random.Generator, count: int) -> tuple[tuple[str, ...], np.ndarray, float]:
    """``count`` effects, each at 0.6 to 1.6 of a strength that one would meet: their names, the
    numbers of the equation of motion, and how late commands arrive, s.
    """
    has, strength = strengths(random, FAMILIES, count, {"by_direction": "dry"})
    sign, turn = random.choice([-1.0, 1.0]), random.uniform(-3.0, 3.0)

    weight, dry = strength("weight", 0.35), strength("dry", 0.12)
    numbers = [
        dry + strength("by_direction", 0.16),
        dry,
        strength("breakaway", 0.12),
        strength("gap", 0.015),
        strength("dead", 0.012),
        weight * math.cos(turn),
        weight * math.sin(turn),
        strength("constant", 0.2) * sign,
        strength("slow", 2.2),
        1.0 - strength("weak", 0.2),
        strength("scale", 0.03) * sign,
    ]
    return has, np.array(numbers), strength("late", 0.03)


@njit(cache=True)
def _followed(command, late_steps, step_rad, n):  # type: ignore[no-untyped-def]
    """(N,) angle as read, of a motor that forces slow down by a speed each."""
    forward, backward, breakaway, gap, dead, sine, cosine, load, fastest, gain, scale = n
    read = np.zeros(len(command))
    motor, w, q, step = command[0], 0.0, command[0], PERIOD_S / SUBSTEPS
    for k in range(len(command)):
        for j in range(SUBSTEPS):
            at = max(k * SUBSTEPS + j - late_steps, 0)
            error = command[at // SUBSTEPS] - round(q / step_rad) * step_rad
            error -= min(max(error, -dead), dead)
            drive = gain * GAIN_PER_S * error
            if fastest > 0.0:
                drive = min(max(drive, -fastest), fastest)
            push = drive - sine * math.sin(q) - cosine * math.cos(q) - load - w
            up = w > 0.0 or (w == 0.0 and push > 0.0)
            dry = forward if up else backward
            if w == 0.0 and abs(push) <= dry + breakaway:
                faster = 0.0
            else:
                faster = w + step * (push - (dry if up else -dry)) / LAG_S
            w = 0.0 if w * faster < 0.0 else faster
            motor += step * w
            q = min(max(q, motor - 0.5 * gap), motor + 0.5 * gap)
        read[k] = round(q / step_rad) * step_rad * (1.0 + scale)
    return read


def recorded(
    numbers: np.ndarray, late_s: float, name: str, random: np.random.Generator
) -> Recording:
    """A log of it."""
    t = np.arange(0.0, SECONDS, PERIOD_S)
    command = sines(random, t, SINES_HZ_RAD)
    for _ in range(STEPS):
        after = t > random.uniform(2.0, SECONDS - 2.0)
        command += np.where(after, random.uniform(-STEP_RAD, STEP_RAD), 0.0)
    step_rad = 2.0 * np.pi / 2**BITS
    command = np.round(command / step_rad) * step_rad
    position = _followed(command, round(late_s * SUBSTEPS / PERIOD_S), step_rad, numbers)
    columns = {"command": command, "position": position}
    return one_trial(name, "servo", PERIOD_S, columns)


def made(random: np.random.Generator, count: int) -> Outsider:
    """A servo with ``count`` effects, its logs, and its files."""
    has, numbers, late_s = drawn(random, count)
    logs = [recorded(numbers, late_s, f"log{i}", random) for i in range(LOGS)]
    gain, lag = random.uniform(0.9, 1.1), random.uniform(0.85, 1.15)
    return Outsider(
        has,
        BITS,
        logs,
        f"plant: servo\nkind: servo\njoint: {{gain: {GAIN_PER_S * gain:.4f} 1/s,"
        f" lag: {LAG_S * lag:.5f} s}}\nsensor: {{zero: 0 rad}}\n",
        "rig: servo\nkind: servo\nplant: plant.yaml\nrate: 50 Hz\nlowpass: 20 Hz\n"
        "channels: {command: command, position: position}\nsettings: {stroke: 2 rad}\n"
        f"steps: {{position: {2.0 * np.pi / 2**BITS:.6f} rad}}\n",
    )

"""A joint that may lack several effects at once, by an outsider's equations: one inertia under a
controller that follows a sum of sines, integrated in steps of 0.1 ms; half of the joints have an
encoder of 12 bits, the others of 16.

Its plant file has inertia and drag alone, each some percent off. Nothing here knows the catalogue
but by the names of families.
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from epa_rt.gap.recording import Recording
from scripts.outsider import Outsider, one_trial, sines, strengths

PERIOD_S, SUBSTEPS, SECONDS, LOGS = 4e-3, 40, 24.0, 2
INERTIA_KG_M2, DRAG_NM_S_RAD, TYPICAL_NM = 0.05, 0.12, 1.5
STIFFNESS_NM_RAD, DAMPING_NM_S_RAD = 60.0, 2.5  # of its controller
INTEGRAL_PER_S, MOST_INTEGRAL_RAD_S = 6.0, 0.05  # of the stiffness; where it stops to grow
TORQUE_NOISE_NM, TORQUE_STEP_NM = 0.01, 0.005
SINES_HZ_RAD = ((0.21, 0.8), (0.57, 0.35), (1.3, 0.12), (2.7, 0.04))
# effect to the families that may rightly name it
FAMILIES = {
    "dry": {"friction"},
    "builds_up": {"friction"},  # dry friction over a way
    "rise": {"stribeck", "friction"},
    "by_direction": {"offset"},
    "constant": {"offset"},
    "weight": {"load"},
    "spring": {"spring"},
    "cogging": {"cogging"},
    "square": {"viscous"},
    "by_load": {"load_friction"},
    "gain": {"gain"},
    "late": {"delay"},
    "disc": {"sensor"},
}
# on every joint: a sign that turns over within 5 mrad/s
EVERYWHERE = {"reversal"}


@dataclass(frozen=True)
class Joint:
    """``has``: effects. ``numbers``: of its equation of motion. ``bits``: of its encoder."""

    has: tuple[str, ...]
    numbers: np.ndarray
    late_s: float
    disc_rad: float
    bits: int


def drawn(random: np.random.Generator, count: int) -> Joint:
    """A joint with ``count`` effects, each at 0.6 to 1.6 of a strength that one would meet."""
    has, strength = strengths(random, FAMILIES, count, {"builds_up": "dry"})
    sign, turn, teeth = (
        random.choice([-1.0, 1.0]),
        random.uniform(-3.0, 3.0),
        random.integers(6, 24),
    )

    return Joint(
        has,
        np.array(
            [
                strength("dry", 0.3 * TYPICAL_NM) + strength("builds_up", 0.3 * TYPICAL_NM),
                strength("builds_up", 0.01),
                strength("rise", 0.2 * TYPICAL_NM),
                strength("by_direction", 0.1 * TYPICAL_NM) * sign,
                strength("constant", 0.15 * TYPICAL_NM),
                strength("weight", 0.5 * TYPICAL_NM),
                turn,
                strength("spring", 0.1 * TYPICAL_NM),
                strength("cogging", 0.08 * TYPICAL_NM),
                float(teeth),
                strength("square", 0.09 * TYPICAL_NM),
                strength("by_load", 0.08),
                1.0 + strength("gain", 0.08) * sign,
            ]
        ),
        strength("late", 6e-3),
        strength("disc", 0.012),
        12 if random.integers(2) else 16,
    )


@njit(cache=True)
def _driven(wanted, pace, late_steps, n):  # type: ignore[no-untyped-def]
    """(N,) angle, and torque asked of the drive in each row, which holds it until the next."""
    (level, over, rise, by_direction, constant, weight, turn, spring, cogging, teeth, square,
     by_load, gain) = n  # fmt: skip
    angle, asked = np.zeros(len(wanted)), np.zeros(len(wanted))
    q, v, bristle, integral, step = wanted[0], 0.0, 0.0, 0.0, PERIOD_S / SUBSTEPS
    for k in range(len(wanted)):
        apart = wanted[k] - q
        integral = min(max(integral + apart * PERIOD_S, -MOST_INTEGRAL_RAD_S), MOST_INTEGRAL_RAD_S)
        angle[k] = q
        asked[k] = STIFFNESS_NM_RAD * (apart + INTEGRAL_PER_S * integral) + DAMPING_NM_S_RAD * (
            pace[k] - v
        )
        for j in range(SUBSTEPS):
            at = k * SUBSTEPS + j - late_steps
            torque = gain * (asked[at // SUBSTEPS] if at >= 0 else 0.0)
            sign = math.tanh(v / 5e-3)
            held = sign
            if over > 0.0:
                bristle += step * (v - abs(v) * bristle) / over
                bristle = min(max(bristle, -1.0), 1.0)
                held = bristle
            taken = held * (level + rise * math.exp(-((v / 0.12) ** 2)) + by_load * abs(torque))
            taken += DRAG_NM_S_RAD * v + square * v * abs(v) + by_direction * sign**2 + constant
            taken += weight * math.sin(q + turn) + spring * q + cogging * math.sin(teeth * q + turn)
            v += step * (torque - taken) / INERTIA_KG_M2
            q += step * v
    return angle, asked


def recorded(joint: Joint, name: str, random: np.random.Generator) -> Recording:
    """A log of it."""
    t = np.arange(0.0, SECONDS, PERIOD_S)
    wanted = sines(random, t, SINES_HZ_RAD)
    wanted *= np.minimum(t, 1.0)
    late_steps = round(joint.late_s * SUBSTEPS / PERIOD_S)
    angle, asked = _driven(wanted, np.gradient(wanted, PERIOD_S), late_steps, joint.numbers)
    step = 2.0 * np.pi / 2**joint.bits
    noisy = asked + TORQUE_NOISE_NM * random.standard_normal(len(t))
    columns = {
        "angle": np.round((angle + joint.disc_rad * np.sin(angle + 1.0)) / step) * step,
        "torque": np.round(noisy / TORQUE_STEP_NM) * TORQUE_STEP_NM,
    }
    return one_trial(name, "joint", PERIOD_S, columns)


def made(random: np.random.Generator, count: int) -> Outsider:
    """A joint with ``count`` effects, its logs, and its files."""
    joint = drawn(random, count)
    logs = [recorded(joint, f"log{i}", random) for i in range(LOGS)]
    inertia, drag = random.uniform(0.95, 1.05), random.uniform(0.8, 1.2)
    return Outsider(
        joint.has,
        joint.bits,
        logs,
        f"plant: joint\nkind: shaft\nshaft: {{inertia: {INERTIA_KG_M2 * inertia:.5f} kg*m^2}}\n"
        f"friction: {{viscous: {DRAG_NM_S_RAD * drag:.5f} N*m*s/rad}}\n",
        "rig: joint\nkind: shaft\nplant: plant.yaml\nrate: 50 Hz\nlowpass: 20 Hz\n"
        "channels: {angle: angle, torque: torque}\n"
        f"settings: {{typical_torque: {TYPICAL_NM} N*m, typical_speed: 1.5 rad/s, stroke: 3 rad}}\n"
        f"steps: {{angle: {2.0 * np.pi / 2**joint.bits:.6f} rad}}\n",
    )

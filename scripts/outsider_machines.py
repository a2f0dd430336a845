"""Recordings of three machines by plain equations of their own: a carriage, a shaft, a piston.

Nothing here knows the plant or the catalogue of the diagnosis. Each machine is one body, or two
with play between them, integrated by Runge-Kutta steps of fixed size. A healthy run differs from
the next as real ones do; a fault is seeded on top of it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

PERIOD_S, SUBSTEPS = 2e-3, 8  # of the log; of the integration in it
ATMOSPHERE_PA = 101_325.0


@dataclass(frozen=True)
class Machine:
    """Healthy numbers in SI, of place in m or rad and force in N or N*m alike.

    Dry friction is ``level`` (1 + ``rise`` exp(-(v/``rise_speed``)^2)) tanh(v/``smooth_speed``);
    ``motor_share`` of the mass sits before the play. ``steps``: what readings of place and force
    are rounded to; ``place_noise``, ``force_noise``: deviations. ``speeds``: of the strokes, the
    first of them alone where one speed is asked for.
    """

    kind: str
    mass: float
    motor_share: float
    level: float
    rise: float
    rise_speed: float
    smooth_speed: float
    viscous: float
    offset: float
    stroke: float
    middle: float
    speeds: tuple[float, ...]
    stiffness: float  # of the controller that moves it
    damping: float
    wall: float  # stiffness of the walls of a play
    place_noise: float
    force_noise: float
    steps: tuple[float, float]
    area: float = 0.0  # of a piston's bore, m^2
    pressure_pa: float = ATMOSPHERE_PA  # behind it, as its regulator is set
    volume: float = 1e-4  # behind it at the middle of its way, m^3


CARRIAGE = Machine(
    "carriage", 20.0, 0.3, 24.0, 0.25, 0.01, 1e-3, 90.0, 2.0, 0.3, 0.2, (0.12, 0.04, 0.3),
    60e3, 2.2e3, 4e6, 1e-6, 0.15, (1e-6, 0.01),
)  # fmt: skip
SHAFT = Machine(
    "shaft", 0.05, 0.3, 0.35, 0.2, 0.1, 0.01, 0.12, 0.03, 2.4, 0.0, (1.2, 0.4, 3.0),
    150.0, 5.5, 1e4, 1e-5, 2e-3, (1e-5, 1e-4),
)  # fmt: skip
PISTON = Machine(
    "piston", 3.0, 0.5, 14.0, 0.3, 4e-3, 1e-3, 120.0, 0.0, 0.06, 0.03, (0.03, 0.01, 0.08),
    40e3, 500.0, 2e6, 1e-6, 0.05, (1e-6, 0.005), 5e-4, 5e5,
)  # fmt: skip
MACHINES = {one.kind: one for one in (CARRIAGE, SHAFT, PISTON)}


@dataclass(frozen=True)
class Wander:
    """Deviations from run to run, as parts of the healthy number unless said otherwise.

    ``offset`` and ``place_zero``: parts of the friction level and of the stroke. ``warm``: part of
    the drag that a cold oil has more, which dies away over ``warm_s`` within a run.
    """

    level: float = 0.03
    viscous: float = 0.06
    offset: float = 0.02
    gain: float = 0.003
    place_zero: float = 2e-3
    reference: float = 0.02
    warm: float = 0.15
    warm_s: float = 40.0
    pressure: float = 2e-3
    gauge_zero_pa: float = 150.0


@dataclass(frozen=True)
class Fault:
    """What is seeded: a part of the friction level, play as part of the stroke, a spot (part of the
    level; its middle and half width as parts of the half stroke), a drive that gives ``gain`` of
    what it is told (of a piston: a cell that reads it).
    """

    friction: float = 0.0
    play: float = 0.0
    spot: float = 0.0
    spot_at: float = 0.25
    spot_half: float = 0.12
    gain: float = 1.0


HEALTHY = Fault()
FAULTS = {
    "friction": Fault(friction=0.2),
    "play": Fault(play=2e-3),
    "rough_spot": Fault(spot=0.8),
    "gain": Fault(gain=0.92),
    "unseen_spot": Fault(spot=0.8, spot_at=1.6),  # beyond the strokes: nothing passes it
}


@dataclass(frozen=True)
class Run:
    """One machine on one day: its numbers, and what its readings are wrong by."""

    machine: Machine
    fault: Fault
    gain: float
    place_zero: float
    gauge_zero_pa: float
    warm: float
    warm_s: float
    cold: float  # how far from warm it starts, 0 to 1
    reference: tuple[float, float]  # factors of amplitude and speed
    begins: float  # part of a stroke at which it starts


def drawn(
    machine: Machine, fault: Fault, random: np.random.Generator, wander: Wander = Wander()
) -> Run:
    """A machine of one run: every number that wanders drawn anew."""
    off = random.standard_normal
    own = replace(
        machine,
        level=machine.level * (1.0 + wander.level * off()) * (1.0 + fault.friction),
        viscous=machine.viscous * (1.0 + wander.viscous * off()),
        offset=machine.offset + wander.offset * machine.level * off(),
        pressure_pa=machine.pressure_pa * (1.0 + wander.pressure * off()),
    )
    return Run(
        own,
        fault,
        fault.gain * (1.0 + wander.gain * off()),
        wander.place_zero * machine.stroke * off(),
        wander.gauge_zero_pa * off(),
        wander.warm,
        wander.warm_s,
        random.uniform(0.0, 1.0),
        (1.0 + wander.reference * off(), 1.0 + wander.reference * off()),
        random.uniform(0.0, 1.0),
    )


def strokes(
    run: Run, speeds: Sequence[float], seconds: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N,) time, wanted place and speed: to and fro over three quarters of the stroke, each speed
    in its own part of the time; turned smoothly, so that nothing rests.
    """
    m, (size, pace) = run.machine, run.reference
    half = 0.5 * 0.75 * m.stroke * size
    t = np.arange(0.0, seconds, PERIOD_S)
    part = np.minimum((t / seconds * len(speeds)).astype(int), len(speeds) - 1)
    rate = np.array(speeds)[part] * pace / half  # of the triangle's phase, quarter strokes a second
    phase = run.begins * 4.0 + np.cumsum(rate) * PERIOD_S
    # a triangle with its corners rounded: the arc sine of a sine that falls short of one
    place = half * np.arcsin(0.985 * np.sin(0.5 * np.pi * phase)) / math.asin(0.985)
    wide = np.ones(25) / 25.0  # 50 ms: where the speed changes it does not jump
    padded = np.concatenate([np.full(24, place[0]), place, np.full(24, place[-1])])
    place = np.convolve(np.convolve(padded, wide, "valid"), wide, "valid")
    return t, m.middle + place, np.gradient(place, PERIOD_S)


def recorded(
    run: Run, speeds: Sequence[float], seconds: float, random: np.random.Generator
) -> dict[str, np.ndarray]:
    """Columns of a log by name, (N,) each: ``t``, ``place``, ``force`` and, of a piston,
    ``pressure`` (absolute, Pa).
    """
    m = run.machine
    t, wanted, pace = strokes(run, speeds, seconds)
    place, force, pressure = _driven(run, t, wanted, pace)
    read_gain = run.gain if m.kind == "piston" else 1.0
    columns = {
        "t": t,
        "place": _read(place + run.place_zero, m.place_noise, m.steps[0], random),
        "force": _read(read_gain * force, m.force_noise, m.steps[1], random),
    }
    if m.kind == "piston":
        columns["pressure"] = _read(pressure + run.gauge_zero_pa, 40.0, 10.0, random)
    return columns


def _read(values: np.ndarray, noise: float, step: float, random: np.random.Generator) -> np.ndarray:
    return np.round((values + noise * random.standard_normal(len(values))) / step) * step


def _driven(
    run: Run, t: np.ndarray, wanted: np.ndarray, pace: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N,) place of the driven side, force asked of the drive (of a piston: that at its rod), and
    pressure.

    The force is held over a row, as a controller's is. A piston's is what pushes it in, against the
    gas; its pressure follows volume and regulator.
    """
    m, fault = run.machine, run.fault
    if fault.play > 0.0:
        first, second = m.motor_share * m.mass, (1.0 - m.motor_share) * m.mass
    else:
        first, second = m.mass, 0.0
    numbers = (
        first, second, 0.5 * fault.play * m.stroke, m.wall,
        0.6 * math.sqrt(m.wall * first * second / m.mass),
        m.level, m.rise, m.rise_speed, m.smooth_speed, m.viscous, run.warm * run.cold, run.warm_s,
        m.offset, fault.spot * m.level, fault.spot_at, fault.spot_half, m.middle, 0.5 * m.stroke,
        m.area, m.pressure_pa, m.volume,
    )  # fmt: skip
    drive_gain = 1.0 if m.kind == "piston" else run.gain
    place, force, pressure = _integrated(
        t, wanted, pace, m.stiffness, m.damping, drive_gain, np.array(numbers)
    )
    if not np.isfinite(place).all():
        raise ArithmeticError(f"the {m.kind} ran away, expected a step that is short enough")
    return place, force, pressure


@njit(cache=True)
def _slope(t, y, u, n):  # type: ignore[no-untyped-def]
    """d/dt of [x, v, pressure, x2, v2] under the force u of the drive; the second body is the
    guide's where there is a play, else there is none.
    """
    (first, second, half, wall, damping, level, rise, rise_speed, smooth, viscous, warm, warm_s,
     offset, spot, spot_at, spot_half, middle, half_stroke, area, set_pa, volume) = n  # fmt: skip
    x, v = (y[3], y[4]) if second > 0.0 else (y[0], y[1])
    way = (x - middle) / half_stroke
    sign = np.tanh(v / smooth)
    taken = level * (1.0 + rise * np.exp(-((v / rise_speed) ** 2))) * sign + offset
    taken += viscous * (1.0 + warm * np.exp(-t / warm_s)) * v
    taken += spot * np.exp(-(((way - spot_at) / spot_half) ** 2)) * sign
    found = np.zeros(5)
    if area > 0.0:
        taken += area * (y[2] - ATMOSPHERE_PA)
        # isothermal; a regulator lets in or out what is missing
        found[2] = y[2] * area * v / (volume - area * (x - middle)) + 8.0 * (set_pa - y[2])
    found[0] = y[1]
    if second == 0.0:
        found[1] = (u - taken) / first
        return found
    apart = y[0] - y[3]
    over = apart - half if apart > half else apart + half if apart < -half else 0.0
    contact = wall * over + damping * (y[1] - y[4]) if over != 0.0 else 0.0
    if contact * over < 0.0:
        contact = 0.0  # walls push and never pull
    found[1], found[3], found[4] = (u - contact) / first, y[4], (contact - taken) / second
    return found


@njit(cache=True)
def _integrated(t, wanted, pace, stiffness, damping, drive_gain, n):  # type: ignore[no-untyped-def]
    """The loop of controller and machine, row by row, by classical Runge-Kutta steps."""
    rows, h = len(t), PERIOD_S / SUBSTEPS
    place, force, pressure = np.empty(rows), np.empty(rows), np.empty(rows)
    y = np.array([wanted[0], pace[0], n[19], wanted[0], pace[0]])
    fed = n[18] * (n[19] - ATMOSPHERE_PA)  # a piston's gas, fed forward
    for k in range(rows):
        asked = fed + stiffness * (wanted[k] - y[0]) + damping * (pace[k] - y[1])
        place[k], force[k], pressure[k] = y[0], asked, y[2]
        u = drive_gain * asked
        for i in range(SUBSTEPS):
            now = t[k] + i * h
            a = _slope(now, y, u, n)
            b = _slope(now + 0.5 * h, y + 0.5 * h * a, u, n)
            c = _slope(now + 0.5 * h, y + 0.5 * h * b, u, n)
            d = _slope(now + h, y + h * c, u, n)
            y = y + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    return place, force, pressure

"""Rigs in motion with sensors that lie, drawn from a seed: what each law of motion is shown.

Plain physics of its own (Boyle, equation (1), a valve as a leak): no law is asked of itself.
What the laws say of it is recorded in recorded_laws.txt, written anew by

    python -m tests.safety.lying_rig
"""

import math
import random
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

from epa_rt.config.rig import Rig
from epa_rt.safety.fill_watch import FillWatch
from epa_rt.safety.gas_watch import ExchangeWatch, GasWatch, VolumeWatch
from epa_rt.safety.hose_watch import HoseWatch
from epa_rt.safety.motion_watch import CurrentWatch, JointWatch, LawWatch, TorqueWatch
from epa_rt.safety.muscle_law import geometry_of
from tests.safety.safety_bench import rig

RECORDED = Path(__file__).with_name("recorded_laws.txt")
NAMES = ("bench", "bench_analog", "knee", "mass")
SEEDS = range(30)
STEP_S, STEPS, SLOWER = 0.008, 1500, 3
ATMOSPHERE_PA, SUPPLY_PA = 101_325.0, 951_325.0
PRESSURE_LIES = ("sound", "sound", "frozen", "low", "high", "offset", "other", "jump")
FORCE_LIES = ("sound", "sound", "sound", "frozen", "dead", "low", "high")
TRAVEL_LIES = ("sound", "sound", "sound", "sound", "half", "double", "zero")
CURRENT_LIES = ("sound", "sound", "dead", "double", "half")
VALVE_LIES = ("sound", "sound", "sound", "stuck", "leaks", "slow")

Law = Callable[[dict[str, float], dict[str, float]], tuple[str, str, str] | None]


def shown(name: str, seed: int) -> Iterator[tuple[dict[str, float], dict[str, float]]]:
    """Measured signals and outputs, step by step."""
    on, chance = rig(name), random.Random(f"{name} {seed}")
    lies = {row: chance.choice(PRESSURE_LIES) for row in (m.pressure for m in on.muscles)}
    if len(on.muscles) > 1 and chance.random() < 0.4:
        lies = dict.fromkeys(lies, "other")
    force_lie, travel_lie = chance.choice(FORCE_LIES), chance.choice(TRAVEL_LIES)
    current_lie, valve_lie = chance.choice(CURRENT_LIES), chance.choice(VALVE_LIES)
    swings = chance.choice((0.0, 0.002, 0.008, 0.013))
    middle = chance.choice((0.0, 0.008, 0.014, 0.022, chance.uniform(-0.05, 0.08)))
    turn, starts_s = 2.0 * math.pi * chance.uniform(0.05, 1.5), chance.uniform(0.0, 3.0)
    noise_pa, noise_n = chance.choice((0.0, 500.0)), chance.choice((0.0, 0.7))
    follows, from_s = chance.choice((1.0, 0.1, -0.6, -1.0)), chance.uniform(1.0, 6.0)
    rate = chance.choice((4e4, 2e5, 4e5, 6e5))
    pulls_both = len(on.muscles) > 1 and chance.random() < 0.5
    plan = {m.name: _plan(chance) for m in on.muscles}
    gas_pa = dict.fromkeys(plan, ATMOSPHERE_PA)
    outputs = {row.name: row.safe for row in on.outputs} | _power(on, chance)
    measured = {row.name: 0.0 for row in on.inputs}
    held: dict[str, float] = {}
    for step in range(STEPS):
        time_s = step * STEP_S
        angle = turn * max(time_s - starts_s, 0.0)
        travel, speed = middle + swings * math.sin(angle), swings * turn * math.cos(angle)
        speed = speed if time_s > starts_s else 0.0
        read = {"half": 0.5, "double": 2.0}.get(travel_lie, 1.0) * travel
        measured[on.motor.position] = read + (0.007 if travel_lie == "zero" else 0.0)
        measured[on.motor.speed] = speed
        joint = 0.0
        if on.joint:
            joint = follows * (travel - middle) / on.joint.lever_arm
            if pulls_both:  # the motor and a hand at the joint stretch the muscles in turn
                joint = 0.10 * math.sin(angle)
                travel = middle + 0.2 * joint
                measured[on.motor.position] = travel
            measured[on.joint.position] = joint
        true, pull = {}, 0.0
        for muscle in on.muscles:
            law, valve = muscle.law, plan[muscle.name](time_s)
            length = law.rest_length + law.per_travel * travel + law.per_joint * joint
            volume = _volume(length, law.braid_length)
            true[muscle.name] = gas_pa[muscle.name] / volume
            gas_pa[muscle.name] += (
                STEP_S * volume * _flow(true[muscle.name], valve, rate, valve_lie)
            )
            outputs[muscle.inlet], outputs[muscle.exhaust] = float(valve == 1), float(valve == 2)
            if law.force:
                gauge_pa = max(true[muscle.name] - ATMOSPHERE_PA - 2e4, 0.0)
                area = 3.0 * length * length - law.braid_length**2
                pull = max(gauge_pa * area, 0.0) / (4.0 * math.pi * law.braid_turns**2)
                pull *= 1.0 + math.copysign(0.05, speed)
                measured[law.force] = _lie(
                    force_lie, pull + chance.gauss(0.0, noise_n), 0.0, time_s > from_s, held
                )
        for i, muscle in enumerate(on.muscles):
            other = on.muscles[i - 1].name if len(on.muscles) > 1 else muscle.name
            lie = lies[muscle.pressure]
            value = true[other if lie == "other" else muscle.name] + chance.gauss(0.0, noise_pa)
            measured[muscle.pressure] = _lie(
                lie, value, ATMOSPHERE_PA, time_s > from_s, held, muscle.name
            )
        if on.motor.current:
            friction_a = math.copysign(0.2, speed) if speed else 0.0
            gain = {"dead": 0.0, "double": 2.5, "half": 0.3}.get(current_lie, 1.0)
            measured[on.motor.current] = gain * (pull * 5.3e-4 / 0.0448 + friction_a)
        yield measured, outputs


def _plan(chance: random.Random) -> Callable[[float], int]:
    """A valve pair by time: 0 shut, 1 fill, 2 vent. Vented first, filled, then as it comes."""
    ends, states, at_s = [], [], chance.uniform(0.1, 0.8)
    ends.append(at_s)
    states.append(0)
    while at_s < STEPS * STEP_S:
        state = 1 if len(states) == 1 else chance.choice((0, 0, 0, 0, 1, 2))
        state = 0 if len(states) == 2 else state
        at_s += chance.choice((0.05, 0.3, 1.0, 5.0)) if state != 2 else chance.uniform(0.05, 0.6)
        ends.append(at_s)
        states.append(state)
    return lambda time_s: states[next(i for i, end in enumerate(ends) if time_s < end)]


def _volume(length: float, braid: float) -> float:
    """Of the volume at no-load length."""
    no_load = braid / math.sqrt(3.0)
    length = min(max(length, no_load), 0.95 * braid)
    return (braid * braid - length * length) * length / ((braid * braid - no_load**2) * no_load)


def _flow(pressure_pa: float, valve: int, rate: float, lie: str) -> float:
    """Pa/s at the muscle's volume."""
    if lie == "leaks" and valve == 0:
        return 0.3 * rate
    if valve == 1:
        left = max(SUPPLY_PA - pressure_pa, 0.0) / SUPPLY_PA
        share = {"stuck": 0.0, "slow": 0.1}.get(lie, 1.0)
        return share * rate * min(2.0 * left, 1.0)
    if valve == 2:
        return (rate if lie == "stuck" else 0.0) - (pressure_pa - ATMOSPHERE_PA) / 0.1
    return 0.0


def _lie(
    how: str,
    value: float,
    zero: float,
    has_begun: bool,
    held: dict[str, float],
    name: str = "force",
) -> float:
    if how == "frozen" and has_begun:
        return held.setdefault(name, value)
    if how == "jump" and has_begun:
        return value + 60e3
    if how == "dead":
        return zero
    return (
        zero
        + {"low": 0.6, "high": 1.6}.get(how, 1.0) * (value - zero)
        + (3e4 if how == "offset" else 0.0)
    )


def _power(on: Rig, chance: random.Random) -> dict[str, float]:
    is_on = chance.random() < 0.8
    if on.drive.interface == "analog":
        return {on.drive.enable: float(is_on)}
    mode = chance.choice((8.0, 9.0, 8.0, 10.0))
    return {on.drive.control_word: 15.0 if is_on else 0.0, on.drive.mode: mode}


def laws(on: Rig) -> dict[str, Law]:
    """Every law that a rig can be asked, by its name; the gas each step, the others each third."""
    found: dict[str, Law] = {}
    slow_s = SLOWER * STEP_S
    geometries = tuple(geometry_of(muscle, on) for muscle in on.muscles)
    for muscle, geometry in zip(on.muscles, geometries, strict=True):
        found[f"GasWatch {muscle.name}"] = GasWatch(muscle, on, STEP_S).step
        found[f"VolumeWatch {muscle.name}"] = VolumeWatch(muscle, geometry, on, slow_s).step
        if muscle.law.force:
            law = muscle.law.force
            found["LawWatch"] = LawWatch(muscle, law, geometry, on, slow_s).step
            found["FillWatch"] = FillWatch(muscle, law, geometry, on, slow_s).step
            found["TorqueWatch"] = TorqueWatch(on, law, 0.0448, slow_s).step
    if len(on.muscles) == 2:
        found["ExchangeWatch"] = ExchangeWatch(on.muscles, slow_s).step
        found["HoseWatch"] = HoseWatch(on.muscles, geometries, slow_s).step
    found["CurrentWatch"] = CurrentWatch(on, on.motor.current, on.motor.speed).step
    if on.joint:
        found["JointWatch"] = JointWatch(on, on.joint, slow_s).step
    return found


def said(name: str, seed: int) -> list[str]:
    """A line for each law: in how many steps it refuses, the first one and its words, and a
    checksum of all.
    """
    asked = laws(rig(name))
    refusals: dict[str, list[tuple[int, tuple[str, str, str]]]] = {law: [] for law in asked}
    for step, (measured, outputs) in enumerate(shown(name, seed)):
        for law, ask in asked.items():
            if step % SLOWER == 0 or law.startswith("GasWatch"):
                refusal = ask(measured, outputs)
                if refusal is not None:
                    refusals[law].append((step, refusal))
    return [f"{name} {seed} {law}: {_words(found)}" for law, found in refusals.items()]


def _words(found: list[tuple[int, tuple[str, str, str]]]) -> str:
    if not found:
        return "nothing"
    step, words = found[0]
    return f"{len(found)} ({zlib.crc32(repr(found).encode()):08x}); {step}: {' | '.join(words)}"


if __name__ == "__main__":
    lines = [line for name in NAMES for seed in SEEDS for line in said(name, seed)]
    RECORDED.write_text("\n".join(lines) + "\n", encoding="utf-8")

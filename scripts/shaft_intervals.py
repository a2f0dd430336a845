"""Do 95 % intervals hold the truth on rigs of others? Shafts of a simulator that shares nothing
with the diagnosis, each with one or two effects, diagnosed.

Every shaft has its own noise, encoder step, drag and inertia; half of them run laps. Prints JSON:
of every number of every hidden effect what is true, what was said, and whether its interval holds
that; and how many do with the blocks' scatter alone (without twins of the same motion read again).

  python scripts/shaft_intervals.py                 # 9 shafts, 2 min on two cores
  python scripts/shaft_intervals.py --seed 2 --rounds 3
"""

import argparse
import json
import tempfile
from pathlib import Path

import numpy as np

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.foreign import open_foreign

PERIOD_S, SUBSTEPS, SECONDS = 2e-3, 20, 32.0
STIFFNESS_NM, DAMPING_NM_S = 25.0, 1.5  # of the controller
INERTIA_KG_M2, DRAG_NM_S = 0.05, 0.2  # that the plant file believes
RIG = """rig: arm
kind: shaft
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {angle: arm_rad, torque: motor_nm}
settings: {typical_torque: 2 N*m, typical_speed: 3 rad/s, stroke: 2 rad}
"""
PLANT = (
    f"plant: arm\nkind: shaft\nshaft: {{inertia: {INERTIA_KG_M2} kg*m^2}}\nfriction: {{viscous:"
    f" {DRAG_NM_S} N*m*s/rad}}\n"
)

# By effect: torque (N m) that the load takes at an angle, a speed and a state, its level of dry
# friction at a speed (N m), and what is true of its numbers
SHAFTS = {
    "coulomb": (lambda q, v, z: 0.0, lambda v: 0.15, {"friction.coulomb_nm": 0.15}),
    "stribeck": (
        lambda q, v, z: 0.0,
        lambda v: 0.1 + 0.15 * np.exp(-((v / 0.15) ** 2)),
        {
            "friction.coulomb_nm": 0.1,
            "friction.stribeck_nm": 0.15,
            "friction.stribeck_speed_rad_s": 0.15,
        },
    ),
    "dahl": (
        lambda q, v, z: 0.2 * z,
        lambda v: 0.0,
        {"friction.dahl_nm": 0.2, "friction.dahl_distance_rad": 0.01},
    ),
    "gravity": (
        lambda q, v, z: 0.7 * np.sin(q) + 0.2 * np.cos(q),
        lambda v: 0.0,
        {"load.gravity_sine_nm": 0.7, "load.gravity_cosine_nm": 0.2},
    ),
    "viscous_quadratic": (
        lambda q, v, z: 0.06 * v * abs(v),
        lambda v: 0.0,
        {"friction.quadratic_nm_s2_rad2": 0.06},
    ),
    "cogging": (
        lambda q, v, z: 0.08 * np.sin(7.0 * q + 0.4),
        lambda v: 0.0,
        {"drive.cogging_nm": 0.08, "drive.cogging_periods": 7.0, "drive.cogging_phase_rad": 0.4},
    ),
    "offset": (lambda q, v, z: 0.09, lambda v: 0.0, {"friction.offset_nm": 0.09}),
    "spring": (lambda q, v, z: 0.3 * q, lambda v: 0.0, {"friction.spring_nm": 0.3}),
    "none": (lambda q, v, z: 0.0, lambda v: 0.0, {}),
}


def recorded(
    name: str, effect: str, random: np.random.Generator, rig: dict[str, float]
) -> Recording:
    """One log: a controller that holds its torque from row to row, semi-implicit Euler with 20
    steps a row, sticking where nothing overcomes dry friction.
    """
    torque_nm, dry_nm, _ = SHAFTS[effect]
    t, phase = np.arange(0.0, SECONDS, PERIOD_S), random.uniform(0.0, 2.0 * np.pi, 2)
    waves = (
        ((0.25, 0.6), (0.75, 0.25), (1.75, 0.08))
        if rig["laps"]
        else ((0.23, 0.6), (0.71, 0.25), (1.63, 0.08))
    )
    wanted = sum(
        size * np.sin(2.0 * np.pi * hertz * t + by)
        for (hertz, size), by in zip(waves, (0.0, *phase), strict=True)
    )
    turns, step = np.gradient(wanted, PERIOD_S), PERIOD_S / SUBSTEPS
    q, v, z, angle, torque = wanted[0], turns[0], 0.0, np.empty(len(t)), np.empty(len(t))
    for k in range(len(t)):
        read = q + random.normal(0.0, rig["noise_rad"])
        angle[k] = np.round(read / rig["step_rad"]) * rig["step_rad"] if rig["step_rad"] else read
        held = STIFFNESS_NM * (wanted[k] - angle[k]) + DAMPING_NM_S * (turns[k] - v)
        torque[k] = held + random.normal(0.0, rig["noise_nm"])
        for _ in range(SUBSTEPS):
            z += step * v / 0.01 * (1.0 - z * np.sign(v))
            free = (
                v + step * (held - torque_nm(q, v, z) - rig["drag_nm_s"] * v) / rig["inertia_kg_m2"]
            )
            v = free - np.sign(free) * min(abs(free), step * dry_nm(v) / rig["inertia_kg_m2"])
            q += step * v
    return Recording(
        name,
        f"{name}.mcap",
        "arm",
        "",
        "",
        PERIOD_S,
        np.arange(len(t)),
        {"arm_rad": angle, "motor_nm": torque},
        (Span("all", 0, len(t), True),),
    )


def diagnosed(logs: list[Recording], twins: bool) -> Diagnosis:
    with tempfile.TemporaryDirectory(prefix="epa-shafts-") as folder:
        (Path(folder) / "rig.yaml").write_text(RIG, encoding="utf-8")
        (Path(folder) / "plant.yaml").write_text(PLANT, encoding="utf-8")
        subject = open_foreign(Path(folder) / "rig.yaml")
        if not twins:
            subject.read_again = lambda *_: None
        return diagnose(subject, logs, how_far=False)


def one(effect: str, random: np.random.Generator) -> dict:
    rig = {
        "inertia_kg_m2": INERTIA_KG_M2 * (1.0 + 0.03 * random.standard_normal()),
        "drag_nm_s": DRAG_NM_S * (1.0 + 0.1 * random.standard_normal()),
        "noise_rad": float(random.choice([2e-6, 1e-5, 5e-5])),
        "noise_nm": float(random.choice([2e-3, 1e-2])),
        "step_rad": float(random.choice([0.0, 1e-4])),
        "laps": bool(random.integers(2)),
    }
    logs, true = [recorded(f"log{k}", effect, random, rig) for k in range(3)], SHAFTS[effect][2]
    with_twins, alone = (diagnosed(logs, twins) for twins in (True, False))
    rows = [held(answer, true) for answer in (with_twins, alone)]
    return {
        "effect": effect,
        **rig,
        "verdict": with_twins.verdict,
        "named": [(found.name, round(found.confidence, 2)) for found in with_twins.effects],
        "numbers": rows[0],
        "alone": rows[1],
    }


def held(answer: Diagnosis, true: dict[str, float]) -> list[dict]:
    """Every number that is true of the rig, and whether what was said of it holds it; nothing said
    does not.
    """
    said = {number.name: number for found in answer.effects for number in found.parameters}
    return [
        {
            "name": name,
            "true": value,
            "held": name in said and said[name].low <= value <= said[name].high,
            **(
                {"value": said[name].value, "low": said[name].low, "high": said[name].high}
                if name in said
                else {}
            ),
        }
        for name, value in true.items()
    ]


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--rounds", type=int, default=1, help="of all shafts")
    given = arguments.parse_args()
    random = np.random.default_rng(given.seed)
    found = [one(effect, random) for _ in range(given.rounds) for effect in SHAFTS]
    counts = {
        key: [
            sum(number["held"] for row in found for number in row[rows]),
            sum(len(row[rows]) for row in found),
        ]
        for key, rows in (("held", "numbers"), ("held_by_blocks_alone", "alone"))
    }
    print(json.dumps({"seed": given.seed, **counts, "shafts": found}, indent=1))


if __name__ == "__main__":
    main()

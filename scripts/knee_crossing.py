"""How often two parallel pressures change places over frequency, as Fig. 9 says, among random
physical knees at equal motion.

Draws knees within engineering ranges (seeded), gives each the nine conditions' SPAM of 185 kPa with
PPAM none, 145 and 170 kPa under the catalogue's servo, and counts: knees that follow the motion, of
these all that save at every frequency, and those where 170 kPa saves more at the lowest and 145 kPa
more at the highest frequency. Figures in docs/reproduction.md's knee part.

  python scripts/knee_crossing.py [KNEES]
"""

import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.models.plant_file import load_plant
from epa_rt.study.knee_study import at_setting

SPAM_PA, PPAM_PA, VENTED_PA = 185e3, (145e3, 170e3), 101325.0
FREQUENCIES_HZ = (0.5, 1.0, 1.5, 2.0)
SWING_RAD = np.radians(10.0)
SEED = 5
RANGES = {
    "mass_kg": (0.8, 1.6),
    "mass_lever_m": (0.15, 0.24),
    "inertia_over_point_mass": (1.2, 1.7),
    "diameter_m": (0.020, 0.026),
    "pre_stretch_m": (0.004, 0.016),
    "gear": (19.0, 60.0),
    "spool_m": (0.015, 0.025),
    "slip_ratio": (0.0, 0.20),
    "viscous_n_s_m": (1.0, 40.0),
    "motor_friction_nm": (0.001, 0.008),
}


def knee(drawn: dict[str, float]) -> np.ndarray:
    params = load_plant(ROOT / "config/plants/knee.yaml").params
    load, muscle, gear = params["load"][0], params["muscle"][0], params["transmission"][0]
    load["mass_kg"], load["mass_lever_m"] = drawn["mass_kg"], drawn["mass_lever_m"]
    load["inertia_kg_m2"] = (
        drawn["inertia_over_point_mass"] * drawn["mass_kg"] * drawn["mass_lever_m"] ** 2
    )
    b = float(muscle[0]["braid_length_m"])
    muscle["braid_turns_ratio"] = np.sqrt(b**2 - 0.15**2) / (np.pi * drawn["diameter_m"])
    load["rest1_m"] = b / np.sqrt(3.0) + drawn["pre_stretch_m"]
    gear["gear_ratio"], gear["spool_radius_m"] = drawn["gear"], drawn["spool_m"]
    muscle[1]["slip_ratio"], muscle[1]["viscous_n_s_m"] = (
        drawn["slip_ratio"],
        drawn["viscous_n_s_m"],
    )
    params["drive"]["coulomb_nm"] = drawn["motor_friction_nm"]
    return params


def saved(params: np.ndarray) -> np.ndarray | None:
    """Saved energy (2, frequencies) at 145 and 170 kPa; None where the knee does not follow within
    5 %.
    """
    amplitude_m = 0.5 * SWING_RAD * float(params["load"]["lever_m"][0])
    found = [
        [
            at_setting(params, amplitude_m, (SPAM_PA, ppam, 2.0 * np.pi * hz))
            for hz in FREQUENCIES_HZ
        ]
        for ppam in (VENTED_PA, *PPAM_PA)
    ]
    motion = np.array([[one["motion_m"] for one in row] for row in found]) / (2.0 * amplitude_m)
    energy = np.array([[one["energy_a2_s"] for one in row] for row in found])
    if not (np.isfinite(energy).all() and np.all(np.abs(motion - 1.0) < 0.05)):
        return None
    return 1.0 - energy[1:] / energy[0]


def main() -> None:
    knees = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    rng = np.random.default_rng(SEED)
    count = {
        "drawn": knees,
        "follow": 0,
        "always save": 0,
        "cross": 0,
        "cross and always save": 0,
        "145 kPa always more, and both save": 0,
    }
    crossing = []
    for _ in range(knees):
        drawn = {name: float(rng.uniform(*ends)) for name, ends in RANGES.items()}
        ratio = saved(knee(drawn))
        if ratio is None:
            continue
        saves, crosses = (
            bool(ratio.min() > 0.0),
            bool(ratio[1, 0] > ratio[0, 0] and ratio[1, -1] < ratio[0, -1]),
        )
        count["follow"] += 1
        count["always save"] += saves
        count["cross"] += crosses
        count["cross and always save"] += saves and crosses
        count["145 kPa always more, and both save"] += saves and bool((ratio[0] > ratio[1]).all())
        if saves and crosses:
            crossing.append(
                {
                    **{name: round(value, 4) for name, value in drawn.items()},
                    "saved_145": ratio[0].round(3).tolist(),
                    "saved_170": ratio[1].round(3).tolist(),
                }
            )
    print(
        json.dumps(
            {"seed": SEED, "frequencies_hz": FREQUENCIES_HZ, **count, "examples": crossing[:3]},
            indent=1,
        )
    )


if __name__ == "__main__":
    main()

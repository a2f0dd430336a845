"""What the two thresholds of narrow lines stand between: lines that have to be taken out, and what
must not be.

Hum of known size beside motions, hum that lasts for a part of the log, and motions alone whose
rig is not linear. Prints JSON: for each threshold its value, the least of what has to pass it and
the largest of what must not, at the stated quantile; and how many lines were found or made up.

  python scripts/line_thresholds.py --size 20
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.gap.hygiene import lines
from epa_rt.gap.recording import Recording

PERIOD_S, ROWS = 1e-3, 6000
T = np.arange(ROWS) * PERIOD_S
FORCE = "muscle_force_n"
QUANTILE = 0.02  # of lines may fail a threshold, of what is none pass it


def motions(random: np.random.Generator) -> dict[str, np.ndarray]:
    """Commanded travel in m, by kind; every number drawn anew."""
    size, hertz = random.uniform(2e-3, 8e-3), random.uniform(1.0, 14.0)
    parts = random.choice(np.arange(2, 25), 4, replace=False)
    many = [np.sin(2.0 * np.pi * f * T + random.uniform(0.0, 6.3)) for f in parts]
    return {
        "sine": size * np.sin(2.0 * np.pi * hertz * T),
        "chirp": size * np.sin(2.0 * np.pi * (hertz * T + random.uniform(1.0, 4.0) * T**2)),
        "multisine": 0.3 * size * np.sum(many, axis=0),
        "steps": size * np.sign(np.sin(2.0 * np.pi * random.uniform(0.5, 3.0) * T)),
    }


def log(asked: np.ndarray, hum: np.ndarray, random: np.random.Generator) -> Recording:
    """A travel that follows late, and a force that is not linear in it, with hum (N)."""
    travel = np.roll(asked, int(random.integers(3, 12)))
    pull = 3e4 * travel + 2e6 * travel**2 + 5e8 * travel**3 + 20.0 * np.sign(np.gradient(travel))
    columns = {
        "cmd_motor_travel_m": asked,
        "motor_travel_m": travel + 1e-6 * random.standard_normal(ROWS),
        FORCE: pull + hum + 0.5 * random.standard_normal(ROWS),
    }
    return Recording("made", "", "rig", "", "", PERIOD_S, np.arange(ROWS), columns, ())


def drawn(size: int, seed: int) -> dict[str, list[float]]:
    """By name what was measured of lines and of what is none."""
    random = np.random.default_rng(seed)
    found: dict[str, list[float]] = {
        name: []
        for name in ("share", "share_of_part", "stands_out", "stands_out_alone", "found", "made_up")
    }
    for _ in range(size):
        for asked in motions(random).values():
            hertz, newton = random.uniform(45.0, 200.0), random.uniform(3.0, 20.0)
            hum = newton * np.sin(2.0 * np.pi * hertz * T + random.uniform(0.0, 6.3))
            part = random.uniform(0.3, 0.6)  # of the log: one trial of two or three
            whole, short = log(asked, hum, random), log(asked, hum * (part > T / T[-1]), random)
            alone, frequency = log(asked, 0.0 * hum, random), hertz * PERIOD_S
            for one, name in ((whole, "share"), (short, "share_of_part")):
                (cut,) = lines._logs([one])
                found[name].append(lines._seen(cut, FORCE, frequency).share)
            (cut,) = lines._logs([whole])
            found["stands_out"].append(lines.stands_out(cut, FORCE, frequency))
            (cut,) = lines._logs([alone])
            peaks, _ = lines._candidates(cut.still(FORCE))
            tall = [
                lines.stands_out(cut, FORCE, at)
                for at, _ in peaks
                if lines._seen(cut, FORCE, at).counts
            ]
            found["stands_out_alone"].append(max(tall, default=0.0))
            findings = [one for one in lines.check_lines([whole]) if one.sinusoids]
            found["found"].append(
                any(abs(one.sinusoids[0].frequency / PERIOD_S - hertz) < 0.5 for one in findings)
            )
            found["made_up"].append(bool(lines.check_lines([alone])))
    return found


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--size", type=int, default=20, help="of every motion")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    found = drawn(given.size, given.seed)

    def between(value: float, lines_: str, none: str) -> dict[str, float]:
        return {
            "value": value,
            "lines_have": round(float(np.quantile(found[lines_], QUANTILE)), 3),
            "none_has": round(float(np.quantile(found[none], 1.0 - QUANTILE)), 3),
        }

    answer = {
        "logs": len(found["found"]),
        "share that runs on": between(lines._ALL_ALONG, "share", "share_of_part"),
        "times those beside it": between(lines._STANDS_OUT, "stands_out", "stands_out_alone"),
        "lines_found": int(np.sum(found["found"])),
        "lines_made_up": int(np.sum(found["made_up"])),
    }
    print(json.dumps(answer, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Errors of readings that no law of the catalogue describes: is the place found all the same?

Logs of the simulated bench are run again with other nominal parameters and noise, and one reading
of them is bent by an error of its own: hysteresis, a step of a converter, a cubic bow, a lag in one
direction. Prints JSON: for each error where it was placed, and how many are right. ``--whole`` asks
for the whole diagnosis by the posterior as well, which takes about two minutes for each.

  python scripts/reading_errors.py --seed 11
  python scripts/reading_errors.py --only force_hysteresis --whole
"""

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.cli.gap.inputs import opened
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.diagnosis import likely
from epa_rt.gap.likelihood.start import at_base
from epa_rt.gap.likelihood.stop_operator import stop_over_log
from epa_rt.gap.recording import Recording
from epa_rt.gap.subject import Subject
from epa_rt.gap.where.origin import origins

RIG = ROOT / "config/rigs/bench.yaml"
EXPERIMENTS = ("identification_short", "step")
FORCE, PRESSURE, CURRENT = "muscle_force_n", "muscle_pressure_pa", "motor_current_a"
WANDERS = 0.7  # of its spread: deviation of a nominal parameter of the rig from the plant file

Error = Callable[[np.ndarray, float], np.ndarray]  # reading (N,), period (s) -> error (N,)


class Bent(NamedTuple):
    """A reading that is off: the place that is right, the column, and its error."""

    place: str
    column: str
    error: Error


def _memory(half: float, part: float) -> Error:
    """A part of a play operator's stop: where the reading came from."""
    return lambda x, _: -part * stop_over_log(np.ascontiguousarray(x), half)


def _behind(x: np.ndarray, period_s: float, rising_s: float, falling_s: float) -> np.ndarray:
    """A reading behind a lag that is another one on the way down, less the reading."""
    shown = x.copy()
    for k in range(1, len(x)):
        lag_s = rising_s if x[k] > shown[k - 1] else falling_s
        shown[k] = shown[k - 1] + (x[k] - shown[k - 1]) * period_s / (lag_s + period_s)
    return shown - x


ERRORS: dict[str, Bent] = {
    "force_hysteresis": Bent("force_cell", FORCE, _memory(3.0, 0.4)),
    "force_cubic": Bent("force_cell", FORCE, lambda x, _: 2.0 * (x / 60.0) ** 3),
    "force_saturates": Bent("force_cell", FORCE, lambda x, _: -0.15 * np.maximum(x - 40.0, 0.0)),
    "force_slow_when_falling": Bent("force_cell", FORCE, lambda x, dt: _behind(x, dt, 1e-4, 0.03)),
    "pressure_hysteresis": Bent("gauge", PRESSURE, _memory(6e3, 0.5)),
    "pressure_cubic": Bent("gauge", PRESSURE, lambda x, _: 4e3 * ((x - 2.5e5) / 1.5e5) ** 3),
    "pressure_step": Bent("gauge", PRESSURE, lambda x, _: 2e3 * (x > 2.2e5)),
    "pressure_slow_when_rising": Bent("gauge", PRESSURE, lambda x, dt: _behind(x, dt, 0.05, 1e-4)),
    "current_dead_zone": Bent("current_reading", CURRENT, lambda x, _: -np.clip(x, -0.03, 0.03)),
    "current_hysteresis": Bent("current_reading", CURRENT, _memory(0.1, 0.3)),
}


def main() -> int:
    given = _arguments()
    with tempfile.TemporaryDirectory() as folder:
        subject, recordings = _recorded(Path(folder))
    rows = {}
    for number, (name, bent) in enumerate(ERRORS.items()):
        if given.only and name not in given.only:
            continue
        logs = _of_a_rig(subject, recordings, np.random.default_rng((given.seed, number)))
        rows[name] = _asked(subject, [_off(log, bent) for log in logs], bent, given.whole)
        print(f"{name}: {rows[name]}", file=sys.stderr)
    right = sum(bool(row["right"]) for row in rows.values())
    print(json.dumps({"errors": len(rows), "right_place": right, "by_error": rows}, indent=1))
    return 0


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1, help="of nominal parameters and noise")
    parser.add_argument("--only", nargs="+", choices=tuple(ERRORS), help="these errors alone")
    parser.add_argument("--whole", action="store_true", help="the whole diagnosis as well")
    return parser.parse_args()


def _recorded(folder: Path) -> tuple[Subject, Sequence[Recording]]:
    """Logs of the bench as its plant file has it: what is asked of it, and when."""
    for name in EXPERIMENTS:
        words = ["run", ROOT / f"config/experiments/{name}.yaml", "--rig", RIG]
        words += ["--backend", "sim", "-o", folder / f"{name}.mcap"]
        subprocess.run(
            [sys.executable, "-m", "epa_rt", *map(str, words)],
            check=True,
            cwd=ROOT,
            stdout=subprocess.DEVNULL,
        )
    logs = sorted(folder.glob("**/*.mcap"))
    found = opened(argparse.Namespace(rig=RIG, plant=None, logs=logs), ())
    return found.subject, found.recordings


def _of_a_rig(
    subject: Subject, recordings: Sequence[Recording], random: np.random.Generator
) -> list[Recording]:
    """The same commands on a rig whose nominal parameters are not the plant file's."""
    values = {
        knob.key: float(
            np.clip(knob.value + WANDERS * knob.spread * random.normal(), knob.low, knob.high)
        )
        for knob in subject.nominal
    }
    made = []
    for one in recordings:
        run = subject.free_run(one, values, int(random.integers(1 << 31)))
        assert run is not None
        made.append(replace(run, name=one.name))
    return made


def _off(log: Recording, bent: Bent) -> Recording:
    reading = log.columns[bent.column]
    moved = reading + bent.error(reading, log.period_s)
    return replace(log, columns={**log.columns, bent.column: moved})


def _asked(
    subject: Subject, logs: Sequence[Recording], bent: Bent, whole: bool
) -> dict[str, object]:
    problem, base, _ = at_base(subject, logs)
    found = likely(origins(problem, base.values))
    row: dict[str, object] = {
        "truth": bent.place,
        "placed": [one.place for one in found],
        "explains": round(found[0].explained_share, 3) if found else None,
        "right": bool(found) and found[0].place == bent.place,
    }
    if whole:
        answer = diagnose(subject, logs)
        row |= {
            "verdict": answer.verdict,
            "names": {one.name: round(one.confidence, 2) for one in answer.effects},
            "unknown": round(answer.posterior.unknown, 2) if answer.posterior else None,
        }
    return row


if __name__ == "__main__":
    sys.exit(main())

"""What the numbers of a baseline stand between, on the machines of scripts/outsider_machines.py.

Prints JSON by machine. ``like``: the part of their range by which healthy runs of one motion differ
at the most, and the least by which runs of the other motion do. ``inflation``: of the variance of
each quantity as the others are fitted beside it, at one speed and at several. ``fitted``: how far
the plant's numbers move, in their stated spreads, as twice as many runs are fitted.

  python scripts/baseline_numbers.py --runs 4
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.cli.gap.inputs import opened
from epa_rt.gap.likelihood.regressors import SPEEDS
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign import healthy
from epa_rt.gap.rig.foreign.subject import ForeignSubject
from scripts.outsider_machines import MACHINES
from scripts.seeded_faults import SECONDS, log_of, rig_folder


def recordings(
    folder: Path, kind: str, pace: str, runs: int, seed: int
) -> tuple[ForeignSubject, Sequence[Recording]]:
    """Healthy runs of a machine, opened as anybody's are."""
    rig = rig_folder(folder / f"{kind}_{pace}", kind)
    random = np.random.default_rng([seed, list(MACHINES).index(kind), len(pace)])
    logs = [
        log_of(rig.parent, f"healthy_{i}", MACHINES[kind], "healthy", pace, random)
        for i in range(runs)
    ]
    found = opened(argparse.Namespace(rig=rig, plant=None, logs=logs))
    return found.subject, found.recordings


def apart(own: healthy.States, others: healthy.States) -> float:
    """The largest part of the others' range by which a run's ends of a state are off its middle."""
    found = [0.0]
    for key, ends in own.items():
        low, high = (float(np.median(end)) for end in others[key])
        room = high if key[1].endswith(SPEEDS) else high - low
        off = np.maximum(np.abs(ends[0] - low), np.abs(ends[1] - high))
        found.append(float(off.max()) / room)
    return max(found)


def inflations(subject: ForeignSubject, runs: Sequence[Recording]) -> dict[str, float]:
    """Of every quantity of the first link that is judged, in the mean over runs."""
    known = healthy.healthy_from(subject, runs)
    link, own = next(iter(known.links.items()))
    keys = [k for k in healthy.quantity_keys(known.subject) if link in known.subject.touched(k)]
    found = []
    for run in runs:
        made = known.subject.prepare(run)
        weights = own.regions.weights(known.subject.features(made, link))
        levels = [healthy.level_of(known.subject, key) for key in keys]
        shapes = weights[:, None] * healthy.shapes_of(known.subject, made, link, levels)
        shapes = shapes[np.isfinite(shapes).all(axis=1)]
        shapes = shapes[:, np.any(shapes != 0.0, axis=0)]
        shapes /= np.sqrt(np.mean(shapes**2, axis=0))
        found.append(healthy.inflation(shapes.T @ shapes / len(shapes)))
    return dict(zip(keys, np.round(np.mean(found, axis=0), 1).tolist(), strict=True))


def moved(subject: ForeignSubject, runs: Sequence[Recording]) -> float:
    """The furthest that a number moves as MOST_FITTED runs more are fitted, in its spreads."""
    half = runs[: healthy.MOST_FITTED]
    few = healthy.refitted(subject, half).plant.numbers
    many = healthy.refitted(subject, runs, len(runs)).plant.numbers
    return max(
        abs(many[key] - few[key]) / (subject.knobs[key].spread or 1.0)
        for key in few
        if key in subject.knobs
    )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=6, help="healthy runs of every motion")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--machines", nargs="+", default=list(MACHINES), choices=list(MACHINES))
    parser.add_argument("--fits", action="store_true", help="also how many runs need be fitted")
    given = parser.parse_args()
    answer: dict[str, object] = {
        "LIKE": healthy.LIKE,
        "TOLD_APART": healthy.TOLD_APART,
        "MOST_FITTED": healthy.MOST_FITTED,
    }
    with tempfile.TemporaryDirectory(prefix="baseline-") as folder:
        for kind in given.machines:
            made = {
                pace: recordings(Path(folder), kind, pace, given.runs, given.seed)
                for pace in SECONDS
            }
            states = {pace: healthy.states_of(*one) for pace, one in made.items()}
            row: dict[str, object] = {
                "like": {
                    "one_motion": round(max(apart(s, s) for s in states.values()), 3),
                    "another": round(apart(states["several"], states["one_speed"]), 3),
                },
                "inflation": {pace: inflations(*one) for pace, one in made.items()},
            }
            if given.fits:
                both = 2 * healthy.MOST_FITTED
                subject, runs = recordings(
                    Path(folder) / "fits", kind, "several", both, given.seed + 1
                )
                row["fitted"] = round(moved(subject, runs), 3)
            answer[kind] = row
            print(kind, json.dumps(row), file=sys.stderr, flush=True)
    print(json.dumps(answer, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())

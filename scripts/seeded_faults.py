"""Seeded faults as a maintenance engineer asks: healthy runs that wander, then one fault, diagnosed
with the healthy runs as baseline and without.

Recordings of a carriage, a shaft and a piston come from scripts/outsider_machines.py and go through
import, checks and diagnosis as anybody's do. Prints JSON: per cell what was said, and in sum how
many healthy cases name a fault, how many faults are named wrongly at confidence 0.8 and more, how
many rightly, and what one speed leaves as a set.

  python scripts/seeded_faults.py --size 2 --json faults.json
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.diagnose import diagnose_logs
from epa_rt.gap.diagnosis import Diagnosis
from epa_rt.logs.importers.log_of import log_of as imported
from scripts.outsider_machines import FAULTS, HEALTHY, MACHINES, PERIOD_S, Machine, drawn, recorded

HEALTHY_RUNS = 20
SURE = 0.8  # confidence from which a wrong name is held against the diagnosis
TOGETHER = 0.95  # probability that the posterior's set holds
SECONDS = {"one_speed": 12.0, "several": 18.0}
# families that a fault may rightly be named by; a cell's scale changes the area that a piston seems
# to have
RIGHT = {
    "friction": ("friction", "stribeck"),
    "play": ("backlash",),
    "rough_spot": ("rough_spot", "place"),
    "gain": ("gain", "area"),
}
# A piston's gas pushes with 200 N to one side and holds its play closed against 35 N of friction,
# drag and inertia. What shows is the give of the wall: friction builds up over it.
RIGHT_OF = {("piston", "play"): ("reversal",)}
NOTHING = ("no_gap", "not_excited")

RIG = {
    "carriage": """rig: outsider_carriage
kind: carriage
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {position: place_m, force: drive_n}
settings: {typical_force: 45 N, typical_speed: 0.12 m/s, stroke: 0.3 m, middle: 0.2 m}
""",
    "shaft": """rig: outsider_shaft
kind: shaft
plant: plant.yaml
rate: 100 Hz
lowpass: 40 Hz
channels: {angle: place_rad, torque: drive_nm}
settings: {typical_torque: 0.9 N*m, typical_speed: 1.2 rad/s, stroke: 2.4 rad}
""",
    "piston": """rig: outsider_piston
kind: piston
plant: plant.yaml
rate: 100 Hz
lowpass: 20 Hz
channels: {position: place_m, pressure: gas_pa, force: rod_n}
settings: {typical_force: 20 N, typical_speed: 0.03 m/s, stroke: 60 mm, middle: 30 mm}
""",
}
# as a data sheet has it: each number some percent off the machine's own
PLANT = {
    "carriage": """plant: outsider_carriage
kind: carriage
carriage: {inertia: 20.5 kg}
friction: {viscous: 100 N*s/m}
effects:
  coulomb: {coulomb: 25 N}
  offset: {offset: 1.9 N}
  stribeck: {stribeck: 5.5 N, stribeck_speed: 0.011 m/s}
""",
    "shaft": """plant: outsider_shaft
kind: shaft
shaft: {inertia: 0.051 kg*m^2}
friction: {viscous: 0.13 N*m*s/rad}
effects:
  coulomb: {coulomb: 0.36 N*m}
  offset: {offset: 0.028 N*m}
  stribeck: {stribeck: 0.065 N*m, stribeck_speed: 0.11 rad/s}
""",
    "piston": """plant: outsider_piston
kind: piston
piston: {area: 502 mm^2}
friction: {viscous: 130 N*s/m}
effects:
  coulomb: {coulomb: 14.5 N}
  stribeck: {stribeck: 4 N, stribeck_speed: 4.4 mm/s}
""",
}
MAP = """mapping: {rig}
rig: {rig}
experiment: {experiment}
format: {{kind: npz}}
clock: {{column: t, unit: s, period: {period_ms:g} ms}}
measured:
{columns}"""
COLUMNS = {
    "carriage": "  place_m: {column: place, unit: m}\n  drive_n: {column: force, unit: N}\n",
    "shaft": "  place_rad: {column: place, unit: rad}\n  drive_nm: {column: force, unit: N*m}\n",
    "piston": (
        "  place_m: {column: place, unit: m}\n  rod_n: {column: force, unit: N}\n"
        "  gas_pa: {column: pressure, unit: Pa abs}\n"
    ),
}


@dataclass(frozen=True)
class Case:
    """One diagnosis: what was seeded, and what was said of it."""

    machine: str
    speeds: str
    fault: str
    seed: int
    baseline: bool
    verdict: str
    named: tuple[str, ...]
    families: tuple[str, ...]
    confidence: float
    alike: tuple[str, ...]  # not to be told from the first name
    posterior_set: tuple[
        str, ...
    ]  # the fewest sets of effects that hold TOGETHER; empty: not asked
    moved: tuple[str, ...]  # since the baseline, by how many spreads
    judged: str  # "right", "set", "nothing", "withheld", "wrong"
    seconds: float


def rig_folder(folder: Path, kind: str) -> Path:
    """Writes rig and plant file of a machine; the rig file's path."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "plant.yaml").write_text(PLANT[kind], encoding="utf-8")
    (folder / "rig.yaml").write_text(RIG[kind], encoding="utf-8")
    for speeds in SECONDS:
        text = MAP.format(
            rig=f"outsider_{kind}",
            experiment=speeds,
            period_ms=PERIOD_S * 1e3,
            columns=COLUMNS[kind],
        )
        (folder / f"map_{speeds}.yaml").write_text(text, encoding="utf-8")
    return folder / "rig.yaml"


def log_of(
    folder: Path, name: str, machine: Machine, fault: str, speeds: str, random: np.random.Generator
) -> Path:
    """Records one run and imports it; the log's path."""
    run = drawn(machine, FAULTS.get(fault, HEALTHY), random)
    chosen = machine.speeds[:1] if speeds == "one_speed" else machine.speeds
    source, log = folder / f"{name}.npz", folder / f"{name}.mcap"
    np.savez(source, **recorded(run, chosen, SECONDS[speeds], random))
    imported(folder / f"map_{speeds}.yaml", [source], log)
    source.unlink()
    return log


def judged(kind: str, fault: str, answer: Diagnosis, families: dict[str, str]) -> str:
    """What an answer is worth: a name of a healthy machine, or of another family, is wrong; not a
    set that holds the right one. ``families``: of the catalogue's effects.
    """
    healthy = fault in ("healthy", "unseen_spot")
    if not answer.effects:
        if answer.verdict in NOTHING:
            return "right" if healthy else "nothing"
        return "wrong" if healthy else "withheld"
    if healthy:
        return "wrong"
    first, right = answer.effects[0], RIGHT_OF.get((kind, fault), RIGHT[fault])
    if first.family in right:
        return "right"
    alike = {families[name] for name in first.not_separable_from}
    held = answer.verdict == "not_separable" and alike & set(right)
    return "set" if held else "wrong"


def asked(
    machine: str, speeds: str, fault: str, seed: int, rig: Path, log: Path, healthy: Sequence[Path]
) -> Case:
    """One diagnosis through the one path."""
    begun = time.monotonic()
    opened, answer = diagnose_logs(rig, None, [log], baseline=healthy)
    families = {effect.name: effect.family for effect in opened.subject.catalogue}
    first = answer.effects[0] if answer.effects else None
    return Case(
        machine,
        speeds,
        fault,
        seed,
        bool(healthy),
        answer.verdict,
        tuple(one.name for one in answer.effects),
        tuple(one.family for one in answer.effects),
        round(first.confidence, 3) if first else 0.0,
        first.not_separable_from if first else (),
        _most_probable(answer),
        tuple(f"{one.name} {one.spreads:+.1f}" for one in answer.changes),
        judged(machine, fault, answer, families),
        round(time.monotonic() - begun, 1),
    )


def _most_probable(answer: Diagnosis) -> tuple[str, ...]:
    """The fewest models of the posterior that hold TOGETHER."""
    if answer.posterior is None:
        return ()
    models = [("+".join(one.effects) or "none", one.probability) for one in answer.posterior.models]
    models.append(("?", answer.posterior.unknown))
    found, held = [], 0.0
    for name, probability in sorted(models, key=lambda one: -one[1]):
        found.append(f"{name} {probability:.2f}")
        held += probability
        if held >= TOGETHER:
            break
    return tuple(found)


def cases(
    folder: Path,
    seeds: Sequence[int],
    machines: Sequence[str],
    faults: Sequence[str],
    speeds: Sequence[str],
    runs: int,
    without: bool,
) -> Iterator[Case]:
    """All cells of every seed, one seed after the other."""
    for seed in seeds:
        for kind in machines:
            for pace in speeds:
                place = folder / f"{kind}_{pace}_{seed}"
                rig = rig_folder(place, kind)
                random = np.random.default_rng([seed, list(MACHINES).index(kind), len(pace)])
                made = [
                    log_of(place, f"healthy_{i}", MACHINES[kind], "healthy", pace, random)
                    for i in range(runs)
                ]
                for fault in faults:
                    log = log_of(place, f"judged_{fault}", MACHINES[kind], fault, pace, random)
                    for healthy in (made, []) if without else (made,):
                        yield asked(kind, pace, fault, seed, rig, log, healthy)


def summed(found: Sequence[Case]) -> dict[str, dict[str, float | int]]:
    """The figures of the bench, with the baseline and without."""
    rows = {}
    for baseline in (True, False):
        own = [one for one in found if one.baseline == baseline]
        healthy = [one for one in own if one.fault in ("healthy", "unseen_spot")]
        faulty = [one for one in own if one not in healthy]
        if own:
            rows["baseline" if baseline else "without"] = {
                "healthy": len(healthy),
                "healthy_named": sum(bool(one.named) for one in healthy),
                "healthy_silent": sum(one.judged == "right" for one in healthy),
                "faults": len(faulty),
                "right": sum(one.judged == "right" for one in faulty),
                "set": sum(one.judged == "set" or bool(one.alike) for one in faulty),
                "withheld": sum(one.judged == "withheld" for one in faulty),
                "nothing_said": sum(one.judged == "nothing" for one in faulty),
                "wrong": sum(one.judged == "wrong" for one in faulty),
                "wrong_at_0.8": sum(
                    one.judged == "wrong" and one.confidence >= SURE for one in faulty
                ),
                "seconds": round(float(np.median([one.seconds for one in own])), 1),
            }
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--size", type=int, default=1, help="seeds of every cell")
    parser.add_argument("--seed", type=int, default=1, help="the first seed")
    parser.add_argument("--machines", nargs="+", default=list(MACHINES), choices=list(MACHINES))
    parser.add_argument(
        "--faults",
        nargs="+",
        default=["healthy", *FAULTS],
        choices=["healthy", *FAULTS],
        help="what is seeded",
    )
    parser.add_argument("--speeds", nargs="+", default=list(SECONDS), choices=list(SECONDS))
    parser.add_argument("--runs", type=int, default=HEALTHY_RUNS, help="healthy runs of a baseline")
    parser.add_argument("--without", action="store_true", help="also without the baseline")
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no case after so long")
    parser.add_argument("--json", type=Path, help="write the answer there as well, case by case")
    given = parser.parse_args()
    begun, found = time.monotonic(), []
    with tempfile.TemporaryDirectory(prefix="seeded-") as folder:
        seeds = range(given.seed, given.seed + given.size)
        try:
            for case in cases(
                Path(folder),
                seeds,
                given.machines,
                given.faults,
                given.speeds,
                given.runs,
                given.without,
            ):
                found.append(case)
                print(_line(case), file=sys.stderr, flush=True)
                if time.monotonic() - begun > 60.0 * given.minutes:
                    break
        except KeyboardInterrupt:
            print("interrupted; what was found until then stands", file=sys.stderr)
        except VerbError as error:
            print(f"seeded_faults: {error}", file=sys.stderr)
            return 2
    answer = {"summary": summed(found), "cases": [asdict(one) for one in found]}
    text = json.dumps(answer, indent=1)
    if given.json:
        given.json.write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0


def _line(case: Case) -> str:
    """A case on one line of progress."""
    mode = "baseline" if case.baseline else "without"
    names = ",".join(case.named) or "-"
    return (
        f"{case.machine} {case.speeds} {case.fault} {case.seed} {mode}: {case.judged}"
        f" ({case.verdict}, {names} {case.confidence}; {', '.join(case.moved)};"
        f" {' '.join(case.posterior_set)}) {case.seconds} s"
    )


if __name__ == "__main__":
    sys.exit(main())

"""Machines that lack several effects at once, by an outsider's equations: which are named, which
are missed, and whether anything is named that is not there.

Joints, servos and chambers come from scripts/outsider_joint.py and its neighbours. Prints JSON: per
machine what was said, and in sum the effects named and missed, and the names of families that a
machine has not, at confidence 0.8 and more.

  python scripts/several_effects.py --machines 20 --effects 3
  python scripts/several_effects.py --kind servo --machines 20 --effects 4 --json servos.json
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.rig.foreign import open_foreign
from scripts import outsider_chamber, outsider_joint, outsider_servo

KINDS = {"joint": outsider_joint, "servo": outsider_servo, "chamber": outsider_chamber}
SURE = 0.8  # confidence from which a wrong name is held against the diagnosis


def asked_of(kind: str, seed: int, count: int) -> dict[str, object]:
    """One machine: made, diagnosed, and held against what it has."""
    begun, module = time.monotonic(), KINDS[kind]
    machine = module.made(np.random.default_rng(seed), count)
    with tempfile.TemporaryDirectory(prefix="outsider-") as folder:
        Path(folder, "plant.yaml").write_text(machine.plant, encoding="utf-8")
        rig = Path(folder, "rig.yaml")
        rig.write_text(machine.rig, encoding="utf-8")
        found = diagnose(open_foreign(rig), machine.logs, how_far=False)
    named = {one.name: (one.family, round(one.confidence, 3)) for one in found.effects}
    there = module.EVERYWHERE.union(*(module.FAMILIES[name] for name in machine.has))
    families = {family for family, _ in named.values()}
    return {
        "seed": seed,
        "has": machine.has,
        "bits": machine.bits,
        "verdict": found.verdict,
        "named": named,
        "missed": [name for name in machine.has if not module.FAMILIES[name] & families],
        "wrong": [n for n, (f, sure) in named.items() if f not in there and sure >= SURE],
        "says": found.says,
        "seconds": round(time.monotonic() - begun, 1),
    }


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kind", choices=KINDS, default="joint")
    parser.add_argument("--machines", type=int, default=20)
    parser.add_argument("--effects", type=int, default=3, help="at once, 1 to 8")
    parser.add_argument("--seed", type=int, default=1, help="of the first machine")
    parser.add_argument("--json", type=Path, help="write the answer there as well")
    given = parser.parse_args()
    if not 1 <= given.effects <= 8:
        parser.error(f"--effects: found {given.effects}, expected 1 to 8")
    found: list[dict] = []
    try:
        for seed in range(given.seed, given.seed + given.machines):
            found.append(asked_of(given.kind, seed, given.effects))
            print(json.dumps(found[-1]), file=sys.stderr, flush=True)
    except KeyboardInterrupt:
        print("interrupted; what was found until then stands", file=sys.stderr)
    summary = {
        "machines": len(found),
        "effects": sum(len(one["has"]) for one in found),
        "missed": sum(len(one["missed"]) for one in found),
        "refused": sum(one["verdict"] == "not_in_catalogue" for one in found),
        "wrong_at_0.8": sum(len(one["wrong"]) for one in found),
        "seconds": round(float(np.median([one["seconds"] for one in found] or [0.0])), 1),
    }
    text = json.dumps({"summary": summary, "machines": found}, indent=1)
    if given.json:
        given.json.write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

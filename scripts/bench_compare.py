"""How often epa compare calls sound runs different, and which leak it finds since when; JSON.

python scripts/bench_compare.py
python scripts/bench_compare.py --leaks 5e-4 --picture docs/pictures/compare.png      needs chromium
"""

import argparse
import itertools
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import epa_rt as epa
from epa_rt.runs.compare_page import compare_page

SOUND = {"bench": "identification_short", "knee": "knee_chirp_short"}
SEED_OF_LEAKS = 100
PAGE_PX = (1000, 1150)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=4, help="runs of each rig (default: 4)")
    parser.add_argument("--rigs", nargs="+", choices=SOUND, default=[*SOUND])
    parser.add_argument("--leaks", nargs="+", type=float, default=[2e-4, 5e-4, 1e-3], metavar="1/S")
    parser.add_argument("--picture", type=Path, metavar="PNG", help="the page of the last leak")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="epa-compare-") as folder:
        place = Path(folder)
        rigs = dict.fromkeys(["bench", *arguments.rigs])  # leaks are of the bench
        sound = {rig: runs(place, rig, SOUND[rig], arguments.seeds) for rig in rigs}
        answer = {
            "with_itself": {
                rig: len(epa.compare(a[0], a[0]).differences) for rig, a in sound.items()
            },
            "seeds": {rig: alarms(logs) for rig, logs in sound.items()},
            "leaks": [leak(place, sound["bench"][0], rate) for rate in arguments.leaks],
        }
        if arguments.picture:
            picture(
                epa.compare(sound["bench"][0], place / f"leak_{arguments.leaks[-1]}.mcap"),
                place,
                arguments.picture,
            )
    print(json.dumps(answer, indent=1))
    return 0


def runs(place: Path, rig: str, experiment: str, seeds: int) -> list:
    return [
        epa.simulate(
            ROOT / f"config/experiments/{experiment}.yaml",
            ROOT / f"config/rigs/{rig}.yaml",
            seed=seed,
            out=place / f"{rig}_{seed}.mcap",
        )
        for seed in range(1, seeds + 1)
    ]


def alarms(logs: list) -> dict[str, object]:
    """Pairs of sound runs, and the signals of those that were called different."""
    found = [epa.compare(a, b) for a, b in itertools.combinations(logs, 2)]
    different = [one for one in found if one.is_different or one.asked]
    return {
        "pairs": len(found),
        "different": len(different),
        "signals": sorted({d.signal for one in different for d in (*one.differences, *one.asked)}),
    }


def leak(place: Path, sound: object, rate: float) -> dict[str, object]:
    plant = place / f"leak_{rate}.yaml"
    text = (ROOT / "config/plants/bench.yaml").read_text()
    plant.write_text(f"{text}\neffects:\n  leak:\n    leak: {rate} 1/s\n")
    log = epa.simulate(
        ROOT / "config/experiments/identification_short.yaml",
        ROOT / "config/rigs/bench.yaml",
        plant,
        seed=SEED_OF_LEAKS,
        out=place / f"leak_{rate}.mcap",
    )
    first = epa.compare(sound, log).first
    told = first and {
        key: getattr(first, key)
        for key in ("signal", "kind", "phase", "since_s", "beyond_s", "largest", "allowed")
    }
    return {"leak_per_s": rate, "outcome": log.outcome, "first": told}


def picture(found: object, place: Path, out: Path) -> None:
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        raise SystemExit("found no chromium, expected one for --picture")
    page = place / "compare.html"
    page.write_text(compare_page(found), encoding="utf-8")
    width, height = PAGE_PX
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
    command += ["--virtual-time-budget=8000", f"--window-size={width},{height}"]
    subprocess.run(
        [*command, f"--screenshot={out.resolve()}", page.as_uri()], check=True, capture_output=True
    )


if __name__ == "__main__":
    sys.exit(main())

"""An identification killed (SIGKILL, loop and recorder) and resumed beside one that was let run, as
JSON.

Every run on the simulated rig goes to ``epa identify``; of each coefficient it is asked whether the
two fits lie in each other's 95 % intervals. ``moments``: shares of the whole log's size.

  python scripts/killed_identification.py [SECONDS OF A TRIAL]
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
EXPERIMENT = ROOT / "config/experiments/identification.yaml"
RIG = ROOT / "config/rigs/bench.yaml"
MOMENTS = ((0.2,), (0.5,), (0.8,), (0.2, 0.5, 0.8))


def run(experiment: Path, log: Path, earlier: Path | None, kill_at_bytes: int | None) -> None:
    """One epa run; killed with its recorder once the log is as long as that."""
    command = [sys.executable, "-m", "epa_rt", "run", str(experiment), "--rig", str(RIG)]
    command += ["--quiet", "-o", str(log)] + (["--resume", str(earlier)] if earlier else [])
    process = subprocess.Popen(command, cwd=ROOT, start_new_session=True, stdout=subprocess.DEVNULL)
    while kill_at_bytes is not None and process.poll() is None:
        if log.exists() and log.stat().st_size >= kill_at_bytes:
            os.killpg(process.pid, signal.SIGKILL)
            break
        time.sleep(0.005)
    process.wait()


def identified(logs: list[Path], answer: Path) -> dict:
    """The models of a fit by name, and the names of its trials."""
    command = [sys.executable, "-m", "epa_rt", "identify", *map(str, logs), "--rig", str(RIG)]
    command += ["--no-terms", "--quiet", "--json", str(answer)]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    found = json.loads(answer.read_text())
    return {
        "trials": sorted(t["name"] for t in found["trials"]),
        "models": {model["name"]: model for model in found["models"]},
    }


def compared(whole: dict, resumed: dict) -> dict:
    """How many coefficients of each fit lie in the other's interval."""
    inside = outside = 0
    beyond = []
    for name, model in whole["models"].items():
        other = resumed["models"][name]
        for key, value in model["coefficients"].items():
            own, theirs = model["intervals"].get(key), other["intervals"].get(key)
            if own is None or theirs is None or None in (*own, *theirs):
                continue
            again = other["coefficients"][key]
            if own[0] <= again <= own[1] and theirs[0] <= value <= theirs[1]:
                inside += 1
            else:
                outside += 1
                beyond.append(f"{name}: {key}: {value:.4g} {own}, resumed {again:.4g} {theirs}")
    return {
        "same_trials": whole["trials"] == resumed["trials"],
        "inside": inside,
        "outside": outside,
        "beyond": beyond,
    }


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 30.0
    with tempfile.TemporaryDirectory(prefix="epa-killed-") as name:
        folder = Path(name)
        experiment = folder / "identification.yaml"
        text = EXPERIMENT.read_text()
        assert "for: 200 s" in text
        experiment.write_text(text.replace("for: 200 s", f"for: {seconds:g} s"))
        run(experiment, folder / "whole.mcap", None, None)
        size = (folder / "whole.mcap").stat().st_size
        whole = identified([folder / "whole.mcap"], folder / "whole.json")
        cases = []
        for number, moments in enumerate(MOMENTS):
            logs: list[Path] = []
            for share in (*moments, None):
                log = folder / f"part{number}-{len(logs)}.mcap"
                before = sum(one.stat().st_size for one in logs)
                at = None if share is None else max(int(share * size) - before, 100_000)
                run(experiment, log, logs[-1] if logs else None, at)
                logs.append(log)
            resumed = identified(logs, folder / f"part{number}.json")
            cases.append({"killed_at": moments, "logs": len(logs), **compared(whole, resumed)})
        print(json.dumps({"trial_s": seconds, "cases": cases}, indent=2))


if __name__ == "__main__":
    main()

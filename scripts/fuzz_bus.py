"""Damaged and random frames against the emulated bus and against the driver; prints JSON.

  python scripts/fuzz_bus.py                            100 000 frames against each
  python scripts/fuzz_bus.py --frames 2000 --seed 7

Against the emulator they go straight into its frame entry. Against the driver they come between and
in place of the answers to process data, over a pair of interfaces in a network of its own. An
ordinary user may run it where `unshare` is allowed. Exit code 1 where something crashed or an
output changed.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))


def driver_part(frames: int, seed: int) -> dict:
    """In a process of its own, so that a crash of C code is counted and not suffered."""
    from sim_backend.bus.namespace import AS_USER

    done = subprocess.run(
        [*AS_USER, sys.executable, "-m", "tests.bus.faults.fuzzed", str(frames), str(seed)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    if done.returncode:
        return {
            "frames": 0,
            "crashes": 1,
            "outputs_changed": 0,
            "code": done.returncode,
            "said": done.stderr[-2000:],
        }
    return json.loads(done.stdout.splitlines()[-1])


def main() -> int:
    from tests.bus.faults.fuzzed import fuzz_emulator

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--frames", type=int, default=100_000, help="against each of the two (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=1, help="(default: %(default)s)")
    arguments = parser.parse_args()
    result: dict = {"seed": arguments.seed}
    for name, part in (("emulator", fuzz_emulator), ("driver", driver_part)):
        began_s = time.monotonic()
        result[name] = part(arguments.frames, arguments.seed)
        result[name]["took_s"] = round(time.monotonic() - began_s, 1)
    print(json.dumps(result, indent=2))
    return int(
        any(
            result[name]["crashes"] or result[name]["outputs_changed"]
            for name in ("emulator", "driver")
        )
    )


if __name__ == "__main__":
    os.chdir(ROOT)
    sys.exit(main())

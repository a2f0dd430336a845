"""How long a diagnosis takes: logs of a rig with a hidden effect, the whole catalogue, everything
that epa gap diagnose does.

Prints JSON: wall and processor seconds of the command, the length of the logs, and the ratio to the
floor of the same run: one free run of the plant over all logs.

  python scripts/bench_gap.py                         # 3 logs of 60 s
  python scripts/bench_gap.py --logs 4 --seconds 200
  python scripts/bench_gap.py --refused               # a knee with a drag that no law of the
  catalogue is
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import bench_gap_knee as knee
import demo_gap_rig as bench

PRESSURES = (
    "300 kPa gauge, 550 kPa gauge",
    "450 kPa gauge, 640 kPa gauge",
    "380 kPa gauge, 600 kPa gauge",
    "340 kPa gauge, 500 kPa gauge",
)
SPEEDS = ("50 mm/s", "15 mm/s", "35 mm/s", "8 mm/s")


def floor_s(logs: list[Path], rig: Path, plant: Path) -> float:
    """Seconds of one free run over all logs, the faster of two: each of a subject of its own, which
    has kept nothing.
    """
    from epa_rt.gap.rig.read import read_recording
    from epa_rt.gap.rig.subjects import open_subject

    recordings, taken = [read_recording(log) for log in logs], []
    for _ in range(3):
        subject = open_subject(rig, plant)
        began = time.perf_counter()
        for recording in recordings:
            subject.free_run(recording, {}, None)
        taken.append(time.perf_counter() - began)
    return min(taken[1:])


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("--logs", type=int, default=3)
    arguments.add_argument("--seconds", type=float, default=60.0, help="of trials in each log")
    arguments.add_argument(
        "--refused", action="store_true", help="a knee with an effect that has no name"
    )
    given = arguments.parse_args()
    rig, plant = (knee.RIG, knee.PLANT) if given.refused else (bench.RIG, bench.PLANT)
    with tempfile.TemporaryDirectory(prefix="epa-bench-gap-") as folder:
        out = Path(folder)
        logs = (
            knee.record(out, given.logs, given.seconds / 2.0)
            if given.refused
            else bench.record(
                out,
                tuple(
                    (f"log_{k}", 3 + k, PRESSURES[k % 4], SPEEDS[k % 4]) for k in range(given.logs)
                ),
                given.seconds / 2.0,
            )
        )
        command = [
            sys.executable,
            "-c",
            "import sys; from epa_rt.cli.main import main; sys.exit(main())",
            "gap",
            "diagnose",
            "--rig",
            str(rig),
            *map(str, logs),
            "--json",
            str(out / "gap.json"),
            "--html",
            str(out / "gap.html"),
            "--quiet",
        ]
        began = time.perf_counter()
        subprocess.run(
            command,
            check=True,
            stdout=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        wall = time.perf_counter() - began
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        answer, floor = (
            json.loads((out / "gap.json").read_text(encoding="utf-8")),
            floor_s(logs, rig, plant),
        )
    print(
        json.dumps(
            {
                "logs": given.logs,
                "seconds_each": given.seconds,
                "wall_s": round(wall, 1),
                "processor_s": round(used.ru_utime + used.ru_stime, 1),
                "floor_free_run_s": round(floor, 3),
                "ratio": round(wall / floor, 1),
                "verdict": answer["verdict"],
                "effects": [effect["name"] for effect in answer["effects"]],
                "load_average": os.getloadavg()[0],
            }
        )
    )


if __name__ == "__main__":
    main()

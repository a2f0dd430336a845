"""The picture of docs/calibration.md: a force calibration of a simulated bench with a wrong cell.

python scripts/calibration_pictures.py [--out docs/pictures]
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
# a cell that reads 4 % too much and 2 N too high
WRONG = "\neffects:\n  force_gain: {force_gain: 1.04}\n  force_offset: {force_offset: 2 N}\n"


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--out", type=Path, default=ROOT / "docs/pictures")
    out = arguments.parse_args().out.absolute()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plant = folder / "bench.yaml"
        plant.write_text((ROOT / "config/plants/bench.yaml").read_text("utf-8") + WRONG)
        words = [
            "calibrate", "force", "--rig", "config/rigs/bench.yaml", "--plant", str(plant),
            "--points", "config/calibrations/masses.yaml", "--ascending", "--descending",
            "--reference-uncertainty", "0.05 N", "--record", "0.5 s", "--operator", "simulated",
            "-o", str(folder), "--quiet", "--picture", str(out / "calibration.svg"),
        ]  # fmt: skip
        subprocess.run([sys.executable, "-m", "epa_rt", *words], cwd=ROOT, check=True)


if __name__ == "__main__":
    main()

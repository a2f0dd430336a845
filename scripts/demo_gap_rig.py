"""Plays a real bench for the demo of the diagnosis: records three logs with an effect that the
plant file lacks.

The rig is played by the second simulator (sim_backend/stand_in), which has formulas and an
integrator of its own, and whose parameters are a few percent off the plant file's. What was hidden
is written apart, to be opened last.

  python scripts/demo_gap_rig.py out/demo_gap
"""

import argparse
import dataclasses
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from epa_rt.cli.inputs import load_inputs
from epa_rt.cli.run import run_recorded
from epa_rt.models.plant_file import load_plant
from sim_backend.backend import SimBackend
from sim_backend.stand_in import plant as stand_in
from sim_backend.stand_in.records import with_hidden
from sim_backend.stand_in.truth import perturbed

RIG, PLANT = ROOT / "config/rigs/bench.yaml", ROOT / "config/plants/bench.yaml"
HIDDEN = {"slip_ratio": 0.07, "slip_m": 2.5e-4}
WORDS = (
    "friction between the braid's threads: eight slip elements side by side, 7 % of the muscle's"
    " pull,\nand every parameter of the plant off by as much as is believed of it"
)
SEED = 20
# name, seed of the motion, two pressures, speed
LOGS = (
    ("real_1", 3, "300 kPa gauge, 550 kPa gauge", "50 mm/s"),
    ("real_2", 4, "450 kPa gauge, 640 kPa gauge", "15 mm/s"),
    ("held_out", 5, "380 kPa gauge, 600 kPa gauge", "35 mm/s"),
)


def experiment(name: str, seed: int, pressures: str, speed: str, seconds: float = 12.0) -> str:
    """Randomised strokes at two pressures, as the identification does them, cut to ``seconds``
    each.
    """
    text = (ROOT / "config/experiments/identification_short.yaml").read_text(encoding="utf-8")
    for old, new in (
        ("experiment: identification_short", f"experiment: {name}"),
        ("seed: 1", f"seed: {seed}"),
        ("460 kPa gauge, 640 kPa gauge", pressures),
        ("speed: 50 mm/s, acceleration", f"speed: {speed}, acceleration"),
        ("for: 5 s", f"for: {seconds:g} s"),
        ("Two trials of 5 s, to see the identification run through", f"Strokes at {pressures}"),
    ):
        if old not in text:
            raise SystemExit(f"identification_short.yaml: found no '{old}', expected it there")
        text = text.replace(old, new)
    return text


def record(out: Path, logs: tuple = LOGS, seconds: float = 12.0) -> list[Path]:
    """Records the logs on the rig with the hidden effect and returns them."""
    return played(
        out,
        RIG,
        PLANT,
        HIDDEN,
        {
            name: experiment(name, seed, pressures, speed, seconds)
            for name, seed, pressures, speed in logs
        },
    )


def played(
    out: Path, rig: Path, plant: Path, hidden: dict[str, float], experiments: dict[str, str]
) -> list[Path]:
    """Runs experiments (name to text of a file) on the second simulator with ``hidden`` effects and
    parameters that are off, and returns their logs.
    """
    out.mkdir(parents=True, exist_ok=True)
    believed, found = load_plant(plant), []
    true = dataclasses.replace(
        believed,
        params=with_hidden(perturbed(believed.params, np.random.default_rng(SEED)), **hidden),
        substeps=stand_in.SUBSTEPS,
    )
    for k, (name, text) in enumerate(experiments.items()):
        file = out / f"{name}.yaml"
        file.write_text(text, encoding="utf-8")
        inputs = load_inputs(file, rig, None, with_plant=False)
        backend = SimBackend(inputs.rig, true, 100 + k, None, stand_in)
        facts = {
            "rig": inputs.rig.name,
            "experiment": name,
            "backend": "stand-in",
            "speed": "unpaced",
            "period_s": f"{inputs.rig.period_s:g}",
        }
        summary, result = run_recorded(
            inputs, backend, out / f"{name}.mcap", facts, paced=False, progress=False
        )
        print(
            f"{name}: {result.outcome}, {result.cycles * inputs.rig.period_s:.0f} s,"
            f" {summary.path}",
            file=sys.stderr,
        )
        found.append(Path(summary.path))
    return found


def main() -> None:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument("out", type=Path)
    out = arguments.parse_args().out
    record(out)
    (out / "hidden.txt").write_text(WORDS + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

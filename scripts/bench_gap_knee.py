"""Logs of a knee with a drag that no law of the catalogue is, for bench_gap.py --refused: of all that is diagnosed it takes longest to find that nothing explains a gap."""

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

RIG, PLANT = ROOT / "config/rigs/knee.yaml", ROOT / "config/plants/knee.yaml"
HIDDEN = {"knee_air_nm_s2": 1.0}  # drag that grows with the speed squared, twenty times a typical one
SEED = 20
# pressures of both muscles, and of two trials each the swing and its frequencies
LOGS = (("185 kPa abs", "170 kPa abs", ("10 deg, from: 0.5 Hz, to: 2 Hz", "8 deg, from: 0.2 Hz, to: 1 Hz")),
        ("197 kPa abs", "180 kPa abs", ("12 deg, from: 0.2 Hz, to: 0.7 Hz", "6 deg, from: 0.5 Hz, to: 1.5 Hz")),
        ("177 kPa abs", "158 kPa abs", ("2.5 deg, from: 1 Hz, to: 3.5 Hz", "7 deg, from: 0.3 Hz, to: 1.2 Hz")))


def experiment(name: str, spam: str, ppam: str, trials: tuple[str, str], seconds: float) -> str:
    """The short knee chirp at other pressures, with two trials."""
    text = (ROOT / "config/experiments/knee_chirp_short.yaml").read_text(encoding="utf-8")
    head, rest = text.split("phases:\n", 1)
    for old, new in (("experiment: knee_chirp_short", f"experiment: {name}"), ("185 kPa abs", spam), ("170 kPa abs", ppam)):
        head = head.replace(old, new)
    made = [f"  - {{name: trial_{k}, trial: true, chirp: {{mean: mean, peak_to_peak: {motion}, fade: 1 s}}, for: {seconds:g} s, valves: {{all: hold}}}}\n"
            for k, motion in enumerate(trials)]
    return head + "phases:\n" + "".join(made) + rest[rest.index("after:\n"):]


def record(out: Path, count: int, seconds: float) -> list[Path]:
    """Records ``count`` logs with trials of ``seconds`` each and returns them."""
    believed, found = load_plant(PLANT), []
    true = dataclasses.replace(believed, params=with_hidden(perturbed(believed.params, np.random.default_rng(SEED)), **HIDDEN), substeps=stand_in.SUBSTEPS)
    for k in range(count):
        spam, ppam, trials = LOGS[k % len(LOGS)]
        file = out / f"log_{k}.yaml"
        file.write_text(experiment(f"log_{k}", spam, ppam, trials, seconds), encoding="utf-8")
        inputs = load_inputs(file, RIG, None, with_plant=False)
        facts = {"rig": inputs.rig.name, "experiment": f"log_{k}", "backend": "stand-in", "speed": "unpaced", "period_s": f"{inputs.rig.period_s:g}"}
        summary, result = run_recorded(inputs, SimBackend(inputs.rig, true, 100 + k, None, stand_in), out / f"log_{k}.mcap", facts, paced=False, progress=False)
        print(f"log_{k}: {result.outcome}, {result.cycles * inputs.rig.period_s:.0f} s", file=sys.stderr)
        found.append(Path(summary.path))
    return found

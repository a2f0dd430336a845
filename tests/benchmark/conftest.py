"""A case that is quickly recorded: one short log of the bench with a hidden effect that everybody
sees.
"""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from epa_rt.cli.gap.blind.make import _record
from epa_rt.config.rig import load_rig
from epa_rt.models.catalogue import read_knob
from epa_rt.models.plant_file import load_plant
from sim_backend.backend import SimBackend
from sim_backend.stand_in.truth import competing, true_plant

CONFIG = Path(__file__).resolve().parents[2] / "config"
EXPERIMENT = """experiment: short
loop: motor_position
seed: 1
phases:
  - {name: go_to_no_load, move: {to: no_load, speed: 20 mm/s}}
  - {name: fill, valves: {all: {set: 300 kPa gauge}}, until: valves_settled, timeout: 30 s}
  - {name: go, move: {to: 8 mm, speed: 20 mm/s}, valves: {all: hold}}
  - {name: sine, trial: true, sine: {mean: 8 mm, peak_to_peak: 6 mm, frequency: 1 Hz, fade: 500 ms}, for: 3 s, valves: {all: hold}}
"""  # noqa: E501


@pytest.fixture(scope="session")
def short_case(tmp_path_factory) -> tuple[Path, dict]:
    """Folder of the case and its truth: a force reading 8 N too high, one nominal parameter off."""
    folder = tmp_path_factory.mktemp("short") / "case_000"
    (folder / "logs").mkdir(parents=True)
    for kind in ("rigs", "plants"):
        shutil.copy(
            CONFIG / kind / "bench.yaml",
            folder / {"rigs": "rig.yaml", "plants": "plant.yaml"}[kind],
        )
    rig_text = (folder / "rig.yaml").read_text()
    (folder / "rig.yaml").write_text(
        "\n".join(
            "plant: plant.yaml" if line.startswith("plant:") else line
            for line in rig_text.splitlines()
        )
        + "\n"
    )
    (folder / "short.yaml").write_text(EXPERIMENT)
    rig, believed = load_rig(folder / "rig.yaml"), load_plant(folder / "plant.yaml")
    nominal = {
        item.key: read_knob(believed.params, item.key) for item in competing(believed.params)
    }
    nominal["muscle.braid_length_m"] *= 1.002
    effect = {
        "name": "force_zero",
        "fields": {"force_offset_n": 8.0},
        "answers": ["force_offset"],
        "families": ["force offset"],
        "blocks": ["sensors"],
        "multiple": 10.0,
        "rivals": {"end_cones": 40.0},
    }
    truth = {
        "case": "case_000",
        "rig": "bench",
        "index": 0,
        "kind": "single",
        "noise": 1.0,
        "same_law": False,
        "nominal": nominal,
        "effects": [effect],
        "separable": True,
        "excited": True,
    }
    plant = true_plant(believed.params, truth)
    backend = SimBackend(
        rig, replace(believed, params=plant.params, substeps=plant.substeps), 5, None, plant.physics
    )
    outcome, _ = _record(
        folder / "short.yaml",
        folder / "rig.yaml",
        folder / "plant.yaml",
        backend,
        folder / "logs" / "log_a.mcap",
    )
    assert outcome == "completed"
    told = {
        "rig": "rig.yaml",
        "plant": "plant.yaml",
        "logs": ["logs/log_a.mcap"],
        "holdout": [],
        "leave_out": [],
    }
    (folder / "case.json").write_text(json.dumps(told))
    return folder, truth

"""Making one case: reference run, strengths by the oracle, then the logs through the whole real
loop.
"""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.benchmark.oracle import LIMIT
from epa_rt.benchmark.plans import Plan, plan_of
from epa_rt.config.rig import Rig, load_rig
from epa_rt.models.catalogue import CATALOGUE
from epa_rt.models.knobs import read_knob
from epa_rt.models.plant_file import PlantFile, load_plant
from sim_backend.backend import SimBackend
from sim_backend.stand_in.draw import Spec, families, left_out
from sim_backend.stand_in.effects import BY_NAME
from sim_backend.stand_in.replayed import commands_of
from sim_backend.stand_in.strengths import Unfit, Workshop
from sim_backend.stand_in.truth import TruePlant, bench_of, competing, noisier, perturbed

Record = Callable[[Path, Path, Path, SimBackend, Path | None], tuple[str, np.ndarray]]
"""(experiment, rig, plant, backend, log) to the run's outcome and, where ``log`` is None, the output images (N, bytes)."""  # noqa: E501
TRIES = 4


class Folder:
    """A case's folder: the files that the diagnosing side is given."""

    def __init__(self, path: Path, rig: Path, plant: Path, plan: Plan):
        self.path, self.rig, self.plant = path, path / "rig.yaml", path / "plant.yaml"
        for name in ("logs", "holdout", "experiments"):
            (path / name).mkdir(parents=True, exist_ok=True)
        text = rig.read_text(encoding="utf-8")
        self.rig.write_text(
            "\n".join(
                "plant: plant.yaml" if line.startswith("plant:") else line
                for line in text.splitlines()
            )
            + "\n",
            encoding="utf-8",
        )
        self.plant.write_text(plant.read_text(encoding="utf-8"), encoding="utf-8")
        self.logs = [self._experiment(i, text) for i, text in enumerate(plan.logs)]
        self.holdout = [
            self._experiment(len(self.logs) + i, text) for i, text in enumerate(plan.holdout)
        ]

    def _experiment(self, i: int, text: str) -> Path:
        path = self.path / "experiments" / f"log_{'abcdefgh'[i]}.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    def tell(self, leave_out: list[str]) -> None:
        """Writes case.json: what the diagnosis is to be called with, paths from the case's
        folder.
        """
        told = {
            "rig": "rig.yaml",
            "plant": "plant.yaml",
            "logs": [f"logs/{e.stem}.mcap" for e in self.logs],
            "holdout": [f"holdout/{e.stem}.mcap" for e in self.holdout],
            "leave_out": leave_out,
        }
        (self.path / "case.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


def make_case(seed: int, spec: Spec, path: Path, config: Path, record: Record) -> dict[str, Any]:
    """Makes a case's folder and returns its truth. Raises Unfit where no candidate fits the
    kind.
    """
    rng = np.random.default_rng([seed, 1, spec.index])
    drawn = spec.rig, spec.plan, spec.noise, spec.own_law
    folder, rig, believed, plant, seeds = _drawn(rng, *drawn, path, config)
    commands = _reference(folder, rig, believed, plant, seeds, record)
    shop = Workshop(spec, plant, bench_of(plant, commands), commands, rng)
    effects = _recorded(folder, rig, believed, plant, shop, seeds[8:], record)
    leave_out = _told(spec, effects, rng)
    folder.tell(leave_out)
    return {
        "case": path.name,
        **spec._asdict(),
        "leave_out": leave_out,
        "effects": effects,
        "same_law": plant.same_law,
        "nominal": {
            item.key: read_knob(plant.nominal, item.key) for item in competing(plant.nominal)
        },
        "excited": all(e["multiple"] >= 1.0 for e in effects),
        "separable": all(value >= LIMIT for e in effects for value in e["rivals"].values()),
    }


def make_again(seed: int, truth: dict[str, Any], path: Path, config: Path, record: Record) -> None:
    """A case's folder as ``make_case`` wrote it, from its truth. Raises Unfit where a run trips
    that has not tripped then.
    """
    rng = np.random.default_rng([seed, 1, truth["index"]])
    told = truth["rig"], truth["plan"], truth["noise"], truth["same_law"]
    folder, rig, believed, plant, seeds = _drawn(rng, *told, path, config)
    true = plant._replace(effects=tuple((e["name"], e["fields"]) for e in truth["effects"]))
    if not _complete(folder, rig, believed, true, seeds[8:], record):
        raise Unfit(f"{path.name}: found a run that trips, expected all to complete as they did")
    folder.tell(truth["leave_out"])


def _drawn(
    rng: np.random.Generator,
    rig: str,
    plan: str,
    noise: float,
    own_law: bool,
    path: Path,
    config: Path,
) -> tuple[Folder, Rig, PlantFile, TruePlant, list[int]]:
    """Its folder with the experiments, rig and plant as they are believed, the plant as it is but
    for what is hidden, and the seeds of its runs.
    """
    files = config / "rigs" / f"{rig}.yaml", config / "plants" / f"{rig}.yaml"
    folder = Folder(path, *files, plan_of(rig, plan, rng))
    read, believed = load_rig(folder.rig), load_plant(folder.plant)
    plant = TruePlant(noisier(perturbed(believed.params, rng), noise), same_law=own_law)
    return folder, read, believed, plant, [int(s) for s in rng.integers(1, 2**31, 16)]


def _complete(
    folder: Folder, rig: Rig, believed: PlantFile, true: TruePlant, seeds: list[int], record: Record
) -> bool:
    """Records all logs; whether every run completed."""
    places = [*((e, "logs") for e in folder.logs), *((e, "holdout") for e in folder.holdout)]
    return all(
        [
            _run(
                e, folder, rig, believed, true, seed, record, folder.path / place / f"{e.stem}.mcap"
            )[0]
            == "completed"
            for (e, place), seed in zip(places, seeds, strict=False)
        ]
    )


def _run(
    experiment: Path,
    folder: Folder,
    rig: Rig,
    believed: PlantFile,
    plant: TruePlant,
    seed: int,
    record: Record,
    log: Path | None = None,
) -> tuple[str, np.ndarray]:
    if log is not None:
        log.unlink(missing_ok=True)
    true = dataclasses.replace(believed, params=plant.params, substeps=plant.substeps)
    return record(
        experiment, folder.rig, folder.plant, SimBackend(rig, true, seed, None, plant.physics), log
    )


def _reference(
    folder: Folder,
    rig: Rig,
    believed: PlantFile,
    plant: TruePlant,
    seeds: list[int],
    record: Record,
) -> list[np.ndarray]:
    """Commands of the logs as the rig without its hidden effect would have got them."""
    commands = []
    for experiment, seed in zip(folder.logs, seeds, strict=False):
        outcome, outputs = _run(experiment, folder, rig, believed, plant, seed, record)
        commands.append(commands_of(rig, outputs))
        if outcome != "completed":
            raise Unfit(
                f"found {experiment.stem} {outcome} without any effect, expected a run that"
                " completes"
            )
    return commands


def _recorded(
    folder: Folder,
    rig: Rig,
    believed: PlantFile,
    plant: TruePlant,
    shop: Workshop,
    seeds: list[int],
    record: Record,
) -> list[dict]:
    """Records all logs with the effects; halves them where a run trips over its own safety."""
    effects = shop.effects()
    for _ in range(TRIES):
        true = plant._replace(effects=tuple((e["name"], e["fields"]) for e in effects))
        if _complete(folder, rig, believed, true, seeds, record):
            return effects
        if plant.same_law:
            raise Unfit("found a run that trips, expected one that completes")
        effects = [
            shop.judged(
                BY_NAME[e["name"]],
                {
                    **e["fields"],
                    BY_NAME[e["name"]].field: 0.5 * e["fields"][BY_NAME[e["name"]].field],
                },
            )
            for e in effects
        ]
    raise Unfit(
        f"found runs that trip even with {effects[0]['name']} at {effects[0]['multiple']:.1f} times"
        " its limit, expected some that complete"
    )


def _told(spec: Spec, effects: list[dict], rng: np.random.Generator) -> list[str]:
    """Names that the diagnosis must do without: the truth's where it is withheld, else in every
    second case a decoy's.
    """
    own = {family for effect in effects for family in effect["families"]}
    if spec.kind == "withheld" and own:
        return sorted(left_out(effects[0]["name"]))
    if spec.kind != "withheld" and rng.uniform() < 0.5:
        return []
    others = sorted(
        {effect.family for effect in CATALOGUE}
        - own
        - {f for e in effects for r in e["rivals"] for f in families(BY_NAME[r])}
    )
    chosen = str(rng.choice(others))
    return sorted(effect.name for effect in CATALOGUE if effect.family == chosen)

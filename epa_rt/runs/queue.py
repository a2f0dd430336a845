"""A queue of runs as it is carried out: every run with its number, files and options."""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.config.kinds import expect_kind
from epa_rt.config.source import Located, Location, load_yaml, named_file, validate

if TYPE_CHECKING:
    from epa_rt.config.queue import QueuedRun, QueueFile


@dataclass(frozen=True)
class Item:
    """One run. ``number`` counts from 1, ``repetition`` within its row from 0. ``fingerprint``: a
    digest of its row.
    """

    number: int
    repetition: int
    experiment: Path
    rig: Path
    plant: Path | None
    seed: int
    speed: float | None
    notes: str
    fingerprint: str
    named: tuple[tuple[Location, Path], ...] = ()  # its files, by the place that names each

    @property
    def says(self) -> str:
        return f"{self.experiment.stem} on {self.rig.stem}"


@dataclass(frozen=True)
class Queue:
    """``items`` in their order; ``out``: folder for the logs, None where the file names none."""

    name: str
    path: Path
    items: tuple[Item, ...]
    out: Path | None
    sha256: str
    source: Located

    def check_files(self, item: Item) -> None:
        """Raises ConfigError at the place of this file that names one which is not there."""
        for where, path in item.named:
            named_file(self.source, where, path)


def load_queue(path: Path, rig: Path | None = None) -> Queue:
    """A queue file, or an experiment file as a queue of one run on ``rig``.

    ``rig``: of the runs that name none. Raises ConfigError.
    """
    from epa_rt.config.queue import QueuedRun, QueueFile

    located = load_yaml(path)
    if "queue" not in located.data and "experiment" in located.data:
        if rig is None:
            raise located.error(
                ("experiment",), "an experiment without a rig", "--rig RIG, or a queue file"
            )
        name = str(located.data["experiment"])
        run = QueuedRun(experiment=path.name)
        file = QueueFile.model_construct(queue=name, runs=(run,), rig=None, out=None)
    else:
        expect_kind(located, "queue")
        file = validate(located, QueueFile)
    digest = hashlib.sha256(located.text.encode()).hexdigest()
    out = None if file.out is None else path.parent / file.out
    return Queue(file.queue, path, _items(located, file, rig), out, digest, located)


def _items(located: Located, file: "QueueFile", rig: Path | None) -> tuple[Item, ...]:
    folder = located.path.parent
    items: list[Item] = []
    for i, run in enumerate(file.runs):
        row: Location = ("runs", i)
        found = folder / run.rig if run.rig else folder / file.rig if file.rig else rig
        if found is None:
            raise located.error(row, "a run without a rig", "rig: FILE, or --rig RIG")
        plant = folder / run.options.plant if run.options.plant else None
        named: list[tuple[Location, Path]] = [((*row, "experiment"), folder / run.experiment)]
        if run.rig or file.rig:
            named.append(((*row, "rig") if run.rig else ("rig",), found))
        if plant is not None:
            named.append(((*row, "options", "plant"), plant))
        for repetition in range(run.repeat):
            items.append(
                Item(
                    len(items) + 1,
                    repetition,
                    folder / run.experiment,
                    found,
                    plant,
                    run.options.seed + repetition,
                    run.options.speed,
                    run.notes,
                    _fingerprint(run, str(found), repetition),
                    tuple(named),
                )
            )
    return tuple(items)


def _fingerprint(run: "QueuedRun", rig: str, repetition: int) -> str:
    said = run.model_dump(exclude={"repeat", "notes"}) | {"rig": rig, "repetition": repetition}
    return hashlib.sha256(json.dumps(said, sort_keys=True).encode()).hexdigest()[:16]

"""How far a queue has come, in a file beside it that survives a power loss."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import ValidationError

from epa_rt.config.fields import Frozen
from epa_rt.config.whole_file import write_synced
from epa_rt.runs.queue import Queue

Status = Literal["waiting", "running", "completed", "stopped", "tripped", "failed", "skipped"]
OVER: tuple[Status, ...] = ("completed", "skipped")
_LARGEST = 16 << 20  # bytes of a state file; a thousand runs with long causes have some 1e6


class StateError(ValueError):
    """Why the state of a queue cannot be used, in one sentence."""


class RunState(Frozen):
    """One run: ``logs`` in their order, ``cause`` and ``end`` as the operator read them.

    ``quiet``: measured at rest, vented and without power; None where no run has ended.
    """

    fingerprint: str
    status: Status = "waiting"
    logs: tuple[str, ...] = ()
    cause: str = ""
    end: str = ""
    quiet: bool | None = None

    @property
    def is_blocked(self) -> bool:
        """Whether somebody has to look at the rig before it runs again."""
        return self.status in ("tripped", "failed") or self.quiet is False


class QueueState(Frozen):
    """All runs of a queue; ``begun`` counts how often it was begun anew."""

    queue: str
    begun: int = 1
    runs: tuple[RunState, ...]

    def with_run(self, number: int, run: RunState) -> "QueueState":
        """The same with another state of the run of this number, from 1."""
        runs = (*self.runs[: number - 1], run, *self.runs[number:])
        return self.model_copy(update={"runs": runs})


def state_path(queue: Path, backend: str) -> Path:
    """Beside the queue file, one for each backend: a rehearsal is not the run."""
    return queue.with_name(f"{queue.stem}.{backend}.state.json")


def fresh_state(queue: Queue, begun: int = 1) -> QueueState:
    runs = tuple(RunState(fingerprint=item.fingerprint) for item in queue.items)
    return QueueState(queue=queue.name, begun=begun, runs=runs)


def load_state(path: Path, queue: Queue) -> QueueState:
    """The state of this queue; a fresh one where there is no file.

    Runs may be put behind those that have begun, or changed there. Raises StateError, OSError.
    """
    if not path.exists():
        return fresh_state(queue)
    with path.open("rb") as file:
        text = file.read(_LARGEST + 1)
    try:
        if len(text) > _LARGEST:
            raise ValueError
        found = QueueState.model_validate(json.loads(text))
    except (ValueError, ValidationError, RecursionError):
        raise StateError(
            f"{path}: found a damaged state, expected one that epa queue wrote (--restart begins"
            " anew)"
        ) from None
    return _fitted(path, found, queue)


def save_state(path: Path, state: QueueState) -> None:
    """Writes the whole file and has it on the disk before it returns. Raises OSError."""
    write_synced(path, json.dumps(state.model_dump(), indent=1) + "\n")


def _fitted(path: Path, found: QueueState, queue: Queue) -> QueueState:
    begun = _begun(found.runs)
    for number in range(1, begun + 1):
        item = queue.items[number - 1] if number <= len(queue.items) else None
        if item is None or item.fingerprint != found.runs[number - 1].fingerprint:
            now = "no run" if item is None else item.says
            raise StateError(
                f"{queue.path}: found {now} as run {number}, expected the one that {path.name}"
                " says has begun (--restart begins anew)"
            )
    fresh = fresh_state(queue, found.begun)
    return fresh.model_copy(update={"runs": (*found.runs[:begun], *fresh.runs[begun:])})


def _begun(runs: Sequence[RunState]) -> int:
    """Number of the last run that is not waiting, or has waited in vain."""
    return max(
        (i + 1 for i, run in enumerate(runs) if run.status != "waiting" or run.logs), default=0
    )

"""A queue file: runs that go one after the other without anybody beside them."""

from typing import Annotated, Any

from pydantic import Field

from epa_rt.config.fields import Frozen, Name

LONGEST_QUEUE = 1000  # runs, repetitions counted; a day of the shortest experiments
_Text = Annotated[str, Field(max_length=2000)]
_Path = Annotated[str, Field(min_length=1, max_length=1000)]


class RunOptions(Frozen):
    """What ``epa run`` takes for the simulated rig. ``seed``: of the first repetition, the next
    ones count on from it. ``speed``: pace, 1 is real time.
    """

    plant: _Path | None = None
    seed: Annotated[int, Field(ge=0, lt=1 << 31)] = 1
    speed: Annotated[float, Field(gt=0.0, lt=1e6)] | None = None


class QueuedRun(Frozen):
    """One experiment on one rig, ``repeat`` times. Paths are relative to the queue file."""

    experiment: _Path
    rig: _Path | None = None
    options: RunOptions = RunOptions()
    repeat: Annotated[int, Field(ge=1, le=LONGEST_QUEUE)] = 1
    notes: _Text = ""


class QueueFile(Frozen):
    """Runs in their order. ``rig``: of the runs that name none; ``out``: folder of the logs."""

    queue: Name
    description: str = ""
    rig: _Path | None = None
    out: _Path | None = None
    runs: Annotated[tuple[QueuedRun, ...], Field(min_length=1, max_length=LONGEST_QUEUE)]

    def model_post_init(self, _context: Any) -> None:
        """Raises ValueError where the repetitions are too many."""
        count = sum(run.repeat for run in self.runs)
        if count > LONGEST_QUEUE:
            raise ValueError(f"found {count} runs in all, expected at most {LONGEST_QUEUE}")

"""The library behind ``import epa_rt as epa``: open logs, simulate, identify, diagnose, compare.

Each function does what the verb of its name does, and gives the object that the verb's page is
drawn from. What is refused raises EpaError with the sentence that the verb would print.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epa_rt.cli.exits import VerbError
from epa_rt.config.source import ConfigError
from epa_rt.logs.reader import LogError
from epa_rt.report.run import NotShown
from epa_rt.runs.compare import Comparison, NothingInCommon
from epa_rt.runs.log import EpaError, Log

if TYPE_CHECKING:
    from epa_rt.cli.gap.inputs import Opened
    from epa_rt.gap.diagnosis import Diagnosis
    from epa_rt.identify.answer import Answer
    from epa_rt.identify.data import Trial
    from epa_rt.identify.linear import Scaled
    from epa_rt.models.plant_file import PlantFile
    from epa_rt.runs.glance import Glance

__all__ = ["EpaError", "Log", "compare", "diagnose", "identify", "ls", "open", "simulate"]

Place = str | os.PathLike[str]
Progress = Callable[[str, float], None]


@contextmanager
def _refusals() -> Iterator[None]:
    try:
        yield
    except ConfigError as error:
        raise EpaError("\n".join(str(one) for one in error.errors)) from None
    except (VerbError, LogError, NotShown, NothingInCommon) as error:
        raise EpaError(str(error)) from None


def _silent(stage: str, share: float) -> None:
    """No progress."""


def open(path: Place) -> Log:
    """A log, read whole into memory (about 250 bytes a cycle)."""
    with _refusals():
        return Log(path)


def ls(*places: Place) -> list[Glance]:
    """The logs in folders, the oldest first; as ``epa ls``.

    Raises EpaError where a folder is not there.
    """
    from epa_rt.runs.listing import Filter, listed

    found = [Path(place) for place in places or ("out",)]
    for place in found:
        if not os.path.lexists(place):
            raise EpaError(f"{place}: found nothing there, expected a folder with logs")
    return listed(found, Filter())


def compare(a: Place | Log, b: Place | Log) -> Comparison:
    """What two runs differ in by more than noise; as ``epa compare``."""
    from epa_rt.runs.compare import compare as compared

    with _refusals():
        return compared(*(one.run if isinstance(one, Log) else Log(one).run for one in (a, b)))


def simulate(
    experiment: Place,
    rig: Place,
    plant: Place | None = None,
    *,
    seed: int = 1,
    out: Place = "out",
    operator: str | None = None,
    notes: Sequence[str] = (),
) -> Log:
    """Runs an experiment on the simulated rig, through the whole loop, as fast as it goes.

    ``out``: a folder, or the log's name ending in .mcap, which must be free. ``seed``: of the
    sensors' noise. A run that trips gives its log too; ``log.outcome`` says so.
    """
    from epa_rt.cli.inputs import load_inputs
    from epa_rt.cli.run import run_simulated
    from epa_rt.cli.run_record import record_attachment

    with _refusals():
        believed = None if plant is None else Path(plant)
        inputs = load_inputs(Path(experiment), Path(rig), believed, with_plant=True)
        record = record_attachment(inputs.rig, Path(rig), operator, list(notes))
        inputs = replace(inputs, attachments=inputs.attachments | record)
        summary, _ = run_simulated(inputs, Path(out), seed, None, progress=False)
        return Log(summary.path)


@dataclass(frozen=True)
class Diagnosed:
    """``answer``: where the gap lies, which effects make it, how far it shrinks, the gate."""

    answer: Diagnosis
    given: Opened

    def as_json(self) -> dict[str, Any]:
        """Plain values, the fields of ``epa gap diagnose --json``."""
        from epa_rt.gap.report.as_json import finite

        plain: dict[str, Any] = finite(self.answer.as_json())
        return plain

    def page(self) -> str:
        """The page of ``epa gap diagnose --html``, self-contained HTML."""
        from epa_rt.cli.gap.diagnose import page_of

        return page_of(self.given, self.answer)

    def patched_plant(self) -> str:
        """The plant file with what was found. Raises EpaError where no effect is named."""
        from epa_rt.gap.answer.patch import patched_text

        if not self.answer.effects:
            raise EpaError("found no effect that is named, expected one to patch the plant with")
        return patched_text(self.answer, self.given.subject)


def diagnose(
    *logs: Place,
    rig: Place,
    plant: Place | None = None,
    holdout: Sequence[Place] = (),
    leave_out: Sequence[str] = (),
    gate: bool = True,
    baseline: Sequence[Place] = (),
    progress: Progress = _silent,
) -> Diagnosed:
    """Why rig and simulation disagree; as ``epa gap diagnose``, about a minute for three logs.

    ``gate``: run the patched plant on the log's own experiment and measure again. ``baseline``:
    healthy runs of the same rig and experiment; the question is then what changed since.
    ``progress(stage, share)`` is called as it goes on.
    """
    from epa_rt.cli.gap.diagnose import answered

    with _refusals():
        given, answer = answered(
            Path(rig),
            None if plant is None else Path(plant),
            [Path(log) for log in logs],
            [Path(log) for log in holdout],
            tuple(leave_out),
            gate,
            progress,
            [Path(log) for log in baseline],
        )
    return Diagnosed(answer, given)


@dataclass(frozen=True)
class Identified:
    """``answer``: models with their scores and intervals. ``trials``: the data it was found from,
    ``data``: the same normalised. ``plant``: as it was believed before.
    """

    answer: Answer
    trials: list[Trial]
    data: list[Scaled]
    plant: PlantFile

    def as_json(self) -> dict[str, Any]:
        """Plain values, the fields of ``epa identify --json``."""
        from epa_rt.identify.answer import as_json

        plain: dict[str, Any] = as_json(self.answer)
        return plain

    def page(self) -> str:
        """The page of ``epa identify --html``, self-contained HTML."""
        from epa_rt.identify.report.page import identify_page

        return identify_page(self.answer, self.trials, self.data)


def identify(
    *logs: Place,
    rig: Place | None = None,
    plant: Place | None = None,
    holdout: str = "both",
    physical: bool = True,
    terms: bool = True,
    progress: Progress = _silent,
) -> Identified:
    """Which force law, with which numbers; as ``epa identify``. Rig and plant default to those in
    the log; ``physical`` and ``terms`` are the slow parts.
    """
    from epa_rt.cli.identify import HOLDOUTS, identified

    if holdout not in HOLDOUTS:
        raise EpaError(f"holdout: found {holdout!r}, expected one of {', '.join(HOLDOUTS)}")
    arguments = argparse.Namespace(
        logs=[Path(log) for log in logs],
        rig=None if rig is None else Path(rig),
        plant=None if plant is None else Path(plant),
        holdout=holdout,
        out=None,
        no_physical=not physical,
        no_terms=not terms,
    )
    with _refusals():
        return Identified(*identified(arguments, progress))

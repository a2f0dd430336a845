"""The gate: the patched plant file is loaded from disk, the same experiment is run again, and the gap is measured anew.

What was predicted from the log's own commands in free run must come true with the loop closed.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from epa_rt.config.source import ConfigError, load_yaml
from epa_rt.gap.diagnosis import Shrinkage
from epa_rt.gap.recording import Recording
from epa_rt.gap.share import Share, Squares, share
from epa_rt.gap.shrink import OVERALL, channel_squares, figure_squares, together
from epa_rt.gap.subject import Subject
from epa_rt.models.plant_file import read_plant

# (plant file, recording whose rig and experiment are taken, seed of the sensors' noise) -> a recording of that run
RunAgain = Callable[[Path, Recording, int], Recording]
SEEDS = (11, 12, 13, 14, 15)
PASSES_POINTS = 5.0


class Gate(NamedTuple):
    """``report``: predicted against achieved, as the JSON has it. The recordings: the log, and the three runs."""

    report: dict
    real: Recording
    before: Recording
    after: Recording
    twin: Recording


class GateError(Exception):
    """Why the gate could not be run, as a sentence."""


def gate(subject: Subject, real: Recording, believed: Path, patched: Path, run_again: RunAgain,
         predicted: Sequence[Shrinkage], progress: Callable[[str, float], None] = lambda stage, share: None) -> Gate:
    """Runs the experiment of ``real`` on both plant files; predicted against achieved share of the gap, by channel.

    The plant file as it stands runs once, the patched one several times with other noise: what those differ by, and the
    noise of the recording, make the floor. ``predicted``: rows of ``shrinkage``; those in free run against the plant file
    on this log are held against what is achieved. Shares are of all channels together, each in units of its floor;
    ``points`` is achieved minus predicted in percent, ``passed`` whether within 5. Raises GateError where a file does not
    load or a run does not reach a trial.
    """
    for path in (believed, patched):
        _check(path)
    progress("gate: the plant as believed", 0.0)
    before = _ran(run_again(believed, real, SEEDS[0]), real)
    progress("gate: the patched plant", 0.25)
    after = _ran(run_again(patched, real, SEEDS[0]), real)
    twins = _twins(patched, real, run_again, after, progress)
    own = {row.channel: row for row in _free(predicted, real.name)}
    noise = {name: row.floor for name, row in own.items()}
    shifted = [one for one in twins if _starts(one) != _starts(after)]
    apart = shifted if shifted and _starts(real) != _starts(after) else twins  # as far out of step as the log itself
    found = channel_squares(subject, real, before, after, apart, noise)
    overall = share([together(list(found.values()))]) if found else None
    if overall is None:
        raise GateError(f"{real.path}: found no channel that both the log and the simulated run have, expected at least one")
    asked = figure_squares(real, before, after, apart, noise)
    promised = {name: row.closed_share for name, row in own.items()}
    rows = [_row(channel, unit, one, promised.get(channel)) for (channel, unit), squares in (found | asked).items()
            if (one := _share(squares)) is not None]
    whole = _row(OVERALL, "x floor", overall, promised.get(OVERALL))
    points = whole["points"]
    report = {"log": real.name, "plant_file": str(patched), "passed": points is not None and abs(points) <= PASSES_POINTS,
              "predicted_share": whole["predicted_share"], "achieved_share": whole["achieved_share"], "points": points,
              "channels": [whole, *rows]}
    return Gate(report, real, before, after, twins[-1])


def _check(path: Path) -> None:
    try:
        read_plant(load_yaml(path))
    except (ConfigError, OSError) as error:
        raise GateError(str(error)) from None


def _ran(recording: Recording, real: Recording) -> Recording:
    if not any(span.trial for span in recording.spans) and any(span.trial for span in real.spans):
        raise GateError(f"{recording.path}: found a run that ended before its first trial, expected the trials of {real.name}")
    return recording


def _share(one: Squares) -> Share | None:
    found = share([one])
    return found if found is not None and found.floor > 0.0 else None


def _free(predicted: Sequence[Shrinkage], log: str) -> list[Shrinkage]:
    """Rows in free run against the plant file: those of this log, else those over all logs."""
    rows = [row for row in predicted if row.mode == "free_run" and row.baseline == "plant_file"]
    return [row for row in rows if row.log == log] or [row for row in rows if row.log == "all"]


def _twins(patched: Path, real: Recording, run_again: RunAgain, after: Recording, progress: Callable[[str, float], None]) -> list[Recording]:
    """Runs with other noise: two, and up to two more until the trials of one begin on another cycle.

    A loop that hunts does so in step with the cycles; twins that all begin on the same one would hide it from the floor.
    """
    found: list[Recording] = []
    for seed in SEEDS[1:]:
        if len(found) >= 2 and any(_starts(one) != _starts(after) for one in found):
            break
        progress(f"gate: the patched plant, other noise {len(found) + 1}", 0.5 + 0.1 * len(found))
        found.append(_ran(run_again(patched, real, seed), real))
    return found


def _starts(recording: Recording) -> list[int]:
    return [span.start for span in recording.spans if span.trial]


def _row(channel: str, unit: str, one: Share, promised: float | None) -> dict:
    points = None if one.closed is None or promised is None else 100.0 * (one.closed - promised)
    return {"channel": channel, "unit": unit, "before": one.before, "after": one.after, "floor": one.floor,
            "predicted_share": promised, "achieved_share": one.closed, "interval": one.interval, "points": points}

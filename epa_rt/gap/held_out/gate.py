"""The gate: the patched plant file is loaded from disk, the same experiment is run again, and the
gap is measured anew.

What was predicted from the log's own commands in free run must come true with the loop closed.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

from epa_rt.config.source import ConfigError, load_yaml
from epa_rt.gap.diagnosis import Shrinkage
from epa_rt.gap.held_out.share import Share, Squares, share
from epa_rt.gap.held_out.shrink import (
    ALL,
    OVERALL,
    Pairs,
    channel_squares,
    figure_squares,
    together,
)
from epa_rt.gap.likelihood.alongside import trials
from epa_rt.gap.recording import Recording
from epa_rt.gap.side_by_side import each
from epa_rt.gap.subject import Subject
from epa_rt.models.plant_file import read_plant

# (plant file, recording whose rig and experiment are taken, seed of the sensors' noise) -> a
# recording of that run; called from two threads at once
RunAgain = Callable[[Path, Recording, int], Recording]
SEEDS = (11, 12, 13, 14, 15)
PASSES_POINTS = 5.0


class Gate(NamedTuple):
    """``report``: predicted against achieved, as the JSON has it. The recordings: the log, and
    three of the runs.
    """

    report: dict
    real: Recording
    before: Recording
    after: Recording
    twin: Recording


class GateError(Exception):
    """Why the gate could not be run, as a sentence."""


def gate(
    subject: Subject,
    real: Recording,
    believed: Path,
    patched: Path,
    run_again: RunAgain,
    predicted: Sequence[Shrinkage],
    progress: Callable[[str, float], None] = lambda stage, share: None,
    aside: Recording | None = None,
) -> Gate:
    """Runs the experiment of ``real`` on both plant files; predicted against achieved share of the
    gap, by channel.

    The plant file as it stands runs once, the patched one several times with other noise: what
    those differ by from each other, and the noise of the recording, make the floor, what they
    differ by from the log the gap that is left. ``predicted``: rows of ``shrinkage``; those in free
    run against the plant file on this log are held against what is achieved. ``aside``: ``real``
    with those trials alone of which they speak (``Part.only``), where that is not all. Shares are
    of all channels together, each in units of its floor; ``points`` is achieved minus predicted in
    percent, ``passed`` whether within 5, both None where either has no gap to close, which
    ``not_judged`` says. Raises GateError where a file does not load, a run does not reach all
    trials, or no channel is in both; and whatever ``run_again`` raises.
    """
    for path in (believed, patched):
        _check(path)
    ran = _runs(believed, patched, real, run_again, progress)
    judged, before, *runs = [_aside(run, real, aside) for run in (real, *ran)]
    own = {row.channel: row for row in _free(predicted, real.name)}
    noise = {name: row.floor for name, row in own.items()}
    held = (judged, before, runs, _apart(judged, runs), noise)
    found = channel_squares(subject, *held)
    overall = share([together(list(found.values()))]) if found else None
    if overall is None:
        raise GateError(
            f"{real.path}: found no channel that both the log and the simulated run have, expected"
            " at least one"
        )
    asked = figure_squares(*held)
    promised = {name: row.closed_share for name, row in own.items()}
    rows = [
        _row(channel, unit, one, promised.get(channel))
        for (channel, unit), squares in (found | asked).items()
        if (one := _share(squares)) is not None
    ]
    whole = _row(OVERALL, "x floor", overall, promised.get(OVERALL))
    points = whole["points"]
    report = {
        "log": real.name,
        "trials": len(trials(judged)),
        "of_trials": len(trials(real)),
        "plant_file": str(patched),
        "passed": None if points is None else abs(points) <= PASSES_POINTS,
        "predicted_share": whole["predicted_share"],
        "achieved_share": whole["achieved_share"],
        "points": points,
        "not_judged": _not_judged(whole, OVERALL in own),
        "channels": [whole, *rows],
    }
    return Gate(report, judged, before, runs[0], runs[-1])


def _check(path: Path) -> None:
    try:
        read_plant(load_yaml(path))
    except (ConfigError, OSError) as error:
        raise GateError(str(error)) from None


def _ran(recording: Recording, real: Recording, plant: str) -> Recording:
    """A plant that does not get through the experiment is not judged by the trials before."""
    ran, wanted = len(_starts(recording)), len(_starts(real))
    if wanted and not ran:
        raise GateError(
            f"{recording.path}: found a run that ended before its first trial, expected the trials"
            f" of {real.name}"
        )
    if ran < wanted:
        raise GateError(
            f"{recording.path}: found {ran} trials of the {plant} plant, expected the {wanted} of"
            f" {real.name}"
        )
    return recording


def _aside(run: Recording, real: Recording, aside: Recording | None) -> Recording:
    """A run, or ``real`` itself, with those trials alone that ``aside`` has of the ones of
    ``real``; they are found by their order.
    """
    kept = iter(
        [now.trial for was, now in zip(real.spans, aside.spans, strict=True) if was.trial]
        if aside
        else []
    )
    return (
        replace(
            run,
            spans=tuple(
                replace(span, trial=span.trial and next(kept, False)) for span in run.spans
            ),
        )
        if aside
        else run
    )


def _not_judged(whole: dict, in_free_run: bool) -> str | None:
    """Why achieved could not be held against predicted; None where it was."""
    if whole["points"] is not None:
        return None
    if whole["predicted_share"] is not None:
        return (
            "run again on the plant file as it stands, nothing rises above the noise, so that there"
            " is no gap to close"
        )
    return (
        "in free run nothing rises above the noise, so that nothing was predicted"
        if in_free_run
        else "there are no figures in free run, so that nothing was predicted"
    )


def _share(one: Squares) -> Share | None:
    found = share([one])
    return found if found is not None and found.floor > 0.0 else None


def _free(predicted: Sequence[Shrinkage], log: str) -> list[Shrinkage]:
    """Rows in free run against the plant file: those of this log, else those over all logs."""
    rows = [row for row in predicted if row.mode == "free_run" and row.baseline == "plant_file"]
    return [row for row in rows if row.log == log] or [row for row in rows if row.log == ALL]


def _runs(
    believed: Path,
    patched: Path,
    real: Recording,
    run_again: RunAgain,
    progress: Callable[[str, float], None],
) -> list[Recording]:
    """A run of the plant as believed, then those of the patched one with noise of their own. A loop
    that hunts does so in step with the cycles, or out of it: what two runs differ by says little of
    what others do.
    """
    asked = [(believed, "believed", SEEDS[0]), *((patched, "patched", seed) for seed in SEEDS)]

    def ran(k: int) -> Recording:
        plant, said, seed = asked[k]
        progress(f"gate: run {k + 1} of {len(asked)}, the {said} plant", k / len(asked))
        return _ran(run_again(plant, real, seed), real, said)

    return each(ran, range(len(asked)))


def _apart(real: Recording, runs: Sequence[Recording]) -> list[Pairs]:
    """For each run the pairs of runs that are as far out of step with each other as it is with the
    log; all pairs where there are none.
    """
    pairs = list(combinations(runs, 2))
    together = [_starts(a) == _starts(b) for a, b in pairs]
    return [
        [
            pair
            for pair, same in zip(pairs, together, strict=True)
            if same == (_starts(run) == _starts(real))
        ]
        or pairs
        for run in runs
    ]


def _starts(recording: Recording) -> tuple[int, ...]:
    return tuple(span.start for span in recording.spans if span.trial)


def _row(channel: str, unit: str, one: Share, promised: float | None) -> dict:
    points = None if one.closed is None or promised is None else 100.0 * (one.closed - promised)
    return {
        "channel": channel,
        "unit": unit,
        "before": one.before,
        "after": one.after,
        "floor": one.floor,
        "predicted_share": promised,
        "achieved_share": one.closed,
        "interval": one.interval,
        "points": points,
    }

"""Single channels: gone, constant, frozen for a while, at the end of their range, not valid."""

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from epa_rt.config.devices import Entry
from epa_rt.config.rig import Rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.gap.finding import (
    Finding,
    judged_rows,
    measured_names,
    seconds,
    stretches,
    target_moves,
)
from epa_rt.gap.recording import Recording
from epa_rt.logs.layout import ANSWERED_AFTER
from epa_rt.signals.scaling import Scaling, scaling_of

_MOST_INVALID = 0.5
_FROZEN_S = 0.05  # of a channel with noise
_WINDOW_S = 0.2  # of a channel without: windows in which it should move
_STEPS_EXPECTED = 6.0  # steps of the converter that it should move by
_NOISE_COUNTS = 1.0  # standard deviation above which a channel is never twice the same for long
# chance of white noise of that size to stay within the step that it is in the midst of
_MOST_REPEATS = math.erf(0.5 / _NOISE_COUNTS / math.sqrt(2.0))
_FLICKERS = 0.4  # share of changes that go back: a last step that noise moves
_STILL_S, _STILL_AT_END_S, _LONGER, _USUAL_RANK = 0.3, 0.1, 3.0, 4
_AT_END_ROWS = 30
_AT_REST_ROWS = 100


def check_values(
    recording: Recording, rig: Rig | None, steps: Mapping[str, float] | None = None
) -> list[Finding]:
    """Findings on each measured channel alone. ``steps``: of readings in the channel's unit, by
    name, where a rig file says them.
    """
    found = []
    rows = judged_rows(recording)
    for name in measured_names(recording):
        if rig is not None and name not in {row.name for row in rig.inputs}:
            continue
        values = recording.columns[name]
        found += invalid(recording, name, values, rows)
        known = values[np.isfinite(values)]
        if not len(known):
            continue
        if known.min() == known.max():
            found += _constant(recording, rig, name, float(known[0]))
            continue
        scaling = scaling_of_row(rig, name) if rig is not None else None
        # a converter of 12 bit in a word of 16 makes steps of many counts
        said = abs(scaling.slope) if scaling is not None else (steps or {}).get(name, 0.0)
        count, alive = max(said, smallest_step(known)), _off_its_ends(values)
        if (
            _is_noisy(alive, count, False) and not repeats_at_rest(alive, _least_rows(recording))
            if rig is None
            else _is_noisy(values, count, is_analog(rig, name))
        ):
            found += _frozen(recording, name, values)
        elif rig is not None and name not in (rig.motor.position, rig.motor.speed):
            found += _standing(recording, rig, name, values, count) or _still(
                recording, name, values
            )
    return found + (_unasked(recording, rig, rows) if rig is not None else [])


def entry_of(rig: Rig, name: str) -> Entry:
    """The entry of the process data that a row stands in. Raises KeyError where the rig has no such
    row.
    """
    row = rig.row(name)
    slave, entry_name = row.entry.split(".")
    return next(
        e
        for s in rig.slaves
        if s.name == slave
        for e in entries_of(s, row.is_output)
        if e.name == entry_name
    )


def scaling_of_row(rig: Rig, name: str) -> Scaling | None:
    """How a row's counts become SI; None for bits, words and raw counts. Raises KeyError where the
    rig has no such row.
    """
    row, entry = rig.row(name), entry_of(rig, name)
    return None if entry.code == "?" or name.endswith("_raw") else scaling_of(row, entry, rig)


def noise_of(values: np.ndarray) -> float:
    """Standard deviation of white noise on a channel, from its fourth differences, in which motion
    of a plant hardly shows.
    """
    differences = np.abs(np.diff(values, 4))
    known = differences[np.isfinite(differences)]
    return float(np.median(known)) / 0.6745 / 70**0.5 if len(known) else 0.0


def _is_noisy(values: np.ndarray, count: float, analog: bool) -> bool:
    """Whether a channel is never the same for long, by a hundred rows at least. One that is not
    analog must show it at rest too, before the power is on.
    """
    first = values[np.isfinite(values)][
        :_AT_REST_ROWS
    ]  # a log may begin at the end of a sensor's range
    return (
        len(first) == _AT_REST_ROWS
        and noise_of(values) > _NOISE_COUNTS * count
        and (analog or noise_of(first) > _NOISE_COUNTS * count)
    )


def repeats_at_rest(values: np.ndarray, least: int) -> bool:
    """Whether a channel repeats its readings as one that rests, and not as one with noise.

    White noise does not know that it has just repeated: of readings that are the same as the one
    before, no more than ``_MOST_REPEATS`` are followed by the same once more, where its deviation
    is a step or more. An encoder slows down before it rests: its readings stay the longer, the
    longer they have stayed. Runs of ``least`` rows and more are not counted, for a frozen sensor
    has them too.

    No step is asked for, because interpolation to another rate hides it: values between two steps
    are new ones, but a rest remains one, and noise that repeats no more than its deviation allows.
    A channel that holds each sample for three rows or more counts as one that rests.
    """
    lengths = [b - a for a, b in stretches(np.diff(values) == 0.0)]  # NaN differs from itself
    short = [length for length in lengths if length + 1 < least]
    return sum(short) - len(short) > _MOST_REPEATS * sum(short)


def _least_rows(recording: Recording) -> int:
    """Rows without a change from which a channel with noise is frozen."""
    return max(round(_FROZEN_S / recording.period_s), 20)


def _off_its_ends(values: np.ndarray) -> np.ndarray:
    """NaN where a channel is at its lowest or highest value: one that is cut off for most of the
    time has no noise there.
    """
    return np.where((values == np.nanmin(values)) | (values == np.nanmax(values)), np.nan, values)


def is_analog(rig: Rig, name: str) -> bool:
    """Whether a row comes from an analog terminal."""
    slave = rig.row(name).entry.split(".")[0]
    device = next(s.description for s in rig.slaves if s.name == slave)
    return not device.is_drive and device.sampling is not None


def smallest_step(known: np.ndarray) -> float:
    """The smallest difference of two values of a channel; 0 where it has one alone."""
    gaps = np.diff(np.unique(known[:20_000]))
    return float(gaps.min()) if len(gaps) else 0.0


def _of(
    recording: Recording, severity: str, kind: str, name: str, sentence: str, rows: list = ()
) -> Finding:
    return Finding(
        severity, kind, recording.name, name, f"{recording.name}: {name}: {sentence}", tuple(rows)
    )


def invalid(recording: Recording, name: str, values: np.ndarray, rows: np.ndarray) -> list[Finding]:
    """A channel without a valid value on some of the ``rows`` (N,) that count."""
    bad = ~np.isfinite(values) & rows
    count, share = int(bad.sum()), bad.sum() / max(rows.sum(), 1)
    if not count:
        return []
    where = stretches(bad)
    longest = max(where, key=lambda s: s[1] - s[0])
    severity = "refuse" if share > _MOST_INVALID else "exclude"
    return [
        _of(
            recording,
            severity,
            "dropped channel" if share > _MOST_INVALID else "invalid",
            name,
            f"found no valid value on {count} of {int(rows.sum())} rows ({share:.2%}) in"
            f" {len(where)} stretches, the longest from {seconds(recording, longest[0]):.3f} s to"
            f" {seconds(recording, longest[1] - 1):.3f} s, expected values throughout"
            + ("" if share > _MOST_INVALID else "; they are left out"),
            where,
        )
    ]


def _unasked(recording: Recording, rig: Rig, rows: np.ndarray) -> list[Finding]:
    """Commands, and the drive's word on its state and mode, that are missing where they are read:
    what every channel did there was asked by nobody knows what.
    """
    from epa_rt.gap.rig.house.commands import read_rows, untold
    from epa_rt.gap.rig.house.prepared import followed

    columns = recording.columns
    if not {row.name for row in rig.signals} <= columns.keys():
        return []
    found, follows, gone = [], followed(rig, columns), untold(rig, columns)
    for name, read in read_rows(rig, columns).items():
        for one in invalid(recording, name, np.where(gone[name], np.nan, 0.0), read & rows):
            says = one.says.replace(
                "; they are left out",
                "; no channel is judged there"
                + ("" if follows[name] else ", and free run not on this log"),
            )
            found.append(
                dataclasses.replace(
                    one,
                    channel=name if one.severity == "refuse" else "",
                    says=says,
                    rows=tuple(
                        (a, min(b + ANSWERED_AFTER, recording.samples)) for a, b in one.rows
                    ),
                )
            )
    return found


def _constant(recording: Recording, rig: Rig | None, name: str, value: float) -> list[Finding]:
    """An analog sensor that never moves is dead; what a drive says may stand still while the motor
    is not told to move.
    """
    severity = "note" if rig is None else "refuse"
    if rig is not None and not is_analog(rig, name) and not target_moves(recording):
        return []
    return [
        _of(
            recording,
            severity,
            "dropped channel",
            name,
            f"found {value:.6g} on every row, expected a channel that moves",
        )
    ]


def _frozen(recording: Recording, name: str, values: np.ndarray) -> list[Finding]:
    """A noisy channel that stays the same: frozen, or at the end of its range."""
    least = _least_rows(recording)
    same = np.concatenate([[False], np.diff(values) == 0.0])
    runs = [(start - 1, stop) for start, stop in stretches(same)]
    ends = (np.nanmin(values), np.nanmax(values))
    at_end = [(a, b) for a, b in runs if b - a >= 6 and values[a] in ends]
    found = []
    if sum(b - a for a, b in at_end) >= _AT_END_ROWS:
        total, at = sum(b - a for a, b in at_end), {values[a] for a, _ in at_end}
        which = " and ".join(
            f"{value:.6g}, its {word} value"
            for value, word in zip(ends, ("lowest", "highest"), strict=True)
            if value in at
        )
        found.append(
            _of(
                recording,
                "exclude",
                "saturated",
                name,
                f"found it at {which}, without any noise on {total} rows, the first time at"
                f" {seconds(recording, at_end[0][0]):.3f} s, as of a sensor at the end of its"
                " range; they are left out",
                at_end,
            )
        )
    frozen = [run for run in runs if run[1] - run[0] >= least and run not in at_end]
    if frozen:
        first, total = frozen[0], sum(b - a for a, b in frozen)
        found.append(
            _of(
                recording,
                "exclude",
                "frozen",
                name,
                f"found {values[first[0]]:.6g} without any change from"
                f" {seconds(recording, first[0]):.3f} s to {seconds(recording, first[1] - 1):.3f} s"
                f" ({total} rows in {len(frozen)} stretches), expected noise; they are left out",
                frozen,
            )
        )
    return found


def _standing(
    recording: Recording, rig: Rig, name: str, values: np.ndarray, step: float
) -> list[Finding]:
    """A channel without noise that stands still in windows in which it moves otherwise, judged by
    how far the rig moves.
    """
    motion_name = (
        rig.motor.position
        if rig.joint is None
        else f"ref_{rig.joint.position}"
        if name == rig.joint.position
        else rig.joint.position
    )
    motion = recording.columns.get(motion_name)
    size = max(round(_WINDOW_S / recording.period_s), 10)
    starts = np.array(
        [
            a
            for span in recording.spans
            if span.trial
            for a in range(span.start, span.stop - size + 1, size)
        ],
        int,
    )
    if motion is None or len(starts) < 5:
        return []
    rows = starts[:, None] + np.arange(size)
    moved, own = np.ptp(motion[rows], axis=1), np.ptp(values[rows], axis=1)
    known = np.isfinite(moved) & np.isfinite(own)
    most = float(moved[known].max()) if known.any() else 0.0
    lively = known & (moved > 0.5 * most)
    per_motion = float(np.percentile(own[lively] / moved[lively], 75)) if most > 0.0 else 0.0
    dead = (own == 0.0) & (per_motion * moved > _STEPS_EXPECTED * step)
    if not dead.any():
        return []
    where = [(int(starts[i]), int(starts[i]) + size) for i in np.flatnonzero(dead)]
    value = values[where[0][0]]
    end = (
        "; it is at its "
        + ("highest" if value == np.nanmax(values) else "lowest")
        + " value, as of a sensor at the end of its range"
        if value in (np.nanmin(values), np.nanmax(values))
        else ""
    )
    return [
        _of(
            recording,
            "exclude",
            "saturated" if end else "frozen",
            name,
            f"found {value:.6g} without any change at {seconds(recording, where[0][0]):.3f} s"
            f" ({len(where)} windows of {_WINDOW_S:g} s) while {motion_name} moved, expected about"
            f" {per_motion * moved[dead][0]:.3g} of motion{end}; they are left out",
            where,
        )
    ]


def _still(recording: Recording, name: str, values: np.ndarray) -> list[Finding]:
    """A channel whose last step flickers, and that for a while does not, far longer than
    otherwise.
    """
    trial = judged_rows(recording, trials_only=True)
    changes = np.diff(values[~trial])  # outside of the trials, where few motions go to and fro
    changes = changes[np.isfinite(changes) & (changes != 0.0)]
    if (
        not trial.any()
        or len(changes) < 100
        or np.mean(changes[1:] * changes[:-1] < 0.0) < _FLICKERS
    ):
        return []
    runs = [
        (a - 1, b) for a, b in stretches(np.concatenate([[False], np.diff(values) == 0.0]) & trial)
    ]
    found = []
    for end in (None, float(np.nanmax(values[trial])), float(np.nanmin(values[trial]))):
        own = [run for run in runs if end is None or values[run[0]] == end]
        others = sorted((b - a for a, b in runs if end is None or values[a] != end), reverse=True)
        usual = others[min(_USUAL_RANK, len(others) - 1)] if others else 0
        least = max(
            (_STILL_S if end is None else _STILL_AT_END_S) / recording.period_s, _LONGER * usual
        )
        still = [(a, b) for a, b in own if b - a > least]
        if still and usual and (end is None or len(still) >= 3):
            kind, where = (
                ("frozen", "")
                if end is None
                else (
                    "saturated",
                    f", its {'highest' if end == np.nanmax(values[trial]) else 'lowest'} value",
                )
            )
            found.append(
                _of(
                    recording,
                    "exclude",
                    kind,
                    name,
                    f"found {values[still[0][0]]:.6g}{where}, without a flicker from"
                    f" {seconds(recording, still[0][0]):.3f} s on for {still[0][1] - still[0][0]}"
                    f" rows ({len(still)} stretches), expected one within some {usual} rows as"
                    " otherwise; they are left out",
                    still,
                )
            )
    return found[:1]

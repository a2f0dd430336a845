"""A channel of a rig of others that stands still while the rig moves, or without the flicker that
it has otherwise: frozen, to the end of the log or for a while.

Nothing is known of its converter. A force may move without a place, as dry friction holds it, but
no force stays the same to the last digit where a place moves; a joint that is asked to stay does so
while another moves, and one that dry friction or play holds goes on from where it rested. What
stands still at its lowest or highest value is left alone: a drive at its limit is at it.
"""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import PLACES
from epa_rt.gap.finding import Finding, measured_names, seconds, stretches
from epa_rt.gap.hygiene.values import repeats_at_rest
from epa_rt.gap.recording import Recording

_LEAST_ROWS = 100
_MOVED = 0.3  # of the range of another place or of a reference, over which nothing stays so
_ASKED = 0.05  # of its range: a joint that is asked for less is asked to stay
_LIVELY = 0.5  # share of rows with a change from which a channel is said to follow what moves
_FLICKERS_ROWS = (
    20  # rows within which a channel that flickers changes, but for one time in a hundred
)
_LONGER = 10.0  # times the usual, without any change
_QUANTITY = re.compile("_(?:position|angle|travel|speed|force|torque|current)_")
# share of rows with a change from which another channel does not rest meanwhile: dry friction holds
# a rig still, to the last digit of all its sensors
_FOLLOWS = 0.3


def check_still(
    recording: Recording, rig: Rig | None, asked: Mapping[str, Sequence[str]] | None = None
) -> list[Finding]:
    """Findings on measured channels that are frozen. ``asked``: column of a place to the columns of
    what is asked of it, where the rig file says so; else names tell.
    """
    return [
        finding
        for name in measured_names(recording)
        if (finding := _still(recording, name, (asked or {}).get(name, ()))) is not None
    ]


def _still(recording: Recording, name: str, asked: Sequence[str]) -> Finding | None:
    values = recording.columns[name]
    known = values[np.isfinite(values)]
    if len(known) < 2 * _LEAST_ROWS or known.min() == known.max():
        return None
    changes = np.diff(values) != 0.0  # NaN differs from itself
    runs = [(a, b + 1) for a, b in stretches(~changes)]
    long = [
        (a, b)
        for a, b in runs
        if b - a >= _LEAST_ROWS and values[a] not in (known.min(), known.max())
    ]
    if not long:
        return None
    rest = _rest(changes, long)
    long = [run for run in long if not _asked_to_stay(recording, name, asked, *run)]
    frozen = [run for run in long if _others_move(recording, name, *run)] if _lively(rest) else []
    if repeats_at_rest(values, _LEAST_ROWS):
        frozen = [run for run in frozen if not _eases(values, *run)]
    which = "while another channel moved"
    usual = _usual_rows(rest)
    if (
        not frozen and usual is not None and not name.endswith(PLACES)
    ):  # dry friction holds a place while its drive's force flickers
        frozen = [
            (a, b)
            for a, b in long
            if b - a > max(_LEAST_ROWS, _LONGER * usual) and not _rests(recording, name, a, b)
        ]
        which = "and without its flicker"
    if not frozen:
        return None
    first, total = frozen[0], sum(b - a for a, b in frozen)
    return Finding(
        "exclude",
        "frozen",
        recording.name,
        name,
        f"{recording.name}: {name}: found {values[first[0]]:.6g} without any change from"
        f" {seconds(recording, first[0]):.3f} s to {seconds(recording, first[1] - 1):.3f} s {which}"
        f" ({total} rows in {len(frozen)} stretch{'es' if len(frozen) > 1 else ''}), expected a"
        " channel that moves; they are left out",
        tuple(frozen),
    )


def _rest(changes: np.ndarray, long: list[tuple[int, int]]) -> np.ndarray:
    """Changes outside of long stretches."""
    kept = np.ones(len(changes), bool)
    for a, b in long:
        kept[a : b - 1] = False
    return changes[kept]


def _lively(rest: np.ndarray) -> bool:
    return len(rest) >= _LEAST_ROWS and bool(np.mean(rest) > _LIVELY)


def _usual_rows(rest: np.ndarray) -> float | None:
    """Rows within which a channel changes but for one time in a hundred; None where it does not
    flicker.
    """
    at = np.flatnonzero(rest)
    if len(at) < _LEAST_ROWS:
        return None
    usual = float(np.percentile(np.diff(at), 99))
    return usual if usual <= _FLICKERS_ROWS else None


def _eases(values: np.ndarray, start: int, stop: int) -> bool:
    """Whether a channel goes on after a stretch without a change from where it stood: it rested,
    held by friction or within its play. A frozen one jumps to where it has come meanwhile, further
    than it ever goes from row to row (but for one in a hundred). At the end of a log it must have
    come to rest slowly, by no more than its usual change.
    """
    changes = np.abs(np.diff(values))
    moved = changes[changes > 0.0]
    if stop < len(values):
        return not changes[stop - 1] > np.percentile(moved, 99)
    return not changes[start - 1] > np.median(moved)


def _asked_to_stay(
    recording: Recording, name: str, asked: Sequence[str], start: int, stop: int
) -> bool:
    """Whether all that a joint is asked for stands still meanwhile: it rests, whatever another one
    does. ``asked``: the columns that say it; where there are none, those of the joint's own name.
    """
    names = asked or [
        other
        for other in recording.columns
        if _is_asked(other) and other.endswith(PLACES) and _part(other[4:]) == _part(name)
    ]
    return bool(names) and not any(
        _goes(recording.columns[one], start, _answered(start, stop)) > _ASKED for one in names
    )


def _others_move(recording: Recording, name: str, start: int, stop: int) -> bool:
    """Whether another place moves meanwhile, or what is asked of one that could be this one's."""
    return any(
        _goes(values, start, _answered(start, stop) if _is_asked(other) else stop) > _MOVED
        for other, values in recording.columns.items()
        if other != name and other.endswith(PLACES)
    )


def _answered(start: int, stop: int) -> int:
    """Row up to which a channel has answered: it may still stand where it is asked to go on."""
    return stop - (stop - start) // 4


def _is_asked(name: str) -> bool:
    return name.startswith(("cmd_", "ref_"))


def _part(name: str) -> str:
    """'elbow' of 'elbow_position_rad', 'elbow_speed_rad_s' and 'elbow_torque_nm'."""
    return _QUANTITY.split(name)[0]


def _goes(values: np.ndarray, start: int, stop: int) -> float:
    """How far a channel goes within a stretch, in shares of its range; 0 where nothing is known of
    it.
    """
    within, known = values[start:stop], values[np.isfinite(values)]
    if not np.isfinite(within).any() or known.max() == known.min():
        return 0.0
    return float((np.nanmax(within) - np.nanmin(within)) / (known.max() - known.min()))


def _rests(recording: Recording, name: str, start: int, stop: int) -> bool:
    """Whether nothing else changes meanwhile. A channel alone does not rest: what is shut in has
    its noise.
    """
    others = [
        values[start:stop]
        for other, values in recording.columns.items()
        if other != name and not other.endswith("_raw")
    ]
    return bool(others) and not any(
        np.mean(np.abs(np.diff(values)) > 0.0) > _FOLLOWS for values in others
    )

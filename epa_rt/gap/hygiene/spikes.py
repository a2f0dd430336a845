"""What cannot jump and does: single rows far off the rows beside them, a channel that is gone for a
while, one that catches up with where it would have come.
"""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import PLACES
from epa_rt.gap.finding import Finding, measured_names, seconds, stretches
from epa_rt.gap.hygiene.values import is_analog
from epa_rt.gap.recording import Recording

_FAR = 15.0  # times what the rows of this channel are off their neighbours on 99 % of the rows
_STEPS = 20.0  # of the converter, at least
_AGREE = 0.1  # of the spike: by how much the two rows beside it may differ from each other
_STOOD_S, _STOOD_ROWS = 0.05, 20  # how long a channel stands before it jumps
_FLAT = 0.1  # of the smaller jump: by how much a channel may move while it is gone
_GONE_ROWS, _GONE = (
    2,
    0.5,
)  # rows at least, and share of the log at most, between the jump away and that back
_LONGEST_ROW_S = (
    0.01  # a chamber is filled and a servo turned within a longer one: a step is no jump then
)
# of a jump: how large the steps beside it may be; a valve that opens, a drive that speeds up take
# several rows
_BESIDE = 0.25
_WITH_INERTIA = (
    *PLACES,
    "_pa",
)  # of a rig of others: a current or a drive's force may well be one row long


def check_spikes(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on channels that cannot jump within a row or two: positions, pressures, load
    cells.
    """
    found = []
    for name in measured_names(recording):
        if _inert(name, rig):
            bad = _off_both(recording, name)
            steps, leaps = _steps(recording, name, bad)
            found += (
                _spikes(recording, name, bad)
                + _caught_up(recording, name, steps, leaps)
                + _gone(recording, name, steps, leaps)
            )
    return found


def _inert(name: str, rig: Rig | None) -> bool:
    if rig is None:
        return name.endswith(_WITH_INERTIA)
    return name in {row.name for row in rig.inputs} and (
        name == rig.motor.position or is_analog(rig, name)
    )


def _off_both(recording: Recording, name: str) -> np.ndarray:
    """(N,) bool: single rows far off both rows beside them, which agree. However many: they count
    neither as neighbours nor in what is usual.
    """
    values, bad = recording.columns[name], np.zeros(recording.samples, bool)
    if recording.samples < 100 or not np.isfinite(values).any():
        return bad
    before, one, after = values[1:-3], values[2:-2], values[3:-1]
    of_four = np.median(
        np.stack([values[:-4], before, after, values[4:]]), axis=0
    )  # a spike next to a row moves it little, one two rows away
    off = np.minimum(
        np.abs(one - of_four), np.abs(one - 0.5 * (before + after))
    )  # on each side does not move the mean of two
    off[np.diff(recording.cycle)[1:-2] != 1] = np.nan
    alone = np.abs(after - before) < _AGREE * off
    known = off[np.isfinite(off) & ~alone]
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    if len(known) and len(steps):
        bad[2:-2] = alone & (
            off > max(_FAR * float(np.percentile(known, 99.0)), _STEPS * float(np.median(steps)))
        )
    return bad


def _spikes(recording: Recording, name: str, bad: np.ndarray) -> list[Finding]:
    if not bad.any():
        return []
    values, row = recording.columns[name], int(np.argmax(bad))
    return [
        Finding(
            "exclude",
            "spike",
            recording.name,
            name,
            f"{recording.name}: {name}: found {values[row]:.6g} on one row at"
            f" {seconds(recording, row):.3f} s between {values[row - 1]:.6g} and"
            f" {values[row + 1]:.6g} ({int(bad.sum())} such rows), expected no jump to and fro;"
            " they are left out",
            tuple(stretches(bad)),
        )
    ]


def _caught_up(
    recording: Recording, name: str, steps: np.ndarray, leaps: np.ndarray
) -> list[Finding]:
    """A channel that stands still and then jumps to where it would have come: frozen, also where no
    motion is looked at (filling, venting).
    """
    values = recording.columns[name]
    least = max(round(_STOOD_S / recording.period_s), _STOOD_ROWS)
    stood = [
        (a, b + 1)
        for a, b in stretches(steps == 0.0)
        if b - a >= least and b < len(steps) and leaps[b]
    ]
    if not stood:
        return []
    (first, stop), rows = stood[0], sum(b - a for a, b in stood)
    return [
        Finding(
            "exclude",
            "frozen",
            recording.name,
            name,
            f"{recording.name}: {name}: found {values[first]:.6g} without any change from"
            f" {seconds(recording, first):.3f} s to {seconds(recording, stop - 1):.3f} s and then"
            f" {values[stop]:.6g} at once ({rows} rows in {len(stood)} stretches), expected no such"
            " jump; they are left out",
            tuple(stood),
        )
    ]


def _gone(recording: Recording, name: str, steps: np.ndarray, leaps: np.ndarray) -> list[Finding]:
    """A channel that jumps away, keeps one level and jumps back: a wire that came off and touched
    again. What jumped back is not away until the next jump.
    """
    values, at = recording.columns[name], np.flatnonzero(leaps)
    away, back = [], -1
    for a, b in zip(at[:-1], at[1:], strict=True):
        least, inside = min(abs(steps[a]), abs(steps[b])), values[a + 1 : b + 1]
        if (
            a > back
            and steps[a] * steps[b] < 0.0
            and _GONE_ROWS <= b - a <= _GONE * recording.samples
            and np.nanmax(inside) - np.nanmin(inside) < _FLAT * least
        ):
            away.append((int(a) + 1, int(b) + 1))
            back = b
    if not away:
        return []
    (first, stop), rows = away[0], sum(b - a for a, b in away)
    return [
        Finding(
            "exclude",
            "gone",
            recording.name,
            name,
            f"{recording.name}: {name}: found a jump from {values[first - 1]:.6g} to"
            f" {values[first]:.6g} at {seconds(recording, first):.3f} s and one back to"
            f" {values[stop]:.6g} at {seconds(recording, stop):.3f} s, flat between ({rows} rows in"
            f" {len(away)} stretches), as of a wire that is off; they are left out",
            tuple(away),
        )
    ]


def _steps(recording: Recording, name: str, bad: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From row to row, (N - 1,), NaN over a hole and beside spikes; and which of them are jumps,
    each by itself: none where rows are long or too little is known.
    """
    values = np.where(bad, np.nan, recording.columns[name])
    steps = np.diff(values)
    steps[np.diff(recording.cycle) != 1] = np.nan
    known, sizes = (
        np.abs(steps[np.isfinite(steps)]),
        np.diff(np.unique(values[np.isfinite(values)])),
    )
    if len(known) < 100 or not len(sizes) or recording.period_s > _LONGEST_ROW_S:
        return steps, np.zeros(len(steps), bool)
    jump = max(_FAR * float(np.percentile(known, 99.0)), _STEPS * float(np.median(sizes)))
    size = np.pad(np.nan_to_num(np.abs(steps)), 1)
    return steps, (size[1:-1] > jump) & (np.maximum(size[:-2], size[2:]) < _BESIDE * size[1:-1])

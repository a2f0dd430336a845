"""What cannot jump and does: single rows far off the rows beside them, a channel that is gone for a while, one that catches up with where it would have come."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.hygiene_finding import Finding, measured_names, seconds, stretches
from epa_rt.gap.hygiene_values import is_analog
from epa_rt.gap.recording import PLACES, Recording

_FAR = 15.0            # times what the rows of this channel are off their neighbours on 99 % of the rows
_STEPS = 20.0          # of the converter, at least
_AGREE = 0.1           # of the spike: by how much the two rows on both sides may differ from each other
_STOOD_S, _STOOD_ROWS = 0.05, 20  # how long a channel stands before it jumps
_FLAT = 0.1            # of the smaller jump: by how much a channel may move while it is gone
_GONE_ROWS, _GONE = 3, 0.5   # rows at least, and share of the log at most, between the jump away and that back
_WITH_INERTIA = (*PLACES, "_pa")  # of a rig of others: a current or a drive's force may well be one row long


def check_spikes(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on channels that cannot jump within a row or two: positions, pressures, load cells."""
    found = []
    for name in measured_names(recording):
        if _inert(name, rig):
            steps, jump = _steps(recording, name)
            found += _spikes(recording, name) + _caught_up(recording, name, steps, jump) + _gone(recording, name, steps, jump)
    return found


def _inert(name: str, rig: Rig | None) -> bool:
    if rig is None:
        return name.endswith(_WITH_INERTIA)
    return name in {row.name for row in rig.inputs} and (name == rig.motor.position or is_analog(rig, name))


def _spikes(recording: Recording, name: str) -> list[Finding]:
    values = recording.columns[name]
    if recording.samples < 100 or not np.isfinite(values).any():
        return []
    beside = np.stack([values[:-4], values[1:-3], values[3:-1], values[4:]])
    off, apart = values[2:-2] - beside.mean(axis=0), np.ptp(beside, axis=0)
    off[np.diff(recording.cycle)[1:-2] != 1] = np.nan
    known = np.abs(off[np.isfinite(off)])
    steps = np.diff(np.unique(values[np.isfinite(values)]))
    if not len(known) or not len(steps):
        return []
    least = max(_FAR * float(np.percentile(known, 99.0)), _STEPS * float(np.median(steps)))
    bad = np.zeros(recording.samples, bool)
    bad[2:-2] = (np.abs(off) > least) & (apart < _AGREE * np.abs(off))
    if not bad.any():
        return []
    row = int(np.argmax(bad))
    return [Finding("exclude", "spike", recording.name, name, f"{recording.name}: {name}: found {values[row]:.6g} on one row at {seconds(recording, row):.3f} s between {values[row - 1]:.6g} "
                    f"and {values[row + 1]:.6g} ({int(bad.sum())} such rows), expected no jump to and fro; they are left out", tuple(stretches(bad)))]


def _caught_up(recording: Recording, name: str, steps: np.ndarray, jump: float) -> list[Finding]:
    """A channel that stands still and then jumps to where it would have come: frozen, also where no motion is looked at (filling, venting)."""
    values = recording.columns[name]
    least = max(round(_STOOD_S / recording.period_s), _STOOD_ROWS)
    stood = [(a, b + 1) for a, b in stretches(steps == 0.0) if b - a >= least and b < len(steps) and abs(steps[b]) > jump]
    if not stood:
        return []
    (first, stop), rows = stood[0], sum(b - a for a, b in stood)
    return [Finding("exclude", "frozen", recording.name, name, f"{recording.name}: {name}: found {values[first]:.6g} without any change from {seconds(recording, first):.3f} s to {seconds(recording, stop - 1):.3f} s "
                    f"and then {values[stop]:.6g} at once ({rows} rows in {len(stood)} stretches), expected no such jump; they are left out", tuple(stood))]


def _gone(recording: Recording, name: str, steps: np.ndarray, jump: float) -> list[Finding]:
    """A channel that jumps away, keeps one level and jumps back: a wire that came off and touched again."""
    values = recording.columns[name]
    leaps = np.flatnonzero(np.abs(steps) > jump)
    away = []
    for a, b in zip(leaps[:-1], leaps[1:], strict=True):
        least, inside = min(abs(steps[a]), abs(steps[b])), values[a + 1:b + 1]
        if steps[a] * steps[b] < 0.0 and _GONE_ROWS <= b - a <= _GONE * recording.samples and np.nanmax(inside) - np.nanmin(inside) < _FLAT * least:
            away.append((int(a) + 1, int(b) + 1))
    if not away:
        return []
    (first, stop), rows = away[0], sum(b - a for a, b in away)
    return [Finding("exclude", "gone", recording.name, name, f"{recording.name}: {name}: found a jump from {values[first - 1]:.6g} to {values[first]:.6g} at {seconds(recording, first):.3f} s and one back to "
                    f"{values[stop]:.6g} at {seconds(recording, stop):.3f} s, flat between ({rows} rows in {len(away)} stretches), as of a wire that is off; they are left out", tuple(away))]


def _steps(recording: Recording, name: str) -> tuple[np.ndarray, float]:
    """From row to row, (N - 1,), NaN over a hole; and how large a jump is: infinite where too little is known."""
    values = recording.columns[name]
    steps = np.diff(values)
    steps[np.diff(recording.cycle) != 1] = np.nan
    known, sizes = np.abs(steps[np.isfinite(steps)]), np.diff(np.unique(values[np.isfinite(values)]))
    if len(known) < 100 or not len(sizes):
        return steps, np.inf
    return steps, max(_FAR * float(np.percentile(known, 99.0)), _STEPS * float(np.median(sizes)))

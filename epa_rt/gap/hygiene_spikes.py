"""Spikes: single rows far off what the rows beside them agree on, as of a broken contact or a word read half."""

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.gap.hygiene_finding import Finding, measured_names, seconds, stretches
from epa_rt.gap.hygiene_values import is_analog
from epa_rt.gap.recording import Recording

_FAR = 15.0            # times what the rows of this channel are off their neighbours on 99 % of the rows
_STEPS = 20.0          # of the converter, at least
_AGREE = 0.1           # of the spike: by how much the two rows on both sides may differ from each other
_STOOD_S, _STOOD_ROWS = 0.05, 20  # how long a channel stands before it jumps
_WITH_INERTIA = ("_m", "_rad", "_pa")  # of a rig of others: a current or a drive's force may well be one row long


def check_spikes(recording: Recording, rig: Rig | None) -> list[Finding]:
    """Findings on channels that cannot jump within a row or two: positions, pressures, load cells."""
    found = []
    for name in measured_names(recording):
        if _inert(name, rig):
            found += _spikes(recording, name) + _caught_up(recording, name)
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


def _caught_up(recording: Recording, name: str) -> list[Finding]:
    """A channel that stands still and then jumps to where it would have come: frozen, also where no motion is looked at (filling, venting)."""
    values = recording.columns[name]
    steps = np.diff(values)
    steps[np.diff(recording.cycle) != 1] = np.nan
    known, sizes = np.abs(steps[np.isfinite(steps)]), np.diff(np.unique(values[np.isfinite(values)]))
    if len(known) < 100 or not len(sizes):
        return []
    jump = max(_FAR * float(np.percentile(known, 99.0)), _STEPS * float(np.median(sizes)))
    least = max(round(_STOOD_S / recording.period_s), _STOOD_ROWS)
    stood = [(a, b + 1) for a, b in stretches(steps == 0.0) if b - a >= least and b < len(steps) and abs(steps[b]) > jump]
    if not stood:
        return []
    (first, stop), rows = stood[0], sum(b - a for a, b in stood)
    return [Finding("exclude", "frozen", recording.name, name, f"{recording.name}: {name}: found {values[first]:.6g} without any change from {seconds(recording, first):.3f} s to {seconds(recording, stop - 1):.3f} s "
                    f"and then {values[stop]:.6g} at once ({rows} rows in {len(stood)} stretches), expected no such jump; they are left out", tuple(stood))]

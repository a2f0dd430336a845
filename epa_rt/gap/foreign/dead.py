"""A channel of a component rig that says one and the same thing while the others move: a dead one, or a run without that drive."""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.foreign.rig_file import ForeignRig
from epa_rt.gap.hygiene_finding import Finding, measured_names
from epa_rt.gap.recording import Recording


def check_dead(recordings: Sequence[Recording], rig: ForeignRig) -> list[Finding]:
    """Notes on what is asked of a drive and never changes while another channel does. A shaft that runs down without a drive is a good log, so that
    nothing is refused; a sensor's own channel is looked at by the checks that every log passes."""
    found = []
    for recording in recordings:
        names = [name for name in rig.channels.values() if name in recording.columns]
        moving, measured = [name for name in names if _moves(recording.columns[name])], measured_names(recording)
        for name in names:
            if name not in moving and name not in measured and moving and np.isfinite(recording.columns[name]).any():
                value = float(np.nanmin(recording.columns[name]))
                found.append(Finding("note", "dropped channel", recording.name, name, f"{recording.name}: {name}: found {value:.6g} on every row while {moving[0]} moves, "
                                     "expected a channel that moves too: it is dead, or this log is of a run without its drive"))
    return found


def _moves(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(np.ptp(known) > 0.0)

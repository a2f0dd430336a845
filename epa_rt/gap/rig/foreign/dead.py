"""What is asked of a component rig's drive: missing where it counts, or one and the same thing
while the others move (a dead channel, or a run without that drive).
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.finding import Finding, judged_rows, measured_names
from epa_rt.gap.hygiene.values import invalid
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.rig_file import ForeignRig


def check_dead(recordings: Sequence[Recording], rig: ForeignRig) -> list[Finding]:
    """What is asked of a drive and has no value, and notes where it never changes while another
    channel does. A shaft that runs down without a drive is a good log, so that this refuses
    nothing; a sensor's own channel is looked at by the checks that every log passes.
    """
    found = []
    for recording in recordings:
        names = [name for name in rig.channels.values() if name in recording.columns]
        moving, measured = (
            [name for name in names if _moves(recording.columns[name])],
            measured_names(recording),
        )
        for name in (name for name in names if name not in measured):
            found += invalid(recording, name, recording.columns[name], judged_rows(recording))
            if name not in moving and moving and np.isfinite(recording.columns[name]).any():
                value = float(np.nanmin(recording.columns[name]))
                found.append(
                    Finding(
                        "note",
                        "dropped channel",
                        recording.name,
                        name,
                        f"{recording.name}: {name}: found {value:.6g} on every row while"
                        f" {moving[0]} moves, expected a channel that moves too: it is dead, or"
                        " this log is of a run without its drive",
                    )
                )
    return found


def _moves(values: np.ndarray) -> bool:
    known = values[np.isfinite(values)]
    return bool(len(known)) and bool(np.ptp(known) > 0.0)

"""Commands that the drive seems to answer before they act: rows of a recorder that counts a cycle
otherwise than this house's loop (docs/import.md, `answered_after`).

No law has that sign, and a millisecond is hundreds of floors in the drive's current.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.gap.finding import Finding
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.house.counter import LINK, left
from epa_rt.gap.side_by_side import each
from epa_rt.logs.layout import ANSWERED_AFTER

if TYPE_CHECKING:
    from epa_rt.gap.rig.house.subject import HouseSubject

# of the rms that the drive's loop leaves at the plant file's values, below which its commands are
# of earlier rows
PLAINLY = 0.2


def check_early(recordings: Sequence[Recording], subject: "HouseSubject") -> tuple[Finding, ...]:
    """A refusal of the first recording whose drive's current is only understood with its commands
    some rows earlier.
    """
    if LINK not in {link.name for link in subject.links}:
        return ()
    rows_earlier = range(ANSWERED_AFTER + 1)
    for recording, off in zip(
        recordings,
        each(
            lambda one: [left(subject, [_earlier(one, rows)]) for rows in rows_earlier], recordings
        ),
        strict=True,
    ):
        best = int(np.argmin(off))
        if best and off[best] < PLAINLY * off[0]:
            return (
                Finding(
                    "refuse",
                    "rows",
                    recording.name,
                    "",
                    f"{recording.name}: found commands that the drive answers {best}"
                    f" row{'s' if best > 1 else ''} before they act (its current is off by"
                    f" {off[0]:.3g} A, by {off[best]:.3g} A with the commands so much earlier),"
                    " expected rows as this house's loop writes them: 'answered_after:"
                    f" {ANSWERED_AFTER - best}' in the mapping",
                ),
            )
    return ()


def _earlier(recording: Recording, rows: int) -> Recording:
    """Each row with what is commanded so many rows later; the last ones hold."""
    later = np.minimum(np.arange(recording.samples) + rows, recording.samples - 1)
    return (
        replace(
            recording,
            columns={
                name: values[later] if name.startswith("cmd_") else values
                for name, values in recording.columns.items()
            },
        )
        if rows
        else recording
    )

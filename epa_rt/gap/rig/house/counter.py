"""Whether a motor's counter cuts its angle downward, as this house's drives and their simulation
do, or rounds it: told by the drive's own loop.

Half a count is far below whatever a spool or a lever shows of it, and yet a stiff loop answers it
with tenths of an ampere. A drive that closes its loop on the very counts that it reports reads like
one that rounds.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.gap.finding import Finding
from epa_rt.gap.recording import Recording
from epa_rt.gap.side_by_side import each

if TYPE_CHECKING:
    from epa_rt.gap.rig.house.subject import HouseSubject

PORT, LINK = "motor_angle_rad", "drive"
# of the rms that the drive's loop leaves at the plant file's values, below which the other way of
# counting is the rig's
PLAINLY = 0.5


def as_counted(
    subject: "HouseSubject", recordings: Sequence[Recording]
) -> "tuple[HouseSubject, tuple[Finding, ...]]":
    """The subject that reads these recordings' counts as their drive's loop says, and a note where
    that is not how this house's drives count.
    """
    channel = subject.channels.get(PORT)
    if channel is None or not channel.floors or LINK not in {link.name for link in subject.links}:
        return subject, ()
    other = _rounding(subject)
    cuts, rounds = (left(one, recordings) for one in (subject, other))
    if not rounds < PLAINLY * cuts:
        return subject, ()
    says = (
        f"{channel.column}: found counts that are rounded to the nearest, or a drive that closes"
        f" its loop on the counts themselves (its current is off by {rounds:.3g} A so read, by"
        f" {cuts:.3g} A otherwise), expected counts that are cut downward; they are read as found"
    )
    return other, (Finding("note", "counts", "", channel.column, says),)


def _rounding(subject: "HouseSubject") -> "HouseSubject":
    return subject.on_channels(
        {**subject.channels, PORT: subject.channels[PORT]._replace(floors=False)}
    )


def left(subject: "HouseSubject", recordings: Sequence[Recording]) -> float:
    """rms of the drive's link at the plant file's values, A; infinite where nothing of it can be
    judged.
    """
    residuals = np.concatenate(
        each(lambda recording: subject.residual(subject.prepare(recording), {}, LINK), recordings)
    )
    return float(np.sqrt(np.nanmean(residuals**2))) if np.isfinite(residuals).any() else np.inf

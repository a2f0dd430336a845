"""Where a sliding part stands still: friction then takes any force up to its own, so that no law
foresees what the drive gives.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.gap.foreign.component import Numbers
from epa_rt.gap.foreign.moved import cut_off
from epa_rt.gap.foreign.signals import Signals
from epa_rt.gap.hygiene.finding import Finding, stretches
from epa_rt.gap.recording import Recording

if TYPE_CHECKING:
    from epa_rt.gap.foreign.subject import ForeignSubject

NOISE_ONLY = 4.0  # deviations of a speed's noise below which its sign is chance
STILL = 3e-3  # of the typical speed: the filter's tails of the motion before
# periods of the motion's cut-off: a reversal passes faster, and says much of friction; sticks of 10
# to 25 ms had left 1.6 to 3.6 floors of carriages without a gap (at 0.8 a rise towards standstill
# in other words became a scale of the drive beside it)
RESTS = 1.5
LONGEST_S = 0.1  # that a rest must last, however slowly the motion is seen
SPREAD = 2.0  # cut-off periods over which the filter spreads what is there
WORTH_SAYING = 0.02  # of the rows


def at_rest(signals: Signals, speed_m_s: np.ndarray, numbers: Numbers) -> np.ndarray:
    """(N,) rows in which the speed, that of the filtered position, has been noise for longer than a
    reversal takes, and those around them over which the filter spreads what is there.
    """
    hertz, noise = cut_off(signals, numbers)
    slow = np.abs(speed_m_s) < max(NOISE_ONLY * noise, STILL * numbers["typical_speed"])
    found, around = (
        np.zeros(len(slow), bool),
        int(np.ceil(SPREAD * signals.rate_hz / signals.lowpass_hz)),
    )
    for start, stop in stretches(slow):
        if stop - start >= min(RESTS / hertz, LONGEST_S) * signals.rate_hz:
            found[max(start - around, 0) : stop + around] = True
    return found


def check_rests(recordings: Sequence[Recording], subject: "ForeignSubject") -> list[Finding]:
    """Notes on recordings of which much is not judged because nothing moves."""
    if subject.rig.component.undetermined is None:
        return []
    return [
        finding for recording in recordings if (finding := _said(recording, subject)) is not None
    ]


def _said(recording: Recording, subject: "ForeignSubject") -> Finding | None:
    share = float(np.mean(subject.prepare(recording).undetermined))
    if share < WORTH_SAYING:
        return None
    return Finding(
        "note",
        "rest",
        recording.name,
        "",
        f"{recording.name}: found nothing moving in {share:.0%} of the rows; what a drive gives"
        " there is taken by friction whatever its law, and these rows are not judged",
    )

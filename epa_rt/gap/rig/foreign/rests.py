"""Where a sliding part stands still: friction then takes any force up to its own, so that no law
foresees what the drive gives.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from epa_rt.gap.finding import Finding, stretches
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.component import Numbers
from epa_rt.gap.rig.foreign.moved import cut_off
from epa_rt.gap.rig.foreign.signals import Signals

if TYPE_CHECKING:
    from epa_rt.gap.rig.foreign.subject import ForeignSubject, Ready

NOISE_ONLY = 4.0  # deviations of a speed's noise below which its sign is chance
STILL = 3e-3  # of the typical speed: the filter's tails of the motion before
# periods of the motion's cut-off: a reversal passes faster, and says much of friction; sticks of 10
# to 25 ms had left 1.6 to 3.6 floors of carriages without a gap (at 0.8 a rise towards standstill
# in other words became a scale of the drive beside it)
RESTS = 1.5
LONGEST_S = 0.1  # that a rest must last, however slowly the motion is seen
SPREAD = 2.0  # cut-off periods over which the filter spreads what is there
ACCELERATED_ROWS = 2  # over which two slopes spread most of it, where nothing is filtered
WORTH_SAYING = 0.02  # of the rows


def at_rest(signals: Signals, speed_m_s: np.ndarray, numbers: Numbers) -> np.ndarray:
    """(N,) rows in which the speed, that of the filtered position, has been noise for longer than a
    reversal takes, and those around them over which the filter spreads what is there.
    """
    hertz, noise_m_s, _ = cut_off(signals, numbers)
    slow = slow_rows(speed_m_s, noise_m_s, numbers)
    found, around = np.zeros(len(slow), bool), _spread_rows(signals, signals.rate_hz)
    for start, stop in stretches(slow):
        if stop - start >= least_rows(hertz, signals.rate_hz):
            found[max(start - around, 0) : stop + around] = True
    return found


def least_rows(hertz: float, rate_hz: float) -> float:
    """Rows of slow motion from which it is a rest; ``hertz``: the cut-off of the position."""
    return min(RESTS / hertz, LONGEST_S) * rate_hz


def slow_rows(speed_m_s: np.ndarray, noise_m_s: float, numbers: Numbers) -> np.ndarray:
    """(N,) bool: rows in which a speed's sign is noise, or a filter's tail."""
    return np.abs(speed_m_s) < max(NOISE_ONLY * noise_m_s, STILL * numbers["typical_speed"])


def _spread_rows(signals: Signals, rate_hz: float) -> int:
    """Rows of ``rate_hz`` around a rest in which it is seen still."""
    if signals.lowpass_hz >= 0.5 * signals.rate_hz:
        return int(np.ceil(ACCELERATED_ROWS * rate_hz / signals.rate_hz))
    return int(np.ceil(SPREAD * rate_hz / signals.lowpass_hz))


def check_rests(recordings: Sequence[Recording], subject: "ForeignSubject") -> list[Finding]:
    """Notes on recordings of which much is not judged because nothing moves."""
    if subject.rig.component.undetermined is None:
        return []
    return [
        finding for recording in recordings if (finding := _said(recording, subject)) is not None
    ]


def _said(recording: Recording, subject: "ForeignSubject") -> Finding | None:
    ready = subject.prepare(recording)
    share = float(np.mean(ready.undetermined))
    if share < WORTH_SAYING:
        return None
    held, unit = _held(ready, subject)
    bound = (
        f"; there it varied by {2.0 * held:.3g} {unit}: unless something moves that this log does"
        f" not show, dry friction is {held:.3g} {unit} at least"
        if held > 0.0
        else ""
    )
    return Finding(
        "note",
        "rest",
        recording.name,
        "",
        f"{recording.name}: found nothing moving in {share:.0%} of the rows; what a drive gives"
        f" there is taken by friction whatever its law, and these rows are not judged{bound}",
    )


def _held(ready: "Ready", subject: "ForeignSubject") -> tuple[float, str]:
    """Half of what the drive's effort varied by in one rest, the most of all rests, and its unit:
    a constant load may be in it, and dry friction held the rest of it both ways. 0 where none of
    it was measured, or more than friction holds against it.
    """
    role = subject.rig.component.effort
    if role is None or role not in ready.signals.columns:
        return 0.0, ""
    effort = ready.signals.columns[role][:: ready.signals.stride]
    around = _spread_rows(ready.signals, subject.rate_hz)
    varied = [
        float(np.ptp(effort[start + around : stop - around]))
        for start, stop in stretches(ready.undetermined[: len(effort)])
        if stop - start > 2 * around + 1
    ]
    unit = next(link.unit for link in subject.links)
    return 0.5 * max(varied, default=0.0), unit

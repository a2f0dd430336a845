"""A place that is read so coarsely that what the mass asks for drowns in its noise: a narrower
low-pass is taken, and said.

A controller that reads the same place answers its noise. Behind a low-pass that lets much of it
through, a law of the drive may explain noise by that answer.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from epa_rt.gap.finding import Finding
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.subject import ForeignSubject, Ready

LOUD = 0.05  # of the typical force: as large as an effect of typical strength, which drowns in it
STEEP = 2.5  # white noise, sloped twice and low-passed, grows with that power of the cut-off


class _Loud(NamedTuple):
    """A log's noise in what the mass asks for, in the link's unit; the most that may be; and the
    cut-off behind which it is no more, Hz.
    """

    log: str
    noise: float
    most: float
    enough_hz: float


def narrowed(
    subject: ForeignSubject, recordings: Sequence[Recording]
) -> tuple[ForeignSubject, list[Finding]]:
    """The subject behind the low-pass that the noisiest place asks for, and a note on each log that
    asks for one; the subject as it is where none does, or where no row would be judged behind it.
    """
    loud = [one for log in recordings if (one := _loud(subject, log)) is not None]
    if not loud:
        return subject, []
    hertz = min(one.enough_hz for one in loud)
    lower = ForeignSubject(
        replace(subject.rig, lowpass_hz=hertz), subject.plant, subject.leave_out, subject.baseline
    )
    if not all(_judges(lower.prepare(log)) for log in recordings):
        lower = subject
    return lower, [_said(one, subject, lower) for one in loud]


def _loud(subject: ForeignSubject, recording: Recording) -> _Loud | None:
    ready = subject.prepare(recording)
    turning = subject.turning(ready)
    if turning is None or turning.mass_noise <= LOUD * turning.typical:
        return None
    most = LOUD * turning.typical
    enough_hz = ready.signals.lowpass_hz * (most / turning.mass_noise) ** (1.0 / STEEP)
    return _Loud(recording.name, turning.mass_noise, most, enough_hz)


def _judges(ready: Ready) -> bool:
    return all(rows.any() for rows in ready.judged.values())


def _said(loud: _Loud, subject: ForeignSubject, lower: ForeignSubject) -> Finding:
    unit = subject.links[0].unit
    done = (
        f"a lowpass of {loud.enough_hz:.1g} Hz would do, and would leave no row to judge"
        if lower is subject
        else f"the low-pass is taken at {lower.lowpass_hz:.2g} Hz"
    )
    return Finding(
        "note",
        "noisy place",
        loud.log,
        "",
        f"{loud.log}: found noise or steps of the place that make {loud.noise:.2g} {unit} of what"
        f" the mass asks for behind {subject.lowpass_hz:g} Hz, expected {loud.most:.2g} {unit} at"
        f" most, or effects drown in it: {done}",
    )

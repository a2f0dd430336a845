"""A place that is read so coarsely that what the mass asks for drowns in its noise: a note says
which low-pass would do.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from epa_rt.gap.finding import Finding
from epa_rt.gap.recording import Recording

if TYPE_CHECKING:
    from epa_rt.gap.rig.foreign.subject import ForeignSubject

LOUD = 0.05  # of the typical force: as large as an effect of typical strength, which drowns in it
STEEP = 2.5  # white noise, sloped twice and low-passed, grows with that power of the cut-off


def check_noisy_place(recordings: Sequence[Recording], subject: "ForeignSubject") -> list[Finding]:
    """Notes on recordings whose place has more noise than the rig file's low-pass is for."""
    return [
        finding for recording in recordings if (finding := _said(recording, subject)) is not None
    ]


def _said(recording: Recording, subject: "ForeignSubject") -> Finding | None:
    ready = subject.prepare(recording)
    turning = subject.turning(ready)
    if turning is None or turning.mass_noise <= LOUD * turning.typical:
        return None
    most, unit, here_hz = LOUD * turning.typical, subject.links[0].unit, ready.signals.lowpass_hz
    enough_hz = here_hz * (most / turning.mass_noise) ** (1.0 / STEEP)
    return Finding(
        "note",
        "noisy place",
        recording.name,
        "",
        f"{recording.name}: found noise or steps of the place that make {turning.mass_noise:.2g}"
        f" {unit} of what the mass asks for behind {here_hz:g} Hz, expected {most:.2g} {unit} at"
        f" most, or effects drown in it: a lowpass of {enough_hz:.1g} Hz in the rig file would do",
    )

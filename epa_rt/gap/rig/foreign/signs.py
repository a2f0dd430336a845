"""An output whose sign may be turned, on rigs of others: it runs against what the rig's own plant
makes of the other channels.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.finding import Finding, correlation
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign.subject import ForeignSubject

# correlation of measured and foreseen; EMPS has 0.985 without friction or offset, the SO-101 0.989
AGAINST = -0.9
ENOUGH_S = 5.0  # of rows that count


def check_signs(recordings: Sequence[Recording], subject: ForeignSubject) -> list[Finding]:
    """Notes on outputs that run against the plant file as it stands. A strong spring on a light
    carriage, a load on a servo that holds and a delay of half a period do the same, so that this is
    said and not refused. A kind whose output stands on its own is not asked.
    """
    if not subject.rig.component.output_is_foreseen:
        return []
    return [
        finding
        for recording in recordings
        for link in subject.links
        if (finding := _checked(recording, subject, link)) is not None
    ]


def _checked(recording: Recording, subject: ForeignSubject, link) -> Finding | None:
    ready = subject.prepare(recording)
    left = subject.residual(ready, {}, link.name)
    signals = ready.signals
    measured = signals.lowpass(signals.columns[subject.role_of(link.name)])[:: signals.stride]
    judged = np.isfinite(left)
    alike = (
        correlation(measured[judged], (measured - left)[judged])
        if judged.sum() > ENOUGH_S * subject.rate_hz
        else 0.0
    )
    if alike > AGAINST:
        return None
    return Finding(
        "note",
        "sign",
        recording.name,
        link.channel,
        f"{recording.name}: {link.channel}: found a correlation of {alike:.2f} with what the plant"
        " file makes of the other channels, expected a positive one: the sign of one of them may"
        " be turned (a scale of -1 in the import turns it back)",
    )

"""A channel whose sign is turned, on rigs of others: what is measured runs against what the rig's own plant makes of the other channels."""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.foreign.subject import ForeignSubject
from epa_rt.gap.hygiene_finding import Finding
from epa_rt.gap.recording import Recording

AGAINST = -0.8  # correlation, with and without its mean, of measured and foreseen; a wrong plant is far from it: EMPS without friction or offset has 0.9
ENOUGH = 50     # rows


def check_signs(recordings: Sequence[Recording], subject: ForeignSubject) -> list[Finding]:
    """Findings on outputs that run against the plant file as it stands; a kind whose output stands on its own is not asked."""
    if not subject.rig.component.signed:
        return []
    return [finding for recording in recordings for link in subject.links if (finding := _checked(recording, subject, link)) is not None]


def _checked(recording: Recording, subject: ForeignSubject, link) -> Finding | None:
    missing = [channel.role for channel in subject.rig.component.channels if channel.required and subject.rig.channels[channel.role] not in recording.columns]
    if missing:
        return None
    ready = subject.prepare(recording)
    left = subject.residual(ready, {}, link.name)
    signals = ready.signals
    measured = signals.lowpass(signals.columns[subject.role_of(link.name)])[:: signals.stride]
    judged = np.isfinite(left)
    foreseen, measured = (measured - left)[judged], measured[judged]
    if len(measured) < ENOUGH or max(_alike(measured, foreseen), _alike(measured - measured.mean(), foreseen - foreseen.mean())) > AGAINST:
        return None
    return Finding("refuse", "sign", recording.name, link.channel,
                   f"{recording.name}: {link.channel}: found a correlation of {_alike(measured, foreseen):.2f} with what the plant file makes of the other channels, "
                   "expected a positive one: the sign of one of them looks turned (a scale of -1 in the import would turn it back)")


def _alike(x: np.ndarray, y: np.ndarray) -> float:
    size = float(np.linalg.norm(x) * np.linalg.norm(y))
    return float(x @ y) / size if size > 0.0 else 0.0

"""A run that was broken off and went on in another log, read as one data set: of every trial the
whole one.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from epa_rt.gap.recording import Recording
from epa_rt.runs.resume import ATTACHMENT, EarlierLog, earlier_logs, file_sha256


def as_one_series(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings, with trials that were run again in a later log no longer marked as trials.

    ``found`` says which, and which earlier log is not among them. A log is known by its content,
    not by its name. Raises OSError.
    """
    chains, said = _chains(recordings)
    if not chains and not said:
        return tuple(recordings)
    digests = {r.path: file_sha256(Path(r.path)) for r in recordings}
    kept: dict[str, EarlierLog] = {}
    for path, chain in chains.items():
        for one in chain:
            kept.setdefault(one.sha256, one)
            if one.sha256 not in digests.values() and one.trials:
                said.setdefault(path, []).append(
                    f"goes on from {one.name}, which is not among these logs:"
                    f" {len(one.trials)} of its trials are missing here"
                )
    return tuple(_without(r, kept.get(digests[r.path]), said.get(r.path, ())) for r in recordings)


def _chains(
    recordings: Sequence[Recording],
) -> tuple[dict[str, tuple[EarlierLog, ...]], dict[str, list[str]]]:
    """The earlier logs of each recording that goes on from some, and what is wrong, by path."""
    chains: dict[str, tuple[EarlierLog, ...]] = {}
    said: dict[str, list[str]] = {}
    for recording in recordings:
        note = recording.attachments.get(ATTACHMENT)
        if note is None:
            continue
        try:
            chains[recording.path] = earlier_logs(note)
        except ValueError as error:
            said[recording.path] = [str(error)]
    return chains, said


def _without(recording: Recording, earlier: EarlierLog | None, said: Sequence[str]) -> Recording:
    found = (*recording.found, *said)
    if earlier is None:
        return dataclasses.replace(recording, found=found)
    again = [s.name for s in recording.spans if s.trial and s.name not in earlier.trials]
    if again:
        found = (*found, f"{', '.join(again)}: run again in a later log, which is read instead")
    spans = tuple(
        dataclasses.replace(s, trial=s.trial and s.name not in again) for s in recording.spans
    )
    return dataclasses.replace(recording, spans=spans, found=found)

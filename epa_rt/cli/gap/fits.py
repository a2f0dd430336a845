"""What belongs together: logs to a rig of others, and no output on top of an input."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError
from epa_rt.config.near_names import most_like

if TYPE_CHECKING:
    from epa_rt.gap.recording import Recording


# by which a log's rate may be beside a multiple of the residuals': its trials would be looked for
# elsewhere
CLOCKS = 0.01


def check_columns(subject, rig_file: Path, recordings: "Sequence[Recording]") -> None:
    """Raises VerbError where a log was recorded on another component rig, at a rate that is none of
    its residuals' multiples, or lacks a column that its kind cannot do without.
    """
    from epa_rt.gap.rig.foreign.signals import stride

    needed = {
        subject.rig.channels[channel.role]
        for channel in subject.rig.component.channels
        if channel.required
    }
    for recording in recordings:
        if recording.rig and recording.rig != subject.name:
            raise VerbError(
                f"{recording.path}: found a log of the rig '{recording.rig}', expected"
                f" '{subject.name}', as {rig_file} says"
            )
        recorded = 1.0 / recording.period_s
        if abs(recorded / stride(recorded, subject.rate_hz) / subject.rate_hz - 1.0) > CLOCKS:
            raise VerbError(
                f"{recording.path}: found {recorded:g} Hz, expected a multiple of"
                f" {subject.rate_hz:g} Hz, the rate of {rig_file}"
            )
        missing = sorted(needed - recording.columns.keys())
        if missing:
            alike = most_like(missing[0], recording.columns, close=0.0)
            raise VerbError(
                f"{recording.path}: found no column {', '.join(missing)}, expected what {rig_file}"
                f" names under channels; most like it are {', '.join(alike)}"
            )


def check_trials(recordings: "Sequence[Recording]") -> None:
    """Raises VerbError where a log has no trial, with what is wrong with it beside."""
    for recording in recordings:
        if not any(span.trial for span in recording.spans):
            why = f" ({'; '.join(recording.found)})" if recording.found else ""
            raise VerbError(
                f"{recording.path}: found no trial{why}, expected one at least that can be judged"
            )


def check_judged(places: Sequence, subject) -> None:
    """Raises VerbError where not one block was judged: that would read as if there were no gap."""
    if not places:
        from epa_rt.gap.likelihood.floor import ORDER
        from epa_rt.gap.rig.foreign.subject import ForeignSubject

        beside = ""
        if isinstance(subject, ForeignSubject):
            ends_s = 2.0 * subject.rig.component.settled / subject.rig.lowpass_hz
            beside = (
                f" beside the {ends_s:.3g} s at most that the low-pass takes at both ends,"
                f" {ORDER / subject.rate_hz + ends_s:.3g} s together"
            )
        raise VerbError(
            f"found no stretch of these logs on which a block of the rig {subject.name} can be"
            f" judged, expected more than {ORDER} rows in a row at {subject.rate_hz:g} Hz{beside}:"
            " longer motions, or fewer holes"
        )


def check_spares(out: Path | None, inputs: "Sequence[Path | None]") -> None:
    """Raises VerbError where a file to be written is one of those that are read."""
    for path in inputs:
        if (
            out is not None
            and path is not None
            and out.exists()
            and path.exists()
            and out.samefile(path)
        ):
            raise VerbError(
                f"{out}: found a file that is read here, expected another name (it stays as it is)"
            )

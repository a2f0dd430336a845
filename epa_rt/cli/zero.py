"""The zero of a rig on the command line: its file read before a run, its end written after."""

import argparse
import getpass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import TRIPPED, VerbError
from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import written_to

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.config.source import Located
    from epa_rt.logs.recorder import LogSummary
    from epa_rt.loop.run import RunResult
    from epa_rt.signals.codec import Decoder

UNFINISHED = "unfinished"  # in the place of a method, while a drive sets its zero
# causes of a trip by the motor's position after which its count need not be that of before
LOST_POSITION = (
    "position jump",
    "contradiction",
    "invalid sensor",
    "stale",
    "NaN",
    "implausible sensor",
)


def load_rig_source(path: Path, with_zero: bool, emulated: bool = False) -> "tuple[Located, Rig]":
    """The rig file with what its calibration files say, and its zero file where there is one.
    Raises ConfigError.
    """
    from epa_rt.config.calibration_file import self_contained
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import load_yaml
    from epa_rt.config.zero_file import APPLIED, read_zero, zero_path
    from epa_rt.config.zero_file import with_zero as joined

    source = self_contained(load_yaml(path))
    rig = rig_from(source)
    if not with_zero:
        return source, rig
    if isinstance(source.data, dict) and APPLIED in source.data:
        raise source.error((APPLIED,), "a section that only a log has", "a zero file: epa home")
    zero = read_zero(zero_path(path, emulated), rig.name)
    if zero is None:
        return source, rig
    source = joined(source, zero)
    return source, rig_from(source)


def is_emulated(arguments: argparse.Namespace) -> bool:
    """Whether the bus that is asked for is an emulated one, which has a zero file of its own."""
    if arguments.backend == "sim":
        return False
    from drivers.interface import is_emulated_bus

    return is_emulated_bus(arguments.interface)


def kind_of_rig(arguments: argparse.Namespace) -> str:
    """'sim', 'emulated' or 'ethercat': what runs on one of them counts on no other."""
    return "emulated" if is_emulated(arguments) else str(arguments.backend)


def is_unfinished(rig: "Rig") -> bool:
    """Whether the drive was told to set its zero and that did not come to a good end."""
    return rig.applied_zero is not None and rig.applied_zero.method == UNFINISHED


def need_zero_file(rig: "Rig", path: Path, emulated: bool = False) -> None:
    """A wired drive keeps no zero: without its file nothing is known. A drive on the bus whose
    homing was broken off may say that it is referenced, to another place. Raises VerbError.
    """
    from epa_rt.config.zero_file import zero_path

    file = zero_path(path, emulated)
    if is_unfinished(rig):
        raise VerbError(
            f"{file}: found a zero that was being set and was not read back, so the"
            f" drive may call itself referenced elsewhere, expected a whole one: epa home --rig"
            f" {path}",
            TRIPPED,
        )
    if rig.drive.interface != "analog":
        return
    if rig.applied_zero is None or rig.applied_zero.end is None:
        raise VerbError(
            f"{file}: found no file that says where travel is zero and where the last"
            f" run ended, expected one (a wired drive keeps neither): epa home --rig {path}",
            TRIPPED,
        )


def need_known_count(rig: "Rig", path: Path, stayed_on: bool) -> None:
    """Where a wired drive's count cannot tell that its supply was off, the operator must: by
    ``stayed_on``, which an emulated drive needs not. Raises VerbError.
    """
    if stayed_on or not (words := blind_words(rig)):
        return
    raise VerbError(
        f"{path}: found a wired drive whose count tells nothing{words}; expected epa home --rig"
        f" {path}, or --supply-stayed-on where it was on all the time",
        TRIPPED,
    )


def keep_end(
    rig: "Rig",
    path: Path,
    decoder: "Decoder",
    summary: "LogSummary",
    result: "RunResult",
    found_zero: bool | None,
    emulated: bool = False,
) -> None:
    """Writes the count where a wired drive's run ended, for the next start to compare with.

    ``found_zero`` None: the run never looked, and the last end stays. Of a run without a zero, or
    that lost its position on the way, none is kept, so that no later count looks right by chance.
    Raises VerbError where it cannot be written, once the run's end is told.
    """
    from epa_rt.cli.run import closing_text
    from epa_rt.config.zero_file import read_zero, write_zero, zero_path

    if rig.drive.interface != "analog" or rig.applied_zero is None or found_zero is None:
        return
    end = raw_count(rig, decoder) if found_zero and not _lost_position(rig, result) else None
    file = zero_path(path, emulated)
    zero = read_zero(file, rig.name)
    if zero is None:
        return
    try:
        with written_to(file):
            write_zero(file, zero.model_copy(update={"end": end}))
    except VerbError:
        print(filled(closing_text(summary, result, rig)))
        raise


def _lost_position(rig: "Rig", result: "RunResult") -> bool:
    """Whether the motor's count was found wrong in the run, first or on the way to its end: it may
    have lost its place.
    """
    trip = result.trip
    by_trip = trip is not None and trip.signal == rig.motor.position
    return result.position_lost or (by_trip and trip.cause in LOST_POSITION)


def raw_count(rig: "Rig", decoder: "Decoder") -> int | None:
    """The encoder's own count in the last cycle; None where there was none."""
    from epa_rt.loop.referenced import position_scaling

    travel = decoder.measured[rig.motor.position]
    return round(position_scaling(rig).to_counts(travel)) if travel == travel else None


def bring_zero(rig: "Rig", source: Path | None, copy: Path) -> list[str]:
    """Puts the zero files of a rig file beside a copy of it. Gives what is to be said of each.

    Not of a wired drive: where its last run ended stands in one file only, else the copy would
    believe an older one. ``source`` None: the copy is out of a log. Raises VerbError, ConfigError.
    """
    from epa_rt.config.zero_file import read_zero, write_zero, zero_path

    if rig.drive.interface == "analog":
        instead = "" if source is None else f", or put it in the place of {source}"
        return [f"note: a wired drive's zero is no part of it: epa home --rig {copy}{instead}"]
    said = []
    for emulated in (False, True):
        zero = None if source is None else read_zero(zero_path(source, emulated), rig.name)
        there = zero_path(copy, emulated)
        if zero is None:
            continue
        if there.exists():
            said.append(f"note: {there} was there before and stays: epa home --rig {copy}")
        else:
            with written_to(there):
                write_zero(there, zero)
            said.append(str(there))
    return said


def zero_words(rig: "Rig", backend: str) -> str:
    """Where the zero of this run comes from, for log and screen."""
    applied = rig.applied_zero
    if applied is not None:
        by = f" by {applied.who}" if applied.who else ""
        offset = f", {applied.offset:+d} counts" if applied.offset else ""
        return f"zero by {applied.method}, set {applied.when}{by}{offset}{blind_words(rig)}"
    if backend == "sim":
        return "a simulated rig starts at its zero"
    return "no zero file beside the rig: only the drive's own bit is checked"


def blind_words(rig: "Rig") -> str:
    """Where a wired drive's last run ended near the count at which it begins once its supply is
    back, a loss of that supply does not show. Empty where it would.
    """
    from epa_rt.loop.referenced import position_scaling

    applied = rig.applied_zero
    if rig.drive.interface != "analog" or applied is None or applied.end is None:
        return ""
    if abs(applied.end * position_scaling(rig).slope) > rig.motor.zero.end_band:
        return ""
    return (
        f"; its last run ended at count {applied.end}, near 0, where a drive begins to count: if"
        " its supply was off since then, travel has no zero, and nothing else tells"
    )


def who() -> str:
    """The operator's name on this machine; empty where there is none."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return ""


def now() -> str:
    """The time in UTC, to the second."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")

"""Set the zero of a rig's travel, as its file says under motor.zero.

The motor moves slowly (methods stop and taut_strap) and is left standing at the mean of its
touches, vented and without power. The drive sets its own count there to that of `at`. By the method
index the drive itself moves, to its encoder's index pulse, by one motor turn and what it needs to
stop. What was set is written into the zero file beside the rig file; a run on the real rig reads
it, and is refused where travel has no zero. On the simulated rig nothing is written beside the rig
file: the zero file goes into the folder of the logs. An emulated bus has a file of its own,
RIG.emulated.zero.yaml.

  epa home --rig config/rigs/bench.yaml -o out
  epa home --rig config/rigs/bench.yaml --unreferenced --yes -o out
  epa home --rig config/rigs/bench.yaml --backend ethercat --interface eth1 -o out
"""

import argparse
import sys
from typing import TYPE_CHECKING

from epa_rt.cli.by_hand import RigByHand, add_rig_arguments
from epa_rt.cli.exits import COMPLETED, STOPPED, VerbError
from epa_rt.cli.screen_text import filled
from epa_rt.cli.write import written_to
from epa_rt.cli.zero import UNFINISHED, now, raw_count, who

if TYPE_CHECKING:
    from pathlib import Path

    from epa_rt.config.rig import Zero
    from epa_rt.config.zero_file import ZeroFile


HALF_A_TURN = 0.5  # of the motor: a zero that moved further is at another pulse


def add_arguments(verb: argparse.ArgumentParser) -> None:
    add_rig_arguments(verb)
    verb.add_argument("--yes", action="store_true", help="do not ask before the motor moves")


def main(arguments: argparse.Namespace) -> int:
    by_hand = RigByHand(arguments, with_zero=False)
    zero = by_hand.rig.motor.zero
    if "zero" not in by_hand.rig.motor.model_fields_set:  # 'here' would be a guess
        raise VerbError(
            f"{arguments.rig}: found no motor.zero, expected one that says how and where:"
            " zero: {method: here, at: LENGTH}, or taut_strap, stop or index"
        )
    if not (by_hand.is_sim or arguments.yes or _agreed(by_hand, zero)):
        print("nothing was moved and nothing was set")
        return STOPPED
    return _home(by_hand, zero)


def _agreed(by_hand: RigByHand, zero: "Zero") -> bool:
    from epa_rt.config.rig_homing import index_way

    if not sys.stdin.isatty():
        raise VerbError("found no terminal to ask on, expected --yes")
    moves = "" if zero.method == "here" else "the motor moves and a muscle may be filled: "
    if zero.method == "index":
        way = index_way(by_hand.rig)
        most = f"{1e3 * (way.most + way.landing):.3g} mm"
        moves = f"the drive itself moves the motor, {zero.direction}, {most} at most: "
    where = f"{by_hand.rig.name}: {zero.method}, zero at {1e3 * zero.at:g} mm"
    print(filled(f"{where}: {moves}go on? [y/N] "))
    return sys.stdin.readline().strip().lower() in ("y", "yes")


def _home(by_hand: RigByHand, zero: "Zero") -> int:
    from epa_rt.cli.run import closing_text, exit_code
    from epa_rt.loop.assembly import WiringError
    from epa_rt.loop.by_hand import assemble_homing

    rig, place, scatter, says = by_hand.rig, None, None, []
    wired = rig.drive.interface == "analog"
    entry: dict[str, int] = {}
    try:
        if zero.method != "index" and (wired or zero.method != "here"):
            assembly, homing = assemble_homing(rig, zero)
            summary, result = by_hand.run(assembly)
            print(filled(closing_text(summary, result, rig)))
            code, place = exit_code(summary, result), homing.place
            if code != COMPLETED or place is None:
                print("no zero was set")
                return code
            if homing.touches:
                scatter = homing.scatter
                touches = ", ".join(f"{1e3 * touch:.3f}" for touch in homing.touches)
                says.append(f"touched at {touches} mm: scatter {1e3 * scatter:.3f} mm")
            if wired:
                entry = _wired_entry(by_hand, zero, place, raw_count(rig, assembly.decoder))
                says.append(f"offset {entry['offset']:+d} counts, to be added in every run")
        if not wired:
            code, said = _set_by_drive(by_hand, zero, place)
            if code != COMPLETED:
                print("the zero was NOT set, or could not be read back: home again")
                return code
            says += said
    except WiringError as error:
        raise VerbError(str(error)) from None
    file = _file(by_hand, zero, zero.method, scatter, entry)
    path = _write(by_hand, file)
    print("\n".join((file.facts, *map(filled, says), f"zero file: {path}")))
    return COMPLETED


def _set_by_drive(by_hand: RigByHand, zero: "Zero", place: float | None) -> tuple[int, list[str]]:
    """The drive sets its own count, where it stands or at its index pulse. Gives the exit code, and
    what is to be said of it.
    """
    from epa_rt.cli.run import closing_text, exit_code
    from epa_rt.config.rig_homing import travel_per_motor_turn
    from epa_rt.experiments.homing import SettingZero
    from epa_rt.experiments.index_homing import SeekingIndex
    from epa_rt.loop.by_hand import assemble_index, assemble_setting

    plan: SeekingIndex | SettingZero
    if zero.method == "index":
        assembly, plan = assemble_index(by_hand.rig)
    else:
        assembly, plan = assemble_setting(by_hand.rig, zero, place)
    # until it is read back the drive's own bit may be wrong
    _write(by_hand, _file(by_hand, zero, UNFINISHED, None, {}))
    summary, result = by_hand.run(assembly)
    print(filled(closing_text(summary, result, by_hand.rig)))
    code = exit_code(summary, result)
    if code != COMPLETED:
        return code, []
    says = [f"travel {1e3 * plan.before:.4f} mm became {1e3 * plan.after:.4f} mm"]
    turns = (plan.after - plan.before) / travel_per_motor_turn(by_hand.rig)
    if isinstance(plan, SeekingIndex) and plan.was_referenced and abs(turns) > HALF_A_TURN:
        says.append(
            f"the drive had a zero, and it moved by {turns:+.2f} motor turns: another index pulse"
            " than before, or a strap that slipped"
        )
    return code, says


def _file(
    by_hand: RigByHand, zero: "Zero", method: str, scatter: float | None, entry: dict[str, int]
) -> "ZeroFile":
    from epa_rt.config.zero_file import ZeroFile

    return ZeroFile(
        rig=by_hand.rig.name,
        method=method,
        at=f"{zero.at} m",
        when=now(),
        who=who(),
        drive=_drive(by_hand),
        scatter=None if scatter is None else f"{scatter} m",
        **entry,
    )


def _wired_entry(by_hand: RigByHand, zero: "Zero", place: float, end: int | None) -> dict[str, int]:
    from epa_rt.loop.referenced import position_scaling

    scaling = position_scaling(by_hand.rig)
    offset = round(scaling.to_counts(zero.at)) - round(scaling.to_counts(place))
    return {"offset": offset, "end": end if end is not None else -offset}


def _drive(by_hand: RigByHand) -> str:
    """The drive as the rig file knows it; a simulated one says so."""
    if by_hand.is_sim:
        return "simulated"
    slave = next((s for s in by_hand.rig.slaves if s.device == "EPOS4"), None)
    name = "" if slave is None else f"{slave.device} '{slave.name}'"
    return f"emulated {name}".rstrip() if by_hand.is_emulated else name


def _write(by_hand: RigByHand, file: "ZeroFile") -> "Path":
    from epa_rt.config.zero_file import write_zero, zero_path

    path = zero_path(by_hand.arguments.rig, by_hand.is_emulated)
    if by_hand.is_sim:
        path = by_hand.arguments.out / path.name
    with written_to(path):
        write_zero(path, file)
    return path

"""Move a rig by hand, slowly: inside its limits, and from outside of them back.

Hold an arrow key and the motor moves; let go and it stops within 0.6 s. Up and down fill and vent
a muscle in small steps. After three minutes without a key it ends by itself. It starts where a run
refuses to: beyond a limit of travel, force or pressure, or without a zero of travel. What is
outside may only come back. q ends it as a run ends: the motor stops, the muscles vent, power goes
off.

Without a terminal the same moves are given as options, carried out in their order, or as the lines
of a file (--script): 'move -5 mm at 3 mm/s', 'fill muscle 200 kPa', 'vent', 'wait 1 s'.

  epa jog --rig config/rigs/bench.yaml --speed 1
  epa jog --rig config/rigs/bench.yaml --move "5 mm" --at "3 mm/s" --move "-5 mm" -o out
  epa jog --rig config/rigs/bench.yaml --start-travel "40 mm" --move "-15 mm" -o out
  epa jog --rig config/rigs/bench.yaml --fill muscle "200 kPa" --wait "1 s" --vent -o out
  epa jog --rig config/rigs/bench.yaml --backend ethercat --interface eth1
"""

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from epa_rt.cli.by_hand import RigByHand, add_rig_arguments
from epa_rt.cli.exits import VerbError
from epa_rt.cli.screen_text import filled
from epa_rt.cli.zero import is_unfinished

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.experiments.jogging import Order
    from epa_rt.loop.assembly import Assembly


class _Append(argparse.Action):
    """Puts an order, in words, behind those before it."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        given = [values] if isinstance(values, str) else list(values or ())
        namespace.orders = [*(namespace.orders or ())]
        if self.dest == "at":
            if not namespace.orders or not namespace.orders[-1].startswith("move "):
                parser.error("--at: found no --move before it, expected one")
            namespace.orders[-1] += f" at {given[0]}"
        else:
            namespace.orders.append(" ".join([self.dest, *given]))


def add_arguments(verb: argparse.ArgumentParser) -> None:
    # a distance may begin with a minus and is no option for it
    verb._negative_number_matcher = re.compile(r"^-\.?\d")
    add_rig_arguments(verb)
    verb.set_defaults(orders=None)
    verb.add_argument("--move", action=_Append, metavar="LENGTH", help="by so much, then stop")
    verb.add_argument("--at", action=_Append, metavar="SPEED", help="speed of the --move before")
    verb.add_argument(
        "--fill", action=_Append, nargs=2, metavar=("MUSCLE", "PRESSURE"), help="gauge pressure"
    )
    verb.add_argument(
        "--vent", action=_Append, nargs="?", const="", metavar="MUSCLE", help="without name: all"
    )
    verb.add_argument("--wait", action=_Append, metavar="TIME", help="before the next order")
    verb.add_argument("--script", type=Path, metavar="FILE", help="one order on each line")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.run import closing_text, exit_code
    from epa_rt.experiments.jogging import Keys, Script
    from epa_rt.loop.assembly import WiringError
    from epa_rt.loop.by_hand import assemble_jog

    by_hand = RigByHand(arguments, with_zero=True)
    rig = by_hand.rig
    orders = _orders(arguments, rig)
    if not orders and not sys.stdin.isatty():
        raise VerbError("found no terminal to read keys from, expected --move, --vent or --script")
    keys = Keys()
    try:
        assembly, jog = assemble_jog(rig, Script(orders) if orders else keys, known_zero(by_hand))
    except WiringError as error:
        raise VerbError(str(error)) from None
    if orders and (arguments.quiet or not sys.stderr.isatty()):
        summary, result = by_hand.run(assembly)
    elif orders:
        from epa_rt.cli.keys import ShownRequests

        shown = ShownRequests(rig, jog, assembly.decoder.measured)
        summary, result = by_hand.run(assembly, shown, line=False)
        print(file=sys.stderr)
    else:
        from epa_rt.cli.keys import KeyRequests, raw_keys

        arguments.speed = arguments.speed or 1.0  # a hand needs real time
        print(f"{keys.HELP}\n{_start_words(assembly)}")
        requests = KeyRequests(rig, keys, jog, assembly.decoder.measured)
        with raw_keys():
            summary, result = by_hand.run(assembly, requests, line=False)
    # first, for the words may go to a pipe that is closed
    by_hand.keep_end(assembly.decoder, summary, result, jog.found_zero)
    if keys.idle:
        print(keys.idle)
    print(filled(closing_text(summary, result, rig)))
    return exit_code(summary, result)


def known_zero(by_hand: RigByHand) -> bool:
    """A wired drive's travel is unknown where no file says where it is zero; any drive's, where
    its zero was not set to the end.
    """
    rig = by_hand.rig
    wired = rig.drive.interface == "analog"
    known = rig.applied_zero is not None and rig.applied_zero.end is not None
    return by_hand.is_sim or (known if wired else not is_unfinished(rig))


def _start_words(assembly: "Assembly") -> str:
    speed = assembly.rig.motor.jog_speed_si
    return f"{assembly.rig.name}: the motor moves at {1e3 * speed:g} mm/s"


def _orders(arguments: argparse.Namespace, rig: "Rig") -> "list[Order]":
    """The orders of the options, then those of the file. Raises VerbError."""
    from epa_rt.config.units import UnitError
    from epa_rt.experiments.jogging import parse_order

    lines = [("--", text) for text in arguments.orders or ()]
    if arguments.script is not None:
        try:
            text = arguments.script.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            raise VerbError(f"{arguments.script}: found no UTF-8 text, expected orders") from None
        for number, line in enumerate(text.splitlines(), start=1):
            if words := line.split("#", 1)[0].strip():
                lines.append((f"{arguments.script}:{number}: ", words))
        if not lines:
            raise VerbError(f"{arguments.script}: found no order, expected at least one")
    orders = []
    for where, words in lines:
        try:
            orders.append(parse_order(words, rig))
        except UnitError as error:
            raise VerbError(f"{where}{words}: {error}") from None
    return orders

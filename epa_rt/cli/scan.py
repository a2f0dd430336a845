"""Look at what is on the bus, against what the rig file says.

Slaves are taken to PREOP at most and no output is written. A bus that a master is driving is not
touched; --take-over stops it, for slaves are addressed anew.

  epa scan                                              the only wired interface
  epa scan --interface eth1 --rig config/rigs/bench.yaml

Exit code 0: the bus is as the rig file says (without --rig: there are slaves), 1: it differs, 2: it
cannot be looked at.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.emulated import interface_here
from epa_rt.cli.exits import COMPLETED, DIFFERENT, VerbError
from epa_rt.cli.screen_text import filled

if TYPE_CHECKING:
    from drivers.scan import Seen


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--interface",
        default=interface_here(),
        help="network interface of the bus (default: $EPA_BUS_INTERFACE, else the only wired one)",
    )
    verb.add_argument(
        "--take-over", action="store_true", help="even if another master seems to drive the bus"
    )
    verb.add_argument("--rig", type=Path, help="rig file to compare with (config/rigs/*.yaml)")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.backend import BackendError
    from epa_rt.config.rig import load_rig

    rig = load_rig(arguments.rig) if arguments.rig else None
    from drivers.identity import differences
    from drivers.scan import scan

    try:
        interface, seen = scan(arguments.interface, arguments.take_over, rig.slaves if rig else ())
    except BackendError as error:
        raise VerbError(str(error)) from None
    print(f"{interface}: {len(seen)} slave{'' if len(seen) == 1 else 's'}")
    for line in table(seen):
        print(filled(line))
    if rig is None:
        return COMPLETED if seen else DIFFERENT
    sentences = differences(rig.slaves, [s.found for s in seen])
    for sentence in sentences:
        print(filled(f"differs: {sentence}"))
    if not sentences:
        print(f"the bus is as the rig {rig.name} says")
    return DIFFERENT if sentences else COMPLETED


def table(seen: "Sequence[Seen]") -> list[str]:
    """A row for each slave, then a line on each that is not known here."""
    from drivers.identity import UNKNOWN

    rows = [("", "device", "vendor", "product", "revision", "state", "firmware")] if seen else []
    lines = []
    for position, slave in enumerate(seen, 1):
        f = slave.found
        is_unknown = slave.device.startswith(UNKNOWN)
        device = slave.device.partition(" (")[0]  # the columns beside have what follows
        rows.append(
            (
                str(position),
                "unknown" if is_unknown else device,
                f"0x{f.vendor:08X}",
                f"0x{f.product:08X}",
                f"0x{f.revision:08X}",
                slave.state,
                slave.firmware,
            )
        )
        if is_unknown:
            lines.append(f"  {position} is {device}: see docs/terminals.md, or give --rig")
    widths = [max(len(row[i]) for row in rows) for i in range(7)] if rows else []
    return [
        "  "
        + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ] + lines

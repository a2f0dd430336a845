"""Look at what stands between this machine and a cycle on time: rights, kernel, network card,
clock, cores.

Changes nothing and needs no right; what it cannot see it says. Each line that could be better comes
with why it matters and the command that changes it.

  epa doctor
  epa doctor --interface eth1 --rig config/rigs/bench.yaml

Exit code 0: a bus can be driven, 1: something is in the way, 2: bad input.
"""

import argparse
from pathlib import Path

from epa_rt.cli.emulated import interface_here
from epa_rt.cli.exits import COMPLETED, DIFFERENT, VerbError
from epa_rt.cli.screen_text import filled


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--interface",
        default=interface_here(),
        help="network interface of the bus (default: $EPA_BUS_INTERFACE, else the only wired one)",
    )
    verb.add_argument(
        "--rig", type=Path, help="rig file whose priority and core are wanted (config/rigs/*.yaml)"
    )


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.backend import BackendError
    from epa_rt.config.rig import Realtime, load_rig

    realtime = load_rig(arguments.rig).realtime if arguments.rig else Realtime()
    from drivers.host import BAD, OK, host_findings
    from drivers.nic import card_findings

    try:
        findings = host_findings(realtime.priority, realtime.core) + card_findings(
            arguments.interface, realtime.core
        )
    except BackendError as error:
        raise VerbError(str(error)) from None
    name_width = max(len(f.name) for f in findings)
    status_width = max(len(f.status) for f in findings)
    for f in findings:
        print(filled(f"{f.name:{name_width}}  {f.status:{status_width}}  {f.found}"))
        if f.status != OK:
            for lead, text in (("why", f.why), ("do", f.command)):
                if text:
                    print(filled(f"    {lead}: {text}"))
    return DIFFERENT if any(f.status == BAD for f in findings) else COMPLETED

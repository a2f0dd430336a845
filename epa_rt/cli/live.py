"""Look at a run that is on: state, pressures, force, motion, valves, lateness.

LOG is the log that the run writes, or the folder of it; left out, the only run
that is on. The view is a terminal's; with --foxglove it is Foxglove's, over a
WebSocket. Keys: s stop, S stop at once, m mark, n note, q close the view.
Closing it does not stop the run.

  epa live
  epa live out
  epa live out/knee_chirp-knee-001.mcap --foxglove
"""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, FAILED, VerbError

if TYPE_CHECKING:
    from epa_rt.live.attach import Attached
    from epa_rt.live.start import Views, Wanted

DEFAULT_PORT, LOOPBACK = 8765, "127.0.0.1"


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "log",
        nargs="?",
        type=Path,
        metavar="LOG",
        help="log of a run that is on, or its folder (default: the only run that is on)",
    )
    add_foxglove_arguments(verb)


def add_view_arguments(verb: argparse.ArgumentParser) -> None:
    """The views of a verb that runs a rig."""
    verb.add_argument(
        "--live", action="store_true", help="show the run in this terminal while it is on"
    )
    add_foxglove_arguments(verb)


def add_foxglove_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--foxglove",
        nargs="?",
        type=_port,
        const=DEFAULT_PORT,
        metavar="PORT",
        help="serve the run to Foxglove (default port: 8765; 0: a free one)",
    )
    verb.add_argument(
        "--foxglove-host",
        default=LOOPBACK,
        metavar="ADDRESS",
        help="address to serve on; 0.0.0.0 shows the run to the whole network"
        " (default: %(default)s, this machine alone)",
    )
    verb.add_argument(
        "--foxglove-rate",
        type=_rate,
        metavar="HZ",
        help="serve at most so many cycles a second (default: every cycle)",
    )


def _port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) < 65536):
        raise argparse.ArgumentTypeError(f"found {text}, expected a port from 0 to 65535")
    return int(text)


def _rate(text: str) -> float:
    value = float(text)
    if not 0.1 <= value <= 1e5:
        raise argparse.ArgumentTypeError(f"found {text}, expected a rate from 0.1 to 100000 Hz")
    return value


def views_wanted(arguments: argparse.Namespace, terminal: bool) -> "Wanted":
    """Which views the options ask for."""
    from epa_rt.live.start import Wanted

    return Wanted(terminal, arguments.foxglove, arguments.foxglove_host, arguments.foxglove_rate)


def opened(views: "Views", loop_core: int | None) -> "Views":
    """The views, told to the operator. Raises VerbError where one cannot be had."""
    from epa_rt.live.start import NoView

    try:
        views.open(loop_core)
    except NoView as error:
        raise VerbError(str(error)) from None
    for words in views.words:
        print(words, file=sys.stderr)
    return views


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.live.attach import Attached, NotOn, find

    try:
        if arguments.foxglove is not None:
            return _serve(arguments)
        if not (sys.stdin.isatty() and sys.stderr.isatty()):
            raise VerbError("found no terminal, expected one (--foxglove needs none)")
        with Attached(find(arguments.log)) as attached:
            return _show(attached)
    except NotOn as error:
        raise VerbError(str(error)) from None


def _show(attached: "Attached") -> int:
    from epa_rt.live.terminal import show_run
    from epa_rt.live.watched import WatchedRun

    WatchedRun(attached.facts)  # its rig file cannot be read: said before the screen is taken
    show_run(attached)
    if not attached.is_over:
        print(f"the view is closed, the run goes on: {attached.facts.log}", file=sys.stderr)
    return COMPLETED


def _serve(arguments: argparse.Namespace) -> int:
    """Foxglove's server for a run that is on, until the run ends or Ctrl-C."""
    from epa_rt.live.attach import Attached, find
    from epa_rt.live.start import Views

    with Attached(find(arguments.log)) as attached:
        log = Path(attached.facts.log)
    with Views(views_wanted(arguments, False)) as views:
        opened(views, None)
        views.begin(log)
        print(f"serving {log}; Ctrl-C ends the server, not the run", file=sys.stderr)
        return FAILED if views.served() else COMPLETED

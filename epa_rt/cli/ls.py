"""List the runs in a folder: when, how long, how they ended, who, which file.

Folders are searched to the bottom. Only each log's summary is read, so
thousands take seconds. A file that was cut is listed as damaged, one that is
no log as such; epa info --check compares every checksum. Filters take * and ?.

  epa ls out
  epa ls out --outcome tripped --since '7 d'
  epa ls out --experiment 'identification*' --operator ada --long
  epa ls out --since 2026-11-01 --until 2026-11-30 --json
"""

import argparse
import os
import shutil
import sys
from datetime import UTC, datetime
from pathlib import Path

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.outputs import add_json_argument, is_screen
from epa_rt.cli.write import check_writable, write_whole

SCHEMA = "epa_rt.ls/1"


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "places",
        nargs="*",
        type=Path,
        metavar="FOLDER",
        help="folders with logs, or logs (default: out)",
    )
    verb.add_argument("--rig", default="", help="of this rig")
    verb.add_argument("--experiment", default="", help="of this experiment")
    verb.add_argument(
        "--outcome",
        default="",
        help="that ended so: completed, stopped, tripped, failed, died, unknown, recording,"
        " damaged, 'no log'",
    )
    verb.add_argument("--operator", default="", help="run by this person")
    verb.add_argument(
        "--since", metavar="TIME", help="begun then or later: a date, a date and time, or '7 d'"
    )
    verb.add_argument("--until", metavar="TIME", help="begun before, a date included")
    verb.add_argument("--long", action="store_true", help="also rig, muscles, notes and code")
    add_json_argument(verb, "one object with a list of logs (docs/runs.md)")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.run_end import json_text
    from epa_rt.runs.listing import Filter, as_text, listed

    check_writable(arguments.json, (".json",))
    places = arguments.places or [Path("out")]
    for place in places:
        if not os.path.lexists(place):
            raise VerbError(f"{place}: found nothing there, expected a folder with logs")
    asked = Filter(
        arguments.rig,
        arguments.experiment,
        arguments.outcome,
        arguments.operator,
        _moment("--since", arguments.since),
        _moment("--until", arguments.until, end_of_day=True),
    )
    found = listed(places, asked)
    if arguments.json:
        answer = {"schema": SCHEMA, "logs": [one.as_json() for one in found]}
        write_whole(arguments.json, json_text(answer) + "\n")
    if is_screen(arguments.json):
        return COMPLETED
    if not found:
        print("no log", file=sys.stderr)
        return COMPLETED
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    root = places[0] if len(places) == 1 and places[0].is_dir() else None
    print(as_text(found, root, width, arguments.long))
    return COMPLETED


def _moment(option: str, text: str | None, end_of_day: bool = False) -> datetime | None:
    from epa_rt.runs.listing import moment

    if text is None:
        return None
    try:
        return moment(text, datetime.now(UTC), end_of_day)
    except (ValueError, OverflowError):
        raise VerbError(
            f"{option}: found {text!r:.60}, expected a date as 2026-01-31, a time as"
            " '2026-01-31 12:00', or how long ago: '30 min', '12 h', '7 d', '4 w'"
        ) from None

"""Compare two runs by phase: what differs by more than noise, and since when.

Noise is estimated from the two logs; what the valves leave open by their
tolerance is allowed as well (docs/runs.md). Exit code 0: nothing differs,
1: something does.

  epa compare out/a.mcap out/b.mcap
  epa compare out/a.mcap out/b.mcap --html compare.html --json compare.json
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, DIFFERENT, VerbError
from epa_rt.cli.outputs import add_html_argument, add_json_argument
from epa_rt.cli.write import check_writable, write_whole

if TYPE_CHECKING:
    from epa_rt.report.run import Run


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("a", type=Path, metavar="A", help="log of the run to compare with")
    verb.add_argument("b", type=Path, metavar="B", help="log of the other run")
    add_html_argument(verb)
    add_json_argument(verb)


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.run_end import json_text
    from epa_rt.logs.plain_text import plain
    from epa_rt.logs.reader import LogError
    from epa_rt.report.run import load_run
    from epa_rt.runs.compare import NothingInCommon, compare
    from epa_rt.runs.compare_page import compare_page
    from epa_rt.runs.compare_words import as_text

    check_writable(arguments.html, (".html", ".htm"))
    check_writable(arguments.json, (".json",))
    try:
        found = compare(*_named_apart(load_run(arguments.a), load_run(arguments.b), arguments))
    except (LogError, NothingInCommon) as error:
        raise VerbError(str(error)) from None
    print(plain(as_text(found)))
    if arguments.json:
        write_whole(arguments.json, json_text(found.as_json()) + "\n")
    if arguments.html:
        write_whole(arguments.html, compare_page(found))
    for path in filter(None, (arguments.json, arguments.html)):
        print(path)
    return DIFFERENT if found.is_different else COMPLETED


def _named_apart(a: "Run", b: "Run", arguments: argparse.Namespace) -> "tuple[Run, Run]":
    """Logs of one file name are told apart by their folders."""
    if a.name != b.name:
        return a, b
    paths = (arguments.a.resolve(), arguments.b.resolve())
    names = [f"{path.parent.name}/{path.name}" for path in paths]
    return replace(a, name=names[0]), replace(b, name=names[1])

"""Say where a gap lies, block by block, and where it may come from, without asking for its cause:
quicker than a diagnosis.

  epa gap localise --rig config/rigs/bench.yaml out/*.mcap
  epa gap localise --rig config/rigs/bench.yaml out/*.mcap --json where.json --html where.html
"""

import argparse
import json
from dataclasses import asdict
from os.path import normpath
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED
from epa_rt.cli.gap.fits import check_judged
from epa_rt.cli.gap.inputs import Opened, add_log_arguments, add_rig_arguments, opened, task_parser
from epa_rt.cli.outputs import add_html_argument, add_json_argument
from epa_rt.cli.progress import progress_shown
from epa_rt.cli.write import check_writable, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from rich.console import Console

    from epa_rt.gap.diagnosis import Origin
    from epa_rt.gap.report.where_page import Located


def add_parser(tasks: "argparse._SubParsersAction") -> None:
    parser = task_parser(tasks, "localise", __doc__)
    add_rig_arguments(parser)
    add_log_arguments(parser)
    add_html_argument(parser, "write the map as a page")
    add_json_argument(parser, "what was found for machines")
    parser.add_argument(
        "--as-is",
        action="store_true",
        help=(
            "hold the plant file as it stands against the logs (default: nominal parameters"
            " refitted first)"
        ),
    )


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.gap.report.terminal import console, show_found
    from epa_rt.gap.report.where_page import where_page

    check_writable(arguments.json, (".json",))
    check_writable(arguments.html, (".html", ".htm"))
    given, out = opened(arguments), console()
    show_found(given.found, out)
    with progress_shown(arguments.quiet) as progress:
        found = _located(given, arguments, progress)
    _show(found, out)
    if arguments.json:
        write_whole(arguments.json, _document(found))
    if arguments.html:
        write_whole(arguments.html, where_page(found))
    for path in (arguments.json, arguments.html):
        if path is not None:
            out.print(str(path))
    return COMPLETED


def _located(
    given: Opened, arguments: argparse.Namespace, progress: "Callable[[str, float], None]"
) -> "Located":
    from epa_rt.gap.likelihood.floor import floors
    from epa_rt.gap.likelihood.ground import ground_of
    from epa_rt.gap.likelihood.problem import Problem
    from epa_rt.gap.likelihood.start import at_base
    from epa_rt.gap.report.where_page import Located
    from epa_rt.gap.where.localise import localise
    from epa_rt.gap.where.origin import SURE, origin_first, origins
    from epa_rt.gap.where.run_freely import localise_freely

    values: dict[str, float] = {}
    whence: tuple[Origin, ...] = ()
    if arguments.as_is:
        progress("noise floor", 0.0)
        problem = Problem(
            given.subject, given.recordings, floors(given.subject, given.recordings, {})
        )
    else:
        problem, base, _ = at_base(
            given.subject,
            given.recordings,
            progress=lambda stage, share: progress(stage, 4.0 * share),
        )
        values = base.values
    progress("where", 0.8)
    places = localise(given.subject, problem.prepared, values, problem.floors)
    check_judged(places, given.subject)
    if not arguments.as_is and any(place.significance > SURE for place in places):
        progress("where it comes from", 0.9)
        whence = origins(problem, values)
    progress("free run", 0.95)
    ground = None if arguments.as_is else ground_of(problem, values)
    freely = localise_freely(
        given.subject, given.recordings, ground.none.values if ground else values, problem.prepared
    )
    inputs = {
        "rig": str(arguments.rig),
        "plant": normpath(given.plant or arguments.plant or given.subject.rig.plant),
        "logs": list(map(str, arguments.logs)),
    }
    return Located(
        given.found, origin_first(places, whence), tuple(freely), whence, inputs, arguments.as_is
    )


def _show(found: "Located", out: "Console") -> None:
    from epa_rt.gap.report.origin import origin_words
    from epa_rt.gap.report.terminal import show_location

    show_location(found.location, out)
    if words := origin_words(found.origins):
        out.print(words)
    if found.free_run_location:
        out.print("The whole plant run from its commands alone:")
        show_location(found.free_run_location, out)


def _document(found: "Located") -> str:
    from epa_rt.gap.report.as_json import finite

    rows = {
        name: [asdict(one) for one in getattr(found, name)]
        for name in ("location", "free_run_location", "origins")
    }
    return (
        json.dumps(
            finite({"found_first": found.found_first, **rows}),
            indent=2,
            ensure_ascii=False,
            allow_nan=False,
        )
        + "\n"
    )

"""Say where a gap lies, block by block, and where it may come from, without asking for its cause: quicker than a diagnosis.

  epa gap localise --rig config/rigs/bench.yaml out/*.mcap
  epa gap localise --rig config/rigs/bench.yaml out/*.mcap --json where.json
"""

import argparse
import json
from dataclasses import asdict
from pathlib import Path

from epa_rt.cli.exits import COMPLETED
from epa_rt.cli.gap_fits import check_judged
from epa_rt.cli.gap_inputs import add_log_arguments, add_rig_arguments, opened, task_parser
from epa_rt.cli.progress import progress_shown
from epa_rt.cli.write import check_writable, write_whole


def add_parser(tasks: "argparse._SubParsersAction") -> None:
    parser = task_parser(tasks, "localise", __doc__)
    add_rig_arguments(parser)
    add_log_arguments(parser)
    parser.add_argument("--json", type=Path, metavar="JSON", help="write what was found")
    parser.add_argument("--as-is", action="store_true", help="hold the plant file as it stands against the logs (default: nominal parameters refitted first)")


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.gap.attribution import at_base
    from epa_rt.gap.diagnosis import Origin
    from epa_rt.gap.floor import floors
    from epa_rt.gap.ground import ground_of
    from epa_rt.gap.localise import localise
    from epa_rt.gap.origin import SURE, origin_first, origins
    from epa_rt.gap.problem import Problem
    from epa_rt.gap.report.as_json import finite
    from epa_rt.gap.report.origin import origin_words
    from epa_rt.gap.report.terminal import console, show_found, show_location
    from epa_rt.gap.run_freely import localise_freely

    check_writable(arguments.json, (".json",))
    given, out = opened(arguments), console()
    show_found(given.found, out)
    with progress_shown(arguments.quiet) as progress:
        values: dict[str, float] = {}
        whence: tuple[Origin, ...] = ()
        if arguments.as_is:
            progress("noise floor", 0.0)
            problem = Problem(given.subject, given.recordings, floors(given.subject, given.recordings, {}))
        else:
            problem, base, _ = at_base(given.subject, given.recordings, progress=lambda stage, share: progress(stage, 4.0 * share))
            values = base.values
        progress("where", 0.8)
        places = localise(given.subject, problem.prepared, values, problem.floors)
        check_judged(places, given.subject)
        if not arguments.as_is and any(place.significance > SURE for place in places):
            progress("where it comes from", 0.9)
            whence = origins(problem, values)
        progress("free run", 0.95)
        ground = None if arguments.as_is else ground_of(problem, values)
        freely = localise_freely(given.subject, given.recordings, ground.none.values if ground else values, problem.prepared)
    location = origin_first(places, whence)
    show_location(location, out)
    if words := origin_words(whence):
        out.print(words)
    if freely:
        out.print("The whole plant run from its commands alone:")
        show_location(freely, out)
    if arguments.json:
        document = {"found_first": given.found, "location": [asdict(place) for place in location], "free_run_location": [asdict(place) for place in freely], "origins": [asdict(one) for one in whence]}
        write_whole(arguments.json, json.dumps(finite(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    return COMPLETED

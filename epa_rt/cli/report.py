"""Write one HTML page about each run: what was asked, what happened, tracking, pressures, energy,
timing, events.

The page carries everything that it needs, so it opens without a network and can be sent to
somebody. A log that was cut, or whose run tripped, gives a page too; it says what is missing, and
the cause first.

  epa report out/knee_chirp-knee-001.mcap
  epa report out/*.mcap                      one page beside each log
  epa report out/knee_chirp-knee-001.mcap --html page.html
"""

import argparse
from pathlib import Path

from epa_rt.cli.damage import say_damage
from epa_rt.cli.exits import VerbError
from epa_rt.cli.outputs import add_html_argument, add_old_spelling
from epa_rt.cli.write import write_whole


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("logs", nargs="+", type=Path, metavar="LOG", help="logs of runs (*.mcap)")
    add_html_argument(verb, "page to write, of one log (default: beside each log, as .html)")
    add_old_spelling(verb, "-o", "--out", now="--html", dest="html")


def main(arguments: argparse.Namespace) -> int:
    out = arguments.html
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise VerbError(f"{out}: found the ending '{out.suffix}', expected .html")
    if out is not None and len(arguments.logs) > 1:
        raise VerbError(
            f"found --html beside {len(arguments.logs)} logs, expected it with one: without it each"
            " page goes beside its log"
        )
    return max(_written(log, out or log.with_suffix(".html")) for log in arguments.logs)


def _written(log: Path, out: Path) -> int:
    """Writes the page of one log, and says what it lacks. Raises VerbError."""
    from epa_rt.logs.reader import LogError
    from epa_rt.report.page import run_page
    from epa_rt.report.run import load_run

    try:
        run = load_run(log)
    except LogError as error:
        raise VerbError(str(error)) from None
    write_whole(out, run_page(run, winding_ohm(run.attachments)))
    code = say_damage(log, run.missing)
    print(f"{out} ({out.stat().st_size / 1e6:.1f} MB)")
    return code


def winding_ohm(attachments: dict[str, bytes]) -> float | None:
    """The winding's resistance of the plant that a log carries; None where it carries none that can
    be read.
    """
    from epa_rt.cli.inputs import PLANT
    from epa_rt.config.source import ConfigError, parse_yaml
    from epa_rt.models.plant_file import read_plant

    if PLANT not in attachments:
        return None
    try:
        plant = read_plant(parse_yaml(attachments[PLANT].decode("utf-8", "replace"), PLANT))
    except ConfigError:
        return None
    return float(plant.params["drive"]["winding_ohm"][0])

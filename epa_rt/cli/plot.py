"""Draw signals of a log over time: a quick look, grouped by unit, phases shaded.

Without names it draws the most telling ones. Names may hold * and ? (quote them from the shell);
what can be drawn is said when a name fits nothing. The picture is one HTML page that opens without
a network.

  epa plot out/knee_chirp-knee-001.mcap
  epa plot out/knee_chirp-knee-001.mcap knee_angle_rad ref_knee_angle_rad --from 10 --to 20
  epa plot out/knee_chirp-knee-001.mcap '*_pressure_pa' 'cmd_*_open' --html valves.html
"""

import argparse
from pathlib import Path

from epa_rt.cli.damage import say_damage
from epa_rt.cli.exits import VerbError
from epa_rt.cli.outputs import add_html_argument, add_old_spelling
from epa_rt.cli.write import write_whole


def add_arguments(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("log", type=Path, metavar="LOG", help="log of a run (*.mcap)")
    verb.add_argument(
        "signals",
        nargs="*",
        metavar="SIGNAL",
        help="names or patterns (default: the most telling ones)",
    )
    verb.add_argument(
        "--from",
        dest="begin_s",
        type=float,
        metavar="S",
        help="begin of the stretch, in s of the run",
    )
    verb.add_argument(
        "--to", dest="end_s", type=float, metavar="S", help="end of the stretch, in s of the run"
    )
    add_html_argument(verb, "page to write (default: beside the log, as -plot.html)")
    add_old_spelling(verb, "-o", "--out", now="--html", dest="html")


def main(arguments: argparse.Namespace) -> int:
    from epa_rt.logs.reader import LogError
    from epa_rt.report.plot import chosen_signals, plot_page, samples_between
    from epa_rt.report.run import NotShown, load_run

    log = arguments.log
    out = arguments.html
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise VerbError(
            f"{out}: found the ending '{out.suffix}', expected .html (a picture file would need a"
            " browser that epa does not bring; print the page from yours)"
        )
    try:
        run = load_run(log)
        text = plot_page(
            run,
            chosen_signals(run, arguments.signals),
            samples_between(run, arguments.begin_s, arguments.end_s),
        )
    except LogError as error:
        raise VerbError(str(error)) from None
    except NotShown as error:
        raise VerbError(f"{log}: {error}") from None
    out = out or log.with_name(f"{log.stem}-plot.html")
    write_whole(out, text)
    code = say_damage(arguments.log, run.missing)
    print(f"{out} ({out.stat().st_size / 1e6:.1f} MB)")
    return code

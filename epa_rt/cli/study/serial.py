"""The serial actuator over pressure and frequency (Figs 5 to 8), and the rule that says which
pressure is best.

Results are kept per point in --store: a run that was interrupted goes on where it was.

  epa study serial config/studies/serial.yaml --html serial.html --pictures pictures
  epa study serial config/studies/serial_mass_rig.yaml -o rule.yaml --goal power
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.outputs import add_old_spelling
from epa_rt.cli.parser import summary
from epa_rt.cli.screen_text import filled
from epa_rt.cli.study.grid import (
    add_grid_arguments,
    check_grid_arguments,
    grid_progress,
    how,
    write_answers,
)

if TYPE_CHECKING:
    from epa_rt.study.claims import Claim
    from epa_rt.study.serial import Maps

GOALS = ("stroke", "power", "energy")


def add_parser(tasks: argparse._SubParsersAction) -> None:
    parser = tasks.add_parser(
        "serial",
        help=summary(__doc__),
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_grid_arguments(parser)
    parser.add_argument(
        "-o",
        "--out",
        dest="rule",
        type=Path,
        metavar="RULE.yaml",
        help="write the best pressure over frequency, for epa study rule",
    )
    add_old_spelling(parser, "--rule", now="-o", dest="rule")
    parser.add_argument(
        "--goal",
        choices=GOALS,
        default="stroke",
        help="what the rule makes least (default: %(default)s)",
    )
    parser.add_argument(
        "--no-beside", action="store_true", help="leave out the plants beside it (eq. 8)"
    )


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.write import check_own, check_writable, write_whole
    from epa_rt.study.claims import serial_claims
    from epa_rt.study.report.serial import serial_figures, serial_page
    from epa_rt.study.rule import rule_of, rule_text
    from epa_rt.study.serial import load_serial, solve

    check_grid_arguments(arguments)
    check_writable(arguments.rule, (".yaml", ".yml"))
    check_own(arguments.rule, "epa study serial")
    asked = load_serial(arguments.study)
    with grid_progress(arguments.quiet) as progress:
        maps = solve(asked, arguments.store, how(arguments), progress)
        plants = () if arguments.no_beside else asked.beside
        beside = {
            plant.name: solve(asked, arguments.store, how(arguments), progress, plant)
            for plant in plants
        }
    claims = serial_claims(maps, beside)
    _show(maps, claims)
    written: list[Path] = []
    if arguments.rule:
        rule = rule_of(maps, arguments.goal)
        if not rule.frequency_rad_s.size:
            raise VerbError(
                f"{arguments.study}: found no point that follows the sine, expected one at least"
                " for a rule"
            )
        write_whole(arguments.rule, rule_text(rule, asked.plant.name))
        written.append(arguments.rule)
    figures = serial_figures(maps, beside) if arguments.html or arguments.pictures else {}
    page = serial_page(maps, beside, claims, figures) if arguments.html else None
    written += write_answers(arguments, _answer(maps, beside, claims), page, figures)
    for path in written:
        print(path)
    return COMPLETED


def _show(maps: "Maps", claims: "list[Claim]") -> None:
    print(" rad/s  best kPa abs (stroke, power)  stroke cm  motion cm  peak |Fv| W  tension N")
    columns = [
        maps.best_pressure_pa("stroke_m") / 1e3,
        maps.best_pressure_pa("peak_power_w") / 1e3,
    ] + [
        maps.at_best("stroke_m", name) * factor
        for name, factor in (
            ("stroke_m", 100),
            ("motion_m", 100),
            ("peak_power_w", 1),
            ("tension_low_n", 1),
            ("tension_high_n", 1),
        )
    ]
    for omega, *row in zip(maps.asked.frequency_rad_s, *columns, strict=True):
        print(
            "{:6.1f}  {:12.0f} {:12.0f}     {:10.2f} {:10.2f} {:12.1f}  {:4.0f} to {:.0f}".format(
                omega, *row
            )
        )
    for claim in claims:
        print(filled(f"{claim.verdict}: {claim.claim}: {claim.ours}"))


def _answer(maps: "Maps", beside: "dict[str, Maps]", claims: "list[Claim]") -> dict:
    asked = maps.asked
    return {
        "study": "serial",
        "plant": asked.plant.name,
        "pressure_pa": asked.pressure_pa,
        "frequency_rad_s": asked.frequency_rad_s,
        "amplitude_m": asked.amplitude_m,
        "mean_m": asked.mean_m,
        "maps": maps.of,
        "best_pressure_pa": {
            goal: maps.best_pressure_pa(goal)
            for goal in ("stroke_m", "peak_power_w", "energy_a2_s")
        },
        "beside": {name: one.of for name, one in beside.items()},
        "claims": [claim.as_dict() for claim in claims],
    }

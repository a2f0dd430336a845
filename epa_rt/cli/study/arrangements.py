"""One motor and its muscles in four wirings: serial, parallel, both, antagonistic; what the motor
has to do in each.

  epa study arrangements config/studies/arrangements.yaml --html arrangements.html
"""

import argparse
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED
from epa_rt.cli.parser import summary
from epa_rt.cli.study.grid import (
    add_grid_arguments,
    check_grid_arguments,
    grid_progress,
    how,
    write_answers,
)

if TYPE_CHECKING:
    from epa_rt.study.arrangements import Compared


def add_parser(tasks: argparse._SubParsersAction) -> None:
    parser = tasks.add_parser(
        "arrangements",
        help=summary(__doc__),
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_grid_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.study.arrangements import compare, load_arrangements
    from epa_rt.study.report.arrangements import arrangements_figures, arrangements_page

    check_grid_arguments(arguments)
    asked = load_arrangements(arguments.study)
    with grid_progress(arguments.quiet) as progress:
        found = compare(asked, arguments.store, how(arguments), progress)
    _show(found)
    figures = arrangements_figures(found) if arguments.html or arguments.pictures else {}
    page = arrangements_page(found, figures) if arguments.html else None
    for path in write_answers(arguments, _answer(found), page, figures):
        print(path)
    return COMPLETED


def _show(found: "Compared") -> None:
    from epa_rt.study.arrangements import GOALS, NAMES_OF
    from epa_rt.study.report.arrangements import UNITS, said

    for goal, words in GOALS.items():
        factor, unit = UNITS[goal]
        print(f"least {words} ({unit}), at pressures of muscle 0 and 1 (kPa abs)")
        least = {name: found.least(name, goal) for name in NAMES_OF}
        print(" rad/s  " + "".join(f"{name:18s}" for name in NAMES_OF).rstrip())
        for k, omega in enumerate(found.asked.frequency_rad_s):
            row = "".join(f"{said(least[name][k], factor):18s}" for name in NAMES_OF)
            print(f"{omega:6.1f}  {row}".rstrip())


def _answer(found: "Compared") -> dict:
    from epa_rt.study.arrangements import GOALS, NAMES_OF

    return {
        "study": "arrangements",
        "plant": found.asked.plant.name,
        "pressure_pa": found.asked.pressure_pa,
        "frequency_rad_s": found.asked.frequency_rad_s,
        "least": {name: {goal: found.least(name, goal) for goal in GOALS} for name in NAMES_OF},
        "maps": found.of,
    }

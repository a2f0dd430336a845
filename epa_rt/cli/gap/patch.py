"""Write the plant file that has everything a diagnosis found.

epa gap patch gap.json --rig config/rigs/bench.yaml -o config/plants/bench_patched.yaml
"""

import argparse
from pathlib import Path

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.gap.fits import check_spares
from epa_rt.cli.gap.inputs import add_rig_arguments, catalogue_command, open_rig, task_parser
from epa_rt.cli.write import check_own, check_writable, write_whole


def add_parser(tasks: "argparse._SubParsersAction") -> None:
    parser = task_parser(tasks, "patch", __doc__)
    parser.add_argument(
        "diagnosis", type=Path, metavar="JSON", help="what epa gap diagnose --json wrote"
    )
    add_rig_arguments(parser)
    parser.add_argument(
        "-o", "--out", type=Path, metavar="PLANT.yaml", required=True, help="plant file to write"
    )


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.gap.answer.patch import (
        PATCHED_BY,
        PatchError,
        check_names,
        check_plant,
        check_values,
        load_diagnosis,
        patched_text,
        values_of,
    )
    from epa_rt.gap.rig.subjects import named_plant

    check_writable(arguments.out, (".yaml", ".yml"))
    subject, rig, plant = open_rig(arguments.rig, arguments.plant)
    if plant is not None and arguments.out.exists() and arguments.out.samefile(plant):
        raise VerbError(
            f"{arguments.out}: found the plant file that was diagnosed, expected another name (it"
            " stays as it is)"
        )
    check_spares(arguments.out, (arguments.rig, arguments.diagnosis, named_plant(arguments.rig)))
    check_own(arguments.out, PATCHED_BY)
    try:
        diagnosis = load_diagnosis(arguments.diagnosis)
    except PatchError as error:
        raise VerbError(str(error)) from None
    try:
        values, effects = values_of(diagnosis, subject)
        check_names(diagnosis, subject, catalogue_command(subject, rig))
        check_values(values, subject)
        check_plant(diagnosis, values, subject)
        text = patched_text(diagnosis, subject)
    except PatchError as error:
        raise VerbError(f"{arguments.diagnosis}: {error}") from None
    if not values:
        raise VerbError(
            f"{arguments.diagnosis}: found a diagnosis that moved no parameter"
            f" ({diagnosis.verdict}), expected one that did"
        )
    write_whole(arguments.out, text)
    print(f"{arguments.out}: {', '.join(effects) or 'no effect'}, {len(values)} parameters")
    return COMPLETED

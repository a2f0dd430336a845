"""Propose the experiment that would tell apart what a diagnosis could not, as a file that epa run
takes.

Every experiment of the menu is run on the simulated rig, once with each of the rival answers, and
the one that sets them furthest apart is proposed. For a servo of others the file holds the
commanded profile, for whatever drives it; other kinds of theirs have no menu.

  epa gap plan gap.json --rig config/rigs/bench.yaml out/*.mcap -o next.yaml
  epa run next.yaml --rig config/rigs/bench.yaml -o out
"""

import argparse
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, VerbError
from epa_rt.cli.gap.fits import check_spares
from epa_rt.cli.gap.inputs import (
    Opened,
    add_log_arguments,
    add_rig_arguments,
    catalogue_command,
    opened,
    task_parser,
)
from epa_rt.cli.progress import progress_shown
from epa_rt.cli.write import check_own, check_writable, write_whole

if TYPE_CHECKING:
    from collections.abc import Callable

    from epa_rt.gap.diagnosis import Diagnosis, NextExperiment


def add_parser(tasks: "argparse._SubParsersAction") -> None:
    parser = task_parser(tasks, "plan", __doc__)
    parser.add_argument(
        "diagnosis", type=Path, metavar="JSON", help="what epa gap diagnose --json wrote"
    )
    add_rig_arguments(parser)
    add_log_arguments(parser)
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        metavar="EXPERIMENT.yaml",
        help="experiment file to write (default: print it, and what is said of it on stderr)",
    )


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.gap.answer.patch import PatchError, check_names, check_rig, load_diagnosis
    from epa_rt.gap.next.rivals import sets_apart
    from epa_rt.gap.rig.subjects import named_plant

    check_writable(arguments.out, (".yaml", ".yml"))
    says = (
        sys.stdout if arguments.out else sys.stderr
    )  # what is printed for epa run to read is the file and nothing else
    try:
        diagnosis = load_diagnosis(arguments.diagnosis)
    except PatchError as error:
        raise VerbError(str(error)) from None
    given = opened(arguments)
    check_spares(arguments.out, (arguments.rig, given.plant, named_plant(arguments.rig)))
    check_own(arguments.out, "epa gap plan")
    try:
        check_rig(diagnosis, given.subject)
        check_names(diagnosis, given.subject, catalogue_command(given.subject, given.rig))
    except PatchError as error:
        raise VerbError(f"{arguments.diagnosis}: {error}") from None
    if given.rig is None and not given.subject.menu():
        from epa_rt.gap.rig.foreign.kinds import KINDS

        kinds = ", ".join(kind for kind, component in KINDS.items() if component.menu)
        raise VerbError(
            f"{arguments.rig}: found a rig without a menu of experiments, expected one of this"
            f" house, or of the kind {kinds}"
        )
    if len(sets_apart(diagnosis, given.subject, within_family=True)) < 2:
        stays = (
            f"; {arguments.out} is not written"
            + (", and what stands there is older" if arguments.out.exists() else "")
            if arguments.out
            else ""
        )
        print(
            "nothing to tell apart: the diagnosis names no effect that these logs could not"
            f" separate from another{stays}",
            file=says,
        )
        return COMPLETED
    with progress_shown(arguments.quiet) as progress:
        plan = planned(given, diagnosis, progress, within_family=True)
    if plan is None:
        raise VerbError(
            f"{arguments.rig}: found no experiment of the menu that the simulated rig completes"
            " with each of the rival answers, expected one at least"
        )
    if arguments.out is None:
        print(plan.file)
    else:
        write_whole(arguments.out, plan.file)
    print(f"{arguments.out or plan.name}: {plan.says}", file=says)
    return COMPLETED


def planned(
    given: Opened,
    diagnosis: "Diagnosis",
    progress: "Callable[[str, float], None]",
    within_family: bool = False,
) -> "NextExperiment | None":
    """The next experiment; None where nothing is to be told apart, or none of the menu can be run.

    ``progress``: stage and share, 0 to 1. Raises VerbError where the log lacks what a run needs or
    a run cannot be recorded.
    """
    from epa_rt.cli.gap.simulate import Simulator
    from epa_rt.gap.next.plan import next_experiment
    from epa_rt.gap.next.rivals import answers, distance_between, sets_apart
    from epa_rt.gap.rig.menu import menu

    if len(sets_apart(diagnosis, given.subject, within_family)) < 2 or (
        given.rig is None and not given.subject.menu()
    ):
        return None
    subject = given.subject
    found = answers(
        subject,
        given.recordings,
        diagnosis,
        within_family,
        progress=lambda stage, share: progress(stage, 0.2 * share),
    )
    if given.rig is None:
        from epa_rt.gap.rig.foreign.next import items, simulated

        return next_experiment(
            found.rivals,
            items(given.subject),
            lambda item, plant: simulated(given.subject, item, plant, given.recordings[0]),
            distance_between(subject, found),
            lambda stage, share: progress(stage, 0.2 + 0.8 * share),
        )
    with (
        tempfile.TemporaryDirectory(prefix="epa-gap-") as folder,
        Simulator(Path(folder)) as simulator,
    ):
        return next_experiment(
            found.rivals,
            menu(given.rig),
            lambda item, plant: simulator.new(item, plant, given.recordings[0]),
            distance_between(subject, found),
            lambda stage, share: progress(stage, 0.2 + 0.8 * share),
        )

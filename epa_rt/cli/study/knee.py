"""The knee's energy over serial and parallel pressure (Fig. 9) through the loop, and the catalogue
that the paper calls for.

The conditions run on the simulated rig as 'epa run' would run them; the catalogue runs on the
compiled plant. Results are kept in --store: a run that was interrupted goes on where it was.
--cluster serves the catalogue only.

  epa study knee config/studies/knee.yaml --html knee.html --pictures pictures
"""

import argparse
from typing import TYPE_CHECKING

from epa_rt.cli.exits import COMPLETED, VerbError
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
    from epa_rt.study.knee_study import Catalogue, Conditions


def add_parser(tasks: argparse._SubParsersAction) -> None:
    parser = tasks.add_parser(
        "knee",
        help=summary(__doc__),
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_grid_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.study.condition import run_condition
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import load_yaml, named_file
    from epa_rt.models.plant_file import load_plant
    from epa_rt.study.grid import LOOP_ROOMS, code_digest
    from epa_rt.study.knee import load_knee
    from epa_rt.study.knee_claims import catalogue_claims, equal_motion_claims, knee_claims
    from epa_rt.study.knee_study import run_catalogue, run_conditions, run_equal_motion
    from epa_rt.study.report.knee import catalogue_figures, knee_page, saved_figure, swing_figure

    check_grid_arguments(arguments)
    asked = load_knee(arguments.study)
    rig = load_yaml(asked.rig)
    plant_path = named_file(rig, ("plant",), asked.rig.parent / rig_from(rig).plant)
    params = load_plant(plant_path).params
    if params["load"]["kind_code"][0] != 2.0:
        raise VerbError(
            f"{plant_path}: found a plant whose load is no knee, expected load: kind_code: 2"
        )
    version = b"\0".join(
        [asked.rig.read_bytes(), plant_path.read_bytes(), code_digest(LOOP_ROOMS).encode()]
    )
    with grid_progress(arguments.quiet) as progress:
        found = run_conditions(
            asked, run_condition, version, arguments.store, arguments.jobs, progress
        )
        catalogue = run_catalogue(asked, params, arguments.store, how(arguments), progress)
        equal = run_equal_motion(asked, params, how(arguments))
    claims = [*knee_claims(found), *equal_motion_claims(equal), *catalogue_claims(catalogue)]
    _show(found, claims)
    figures = {}
    if arguments.html or arguments.pictures:
        figures = {
            "knee_saved": saved_figure(found),
            "knee_swing": swing_figure(found),
            **catalogue_figures(catalogue),
        }
    page = knee_page(found, catalogue, claims, figures) if arguments.html else None
    for path in write_answers(arguments, _answer(found, catalogue, claims), page, figures):
        print(path)
    return COMPLETED


def _show(found: "Conditions", claims: "list[Claim]") -> None:
    from epa_rt.study.knee import NONE
    from epa_rt.study.report.knee import kpa

    print("SPAM      PPAM      I2 over the chirp  saved %     achieved swing %")
    for s, p in found.asked.conditions:
        swing = 100.0 * found.swing(s, p)[1]
        saved = 100.0 * found.saved(s, p)[1] if p != NONE else None
        span = "" if saved is None else f"{saved.min():.0f} to {saved.max():.0f}"
        print(
            f"{kpa(s):9s} {kpa(p):9s} {found.of[s, p].energy_a2_s.sum():17.1f}  {span:10s} "
            f" {swing.min():.0f} to {swing.max():.0f}"
        )
    for claim in claims:
        print(filled(f"{claim.verdict}: {claim.claim}: {claim.ours}"))


def _answer(found: "Conditions", catalogue: "Catalogue", claims: "list[Claim]") -> dict:
    asked = found.asked
    conditions = [
        {
            "spam_pa": s,
            "ppam_pa": p or None,
            "hz": one.hz,
            "energy_a2_s": one.energy_a2_s,
            "swing_rad": one.swing_rad,
            "peak_current_a": one.peak_current_a,
        }
        for (s, p), one in found.of.items()
    ]
    spam, ppam, fixed = catalogue.fixed()
    return {
        "study": "knee",
        "conditions": conditions,
        "claims": [claim.as_dict() for claim in claims],
        "catalogue": {
            "spam_pa": asked.catalogue_spam_pa,
            "ppam_pa": asked.catalogue_ppam_pa,
            "frequency_rad_s": asked.catalogue_rad_s,
            "maps": catalogue.of,
            "best": catalogue.best(),
            "fixed": {"spam_pa": spam, "ppam_pa": ppam, "mean_i2_a2": fixed},
        },
    }

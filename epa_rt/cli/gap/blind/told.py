"""An oracle's beginning: a case's logs ready to be fitted, the true law, what it may be taken for,
and the fits of nothing and of the truth.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from sim_backend.stand_in.fitted import Fitted, Fitting, Law

NEAREST = 5  # rivals that are fitted
WEAK = {
    True: 0.1,
    False: 0.3,
}  # of a typical strength, where rivals begin: weaker where either sign may be right


class Told(NamedTuple):
    """``nothing`` and ``own``: fits of no law and of the true one; ``rivals``: laws that it may be
    taken for; ``z``: nominal parameters where no law is, in spreads.
    """

    fitting: "Fitting"
    nothing: "Fitted"
    own: "Fitted"
    rivals: "list[Law]"
    z: "np.ndarray"


def told_the_law(folder: Path, truth: dict) -> Told:
    """The case with the truth fitted twice, from where nothing was and from the true nominal
    parameters: the better fit counts.
    """
    from sim_backend.stand_in.fitted import Law

    fitting = fitting_of(folder, truth)
    own, rivals = true_laws(truth)
    nothing = fitting.fit(Law((), (), truth["same_law"]))
    z = fitting.last
    best = min(
        (fitting.fit(own, z), fitting.fit(own, fitting.spreads_of(truth["nominal"]))),
        key=lambda fit: fit.chi,
    )
    return Told(fitting, nothing, best, rivals, z)


def chi_of(nothing: "Fitted", *fits: "Fitted") -> list[list]:
    """Names and chi-square of every fit, as an answer of an oracle keeps them."""
    return [["nothing", nothing.chi], *([" + ".join(fit.law.effects), fit.chi] for fit in fits)]


def weak_law(name: str) -> "Law":
    """A law of the stand-in from where a rival begins."""
    from sim_backend.stand_in.effects import BY_NAME
    from sim_backend.stand_in.fitted import law_of

    return law_of(name, share=WEAK[BY_NAME[name].either_sign])


def fitting_of(folder: Path, truth: dict) -> "Fitting":
    """The case's logs, ready to be fitted from the believed plant."""
    import numpy as np

    from epa_rt.benchmark.oracle import averaged, noise_of
    from epa_rt.config.rig import load_rig
    from epa_rt.gap.rig.house.channels import channels_of
    from epa_rt.gap.rig.read import read_recording
    from epa_rt.models.plant_file import load_plant
    from sim_backend.stand_in import truth as stand_in
    from sim_backend.stand_in.fitted import Fitting
    from sim_backend.stand_in.replayed import commands_of_log

    told = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    rig, plant = load_rig(folder / told["rig"]), load_plant(folder / told["plant"])
    believed = stand_in.TruePlant(
        stand_in.noisier(plant.params, truth["noise"]), same_law=truth["same_law"]
    )
    commands = [commands_of_log(rig, folder / log) for log in told["logs"]]
    channels, parts = channels_of(rig), []
    for log in told["logs"]:
        columns = read_recording(folder / log).columns
        ports = [channels[name] for name in stand_in.channels_of(believed.nominal)]
        parts.append(
            averaged(
                np.column_stack(
                    [
                        columns[c.column] * c.scale + c.offset + (0.5 * c.step if c.floors else 0.0)
                        for c in ports
                    ]
                )
            )
        )
    noise = noise_of(
        stand_in.readings(believed, commands, noisy=True), stand_in.readings(believed, commands)
    )
    judged = stand_in.judged_rows(
        stand_in.true_plant(plant.params, truth)._replace(effects=()), commands
    )
    return Fitting(believed, commands, np.concatenate(parts), noise, judged, exact=True)


def true_laws(truth: dict) -> "tuple[Law, list[Law]]":
    """The true law from its true numbers, and what it may be taken for: one of its NEAREST rivals
    (from weak ones, so that either sign is near), one of two alone, or one of two with the other's
    rival.
    """
    from sim_backend.stand_in.fitted import catalogue_law, law_of, together

    effects = truth["effects"]
    if truth["same_law"]:
        return catalogue_law(effects[0]["name"], effects[0]["fields"]), []
    own = [law_of(e["name"], e["fields"]) for e in effects]
    rivals = [[weak_law(name) for name in _nearest(e["rivals"])] for e in effects]
    if len(own) == 1:
        return own[0], rivals[0]
    others = [
        own[0],
        own[1],
        *(together(own[0], r) for r in rivals[1]),
        *(together(r, own[1]) for r in rivals[0]),
    ]
    return together(*own), [law for law in others if len(set(law.effects)) == len(law.effects)]


def _nearest(rivals: "Mapping[str, float]") -> list[str]:
    """Those at the smallest linear distance. Every law that can be named is a rival where the truth
    was withheld, and most are nowhere near.
    """
    return sorted(rivals, key=lambda name: rivals[name])[:NEAREST]

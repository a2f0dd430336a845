"""What the data of blind cases allow: every case judged by an oracle that is told the true law, its rivals, and only fits them."""

import functools
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sim_backend.stand_in.fitted import Fitted, Fitting, Law

SHOWN = ("first", "in_set", "pair", "withheld", "wrong_sure", "block", "not_separable")
NEAREST = 5  # rivals that are fitted
WEAK = {True: 0.1, False: 0.3}  # of a typical strength, where rivals begin: weaker where either sign may be right


def oracle_all(cases: Path, sealed: Path, out: Path, jobs: int, said: Path | None = None, missed: bool = False) -> str:
    """Judges every case that hides something (resumable, answers beside ``out``), writes the JSON, returns table and closing line.

    ``said``: folder of a diagnosis' answers to these cases; a wrong name that it gave is a rival too. ``missed``: only cases that it was asked and got wrong.
    Opens the truth first and its answers tell it: to be run when the diagnoses are done. Raises SealError.
    """
    from epa_rt.gap.blind.figures import figures, wrong
    from epa_rt.gap.blind.seal import opened
    from epa_rt.gap.blind.shown import closing_line, table

    truths = [truth for truth in opened(sealed, cases)["cases"] if truth["effects"]]
    told = {t["case"]: _told(said, t["case"]) for t in truths}
    if missed:
        truths = [t for t in truths if told[t["case"]] and wrong(t, told[t["case"]])]
    answers = out.with_suffix(".answers")
    answers.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        waiting = [pool.submit(_one, cases / t["case"], t, answers / f"{t['case']}.json", told[t["case"]]) for t in truths]
        for n, done in enumerate(as_completed(waiting), 1):
            done.result()
            print(f"\r{n} of {len(truths)} cases judged", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    judged = [(t, json.loads((answers / f"{t['case']}.json").read_text(encoding="utf-8"))) for t in truths]
    found = [f for f in figures(judged) if f.key in SHOWN]
    seconds = sum(said["wall_seconds"] for _, said in judged) / max(len(judged), 1)
    out.write_text(json.dumps({"figures": [f._asdict() for f in found], "cases": [{"truth": t, "said": s} for t, s in judged]}, indent=1), encoding="utf-8")
    return f"{table(found)}\noracle: {closing_line(found)}; {seconds:.0f} s of a core per case"


def _told(answers: Path | None, case: str) -> dict:
    """What a diagnosis said of a case; nothing where it was not asked."""
    path = answers / f"{case}.json" if answers is not None else None
    return json.loads(path.read_text(encoding="utf-8")) if path is not None and path.exists() else {}


def _one(folder: Path, truth: dict, out: Path, told: dict) -> None:
    if not out.exists():
        said = judge(folder, truth, told)
        out.write_text(json.dumps(said), encoding="utf-8")


def judge(folder: Path, truth: dict, told: dict | None = None) -> dict:
    """An answer in the diagnosis' own words, with every law's chi-square. ``told``: what a diagnosis said of the case."""
    begun_s = time.process_time()
    fitting = fitting_of(folder, truth)
    from sim_backend.stand_in.fitted import Law

    own, rivals = true_laws(truth)
    nothing = fitting.fit(Law((), (), truth["same_law"]))
    z = fitting.last
    fits = [min(fitting.fit(own, z), fitting.fit(own, fitting.spreads_of(truth["nominal"])), key=lambda fit: fit.chi)]
    fits += [fitting.fit(law, z) for law in rivals]
    if instead := _instead(truth, told or {}):
        fits.append(fitting.fit(instead, fitting.spreads_of(told["fitted"])))
    fits = [fit._replace(chi=min(fit.chi, nothing.chi)) for fit in fits]  # at no strength every law is nothing
    return {**_said(truth, nothing, fits), "wall_seconds": time.process_time() - begun_s, "runs": fitting.runs,
            "chi": [["nothing", nothing.chi], *([" + ".join(f.law.effects), f.chi] for f in fits)], "fitted": fits[0].values}


def fitting_of(folder: Path, truth: dict) -> "Fitting":
    """The case's logs, ready to be fitted from the believed plant."""
    import numpy as np

    from epa_rt.config.rig import load_rig
    from epa_rt.gap.blind.oracle import averaged, noise_of
    from epa_rt.gap.house.channels import channels_of
    from epa_rt.gap.read import read_recording
    from epa_rt.models.plant_file import load_plant
    from sim_backend.stand_in import truth as stand_in
    from sim_backend.stand_in.fitted import Fitting
    from sim_backend.stand_in.replayed import commands_of_log

    told = json.loads((folder / "case.json").read_text(encoding="utf-8"))
    rig, plant = load_rig(folder / told["rig"]), load_plant(folder / told["plant"])
    believed = stand_in.TruePlant(stand_in.noisier(plant.params, truth["noise"]), same_law=truth["same_law"])
    commands = [commands_of_log(rig, folder / log) for log in told["logs"]]
    channels, parts = channels_of(rig), []
    for log in told["logs"]:
        columns = read_recording(folder / log).columns
        ports = [channels[name] for name in stand_in.channels_of(believed.nominal)]
        parts.append(averaged(np.column_stack([columns[c.column] * c.scale + c.offset + (0.5 * c.step if c.floors else 0.0) for c in ports])))
    noise = noise_of(stand_in.readings(believed, commands, noisy=True), stand_in.readings(believed, commands))
    judged = stand_in.judged_rows(stand_in.true_plant(plant.params, truth)._replace(effects=()), commands)
    return Fitting(believed, commands, np.concatenate(parts), noise, judged, exact=True)


def true_laws(truth: dict) -> "tuple[Law, list[Law]]":
    """The true law from its true numbers, and what it may be taken for: one of its NEAREST rivals (from weak ones, so that either sign is near),
    one of two alone, or one of two with the other's rival.
    """
    from sim_backend.stand_in.effects import BY_NAME
    from sim_backend.stand_in.fitted import catalogue_law, law_of, together

    effects = truth["effects"]
    if truth["same_law"]:
        return catalogue_law(effects[0]["name"], effects[0]["fields"]), []
    own = [law_of(e["name"], e["fields"]) for e in effects]
    rivals = [[law_of(name, share=WEAK[BY_NAME[name].either_sign]) for name in _nearest(e["rivals"])] for e in effects]
    if len(own) == 1:
        return own[0], rivals[0]
    others = [own[0], own[1], *(together(own[0], r) for r in rivals[1]), *(together(r, own[1]) for r in rivals[0])]
    return together(*own), [law for law in others if len(set(law.effects)) == len(law.effects)]


def _nearest(rivals: "Mapping[str, float]") -> list[str]:
    """Those at the smallest linear distance. Every law that can be named is a rival where the truth was withheld, and most are nowhere near."""
    return sorted(rivals, key=lambda name: rivals[name])[:NEAREST]


def _instead(truth: dict, told: dict) -> "Law | None":
    """The catalogue's laws that a diagnosis named though none of them is the truth, with its numbers; None where it did not."""
    from epa_rt.gap.blind.figures import named, right
    from sim_backend.stand_in.fitted import catalogue_law, together

    names = [] if any(right(e, n["name"], n.get("family")) for e in truth["effects"] for n in named(told)) else named(told)
    laws = [catalogue_law(n["name"], {number["name"]: number["value"] for number in n["parameters"]}) for n in names]
    return functools.reduce(together, laws) if laws else None


def _said(truth: dict, nothing: "Fitted", fits: "list[Fitted]") -> dict:
    """What an honest reader of these chi-squares would say."""
    from epa_rt.gap.blind.oracle import LIMIT

    ranked = sorted(fits, key=lambda fit: fit.chi)
    best, alike = ranked[0], [fit for fit in ranked[1:] if fit.chi - ranked[0].chi < LIMIT**2]
    if nothing.chi - best.chi < LIMIT**2:
        return {"verdict": "no_gap", "effects": [], "location": []}
    named = [_named(name, best.law) for name in best.law.effects]
    own = {name for name in best.law.effects}
    instead = [_named(name, fit.law)["name"] for fit in alike for name in fit.law.effects if name not in own]
    location = [{"block": effect["block"]} for effect in named]
    if truth["kind"] == "withheld" and best is fits[0] and not instead:
        return {"verdict": "not_in_catalogue", "effects": [], "location": location}
    sure = {"confidence": 0.5 if instead else 1.0, "not_separable_from": instead, "parameters": []}
    return {"verdict": "not_separable" if instead else "explained", "effects": [{**effect, **sure} for effect in named], "location": location}


def _named(name: str, law: "Law") -> dict:
    """A law of the stand-in (or of the catalogue) in the catalogue's words."""
    from epa_rt.models.catalogue import BY_NAME as CATALOGUE
    from sim_backend.stand_in.effects import BY_NAME

    if law.same_law:
        return {"name": name, "family": CATALOGUE[name].family, "block": CATALOGUE[name].block}
    hidden = BY_NAME[name]
    known = next((answer for answer in hidden.answers if answer in CATALOGUE), None)
    return {"name": known or name, "family": CATALOGUE[known].family if known else None, "block": hidden.blocks[0]}

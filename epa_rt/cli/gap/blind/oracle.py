"""What the data of blind cases allow: every case judged by an oracle that is told the true law, its
rivals, and only fits them.
"""

import functools
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.gap.blind.side_by_side import side_by_side
from epa_rt.cli.gap.blind.told import chi_of, told_the_law
from epa_rt.cli.write import write_whole

if TYPE_CHECKING:
    from sim_backend.stand_in.fitted import Fitted, Law

SHOWN = ("first", "in_set", "pair", "withheld", "wrong_sure", "block", "not_separable")


def oracle_all(
    cases: Path, sealed: Path, out: Path, jobs: int, said: Path | None = None, missed: bool = False
) -> str:
    """Judges every case that hides something (resumable, answers beside ``out``: one whose rivals
    were others is made again), writes the JSON, returns table and closing line.

    ``said``: folder of a diagnosis' answers to these cases; a wrong name that it gave is a rival
    too. ``missed``: only cases that it was asked and got wrong. Opens the truth first and its
    answers tell it: to be run when the diagnoses are done. Raises SealError.
    """
    from epa_rt.benchmark.figures import figures, wrong
    from epa_rt.benchmark.kept import ORACLE, check_given, hash_of, take
    from epa_rt.benchmark.seal import opened
    from epa_rt.benchmark.shown import closing_line, table

    if said is not None:
        check_given(said, cases)
    truths = [truth for truth in opened(sealed, cases)["cases"] if truth["effects"]]
    told = {t["case"]: _told(said, t["case"]) for t in truths}
    if missed:
        truths = [t for t in truths if told[t["case"]] and wrong(t, told[t["case"]])]
    answers = out.with_suffix(".answers")
    take(answers, cases, ORACLE)
    asked = [(cases / t["case"], t, answers / f"{t['case']}.json", told[t["case"]]) for t in truths]
    for _ in side_by_side(jobs, _one, asked, "cases judged"):
        pass
    judged = [
        (t, json.loads((answers / f"{t['case']}.json").read_text(encoding="utf-8"))) for t in truths
    ]
    found = [f for f in figures(judged) if f.key in SHOWN]
    seconds = sum(said["wall_seconds"] for _, said in judged) / max(len(judged), 1)
    write_whole(
        out,
        json.dumps(
            {
                "figures": [f._asdict() for f in found],
                "truth_sha256": hash_of(cases),
                "cases": [{"truth": t, "said": s} for t, s in judged],
            },
            indent=1,
        ),
    )
    return f"{table(found)}\noracle: {closing_line(found)}; {seconds:.0f} s of a core per case"


def _told(answers: Path | None, case: str) -> dict:
    """What a diagnosis said of a case; nothing where it was not asked."""
    path = answers / f"{case}.json" if answers is not None else None
    return (
        json.loads(path.read_text(encoding="utf-8")) if path is not None and path.exists() else {}
    )


def _one(folder: Path, truth: dict, out: Path, told: dict) -> None:
    if not out.exists() or json.loads(out.read_text(encoding="utf-8")).get(
        "instead", []
    ) != _instead_names(truth, told):
        write_whole(out, json.dumps(judge(folder, truth, told)))


def judge(folder: Path, truth: dict, told: dict | None = None) -> dict:
    """An answer in the diagnosis' own words, with every law's chi-square. ``told``: what a
    diagnosis said of the case.
    """
    begun_s = time.process_time()
    known = told_the_law(folder, truth)
    fitting, nothing = known.fitting, known.nothing
    fits = [known.own, *(fitting.fit(law, known.z) for law in known.rivals)]
    if instead := _instead(truth, told or {}):
        fits.append(fitting.fit(instead, fitting.spreads_of(told["fitted"])))
    fits = [
        fit._replace(chi=min(fit.chi, nothing.chi)) for fit in fits
    ]  # at no strength every law is nothing
    return {
        **_said(truth, nothing, fits),
        "instead": _instead_names(truth, told or {}),
        "wall_seconds": time.process_time() - begun_s,
        "runs": fitting.runs,
        "chi": chi_of(nothing, *fits),
        "fitted": fits[0].values,
    }


def _instead(truth: dict, told: dict) -> "Law | None":
    """The catalogue's laws that a diagnosis named though none of them is the truth, with its
    numbers; None where it did not.
    """
    from epa_rt.benchmark.figures import named
    from sim_backend.stand_in.fitted import catalogue_law, together

    names = _instead_names(truth, told)
    laws = [
        catalogue_law(n["name"], {number["name"]: number["value"] for number in n["parameters"]})
        for n in named(told)
        if n["name"] in names
    ]
    return functools.reduce(together, laws) if laws else None


def _instead_names(truth: dict, told: dict) -> list[str]:
    """What a diagnosis named where no name of its answer is right."""
    from epa_rt.benchmark.figures import named, right

    names = named(told)
    return (
        []
        if any(right(e, n["name"], n.get("family")) for e in truth["effects"] for n in names)
        else [n["name"] for n in names]
    )


def _said(truth: dict, nothing: "Fitted", fits: "list[Fitted]") -> dict:
    """What an honest reader of these chi-squares would say."""
    from epa_rt.benchmark.oracle import LIMIT

    ranked = sorted(fits, key=lambda fit: fit.chi)
    best, alike = ranked[0], [fit for fit in ranked[1:] if fit.chi - ranked[0].chi < LIMIT**2]
    if nothing.chi - best.chi < LIMIT**2:
        return {"verdict": "no_gap", "effects": [], "location": []}
    named = [_named(name, best.law) for name in best.law.effects]
    own = {name for name in best.law.effects}
    instead = [
        _named(name, fit.law)["name"]
        for fit in alike
        for name in fit.law.effects
        if name not in own
    ]
    location = [{"block": effect["block"]} for effect in named]
    if truth["kind"] == "withheld" and best is fits[0] and not instead:
        return {"verdict": "not_in_catalogue", "effects": [], "location": location}
    sure = {"confidence": 0.5 if instead else 1.0, "not_separable_from": instead, "parameters": []}
    return {
        "verdict": "not_separable" if instead else "explained",
        "effects": [{**effect, **sure} for effect in named],
        "location": location,
    }


def _named(name: str, law: "Law") -> dict:
    """A law of the stand-in (or of the catalogue) in the catalogue's words."""
    from epa_rt.models.catalogue import BY_NAME as CATALOGUE
    from sim_backend.stand_in.effects import BY_NAME

    if law.same_law:
        return {"name": name, "family": CATALOGUE[name].family, "block": CATALOGUE[name].block}
    hidden = BY_NAME[name]
    known = next((answer for answer in hidden.answers if answer in CATALOGUE), None)
    return {
        "name": known or name,
        "family": CATALOGUE[known].family if known else None,
        "block": hidden.blocks[0],
    }

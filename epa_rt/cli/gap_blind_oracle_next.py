"""What the data of proposed next experiments allow: the oracle, told the true law, over the logs and the experiment that the diagnosis asked for.

Its rivals are the names that the diagnosis could not tell from the truth, before the experiment or after it.
"""

import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sim_backend.stand_in.fitted import Law

SHARES = {True: 0.1, False: 0.3}  # of a typical strength, where rivals begin: weak where either sign may be right


def oracle_next(cases: Path, sealed: Path, out: Path, jobs: int, said: Path) -> str:
    """Judges every case of which a next experiment was recorded and whose truth can be named (resumable), writes the JSON, returns table and closing line.

    ``said``: folder of the diagnosis' answers, those with the next experiment among them. Opens the truth. Raises SealError.
    """
    from epa_rt.gap.blind.figures import after_next
    from epa_rt.gap.blind.seal import opened
    from epa_rt.gap.blind.shown import closing_line, table

    asked = []
    for truth in opened(sealed, cases)["cases"]:
        before, after = (said / f"{truth['case']}{end}.json" for end in ("", "_next"))
        if truth["effects"] and truth["kind"] != "withheld" and before.exists() and after.exists() and (cases / truth["case"] / "next" / "next.mcap").exists():
            asked.append((truth, *(json.loads(path.read_text(encoding="utf-8")) for path in (before, after))))
    answers = out.with_suffix(".answers")
    answers.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        waiting = [pool.submit(_one, cases / truth["case"] / "next", truth, _rivals(truth, before, after), answers / f"{truth['case']}.json") for truth, before, after in asked]
        for n, done in enumerate(as_completed(waiting), 1):
            done.result()
            print(f"\r{n} of {len(asked)} next experiments judged", end="" if n < len(asked) else "\n", file=sys.stderr, flush=True)
    judged = [(truth, {**before, "after_next": after}, json.loads((answers / f"{truth['case']}.json").read_text(encoding="utf-8"))) for truth, before, after in asked]
    found = after_next([(truth, {**before, "oracle_tells": told["tells"]}) for truth, before, told in judged])
    out.write_text(json.dumps({"figures": [f._asdict() for f in found], "cases": [{"truth": t, "said": s, "oracle": o} for t, s, o in judged]}, indent=1), encoding="utf-8")
    return f"{table(found)}\n{closing_line(found)}"


def _rivals(truth: dict, *said: dict) -> list[str]:
    """Names of the catalogue that stood for a truth, and are none."""
    from epa_rt.gap.blind.figures import family_of, named, right

    names = [name for one in said for e in named(one) for name in (e["name"], *(e.get("not_separable_from") or ()))]
    return [name for name in dict.fromkeys(names) if not any(right(e, name, family_of(name)) for e in truth["effects"])]


def _one(folder: Path, truth: dict, rivals: list[str], out: Path) -> None:
    if not out.exists():
        out.write_text(json.dumps(judge_next(folder, truth, rivals)), encoding="utf-8")


def judge_next(folder: Path, truth: dict, rivals: "Sequence[str]") -> dict:
    """Chi-square of the true law, of nothing and of every rival over the logs of ``folder``; whether they tell the truth from all of these."""
    from epa_rt.cli.gap_blind_oracle import fitting_of, true_laws
    from epa_rt.gap.blind.oracle import LIMIT
    from sim_backend.stand_in.fitted import Law

    begun_s = time.process_time()
    fitting = fitting_of(folder, truth)
    own, _ = true_laws(truth)
    nothing = fitting.fit(Law((), (), truth["same_law"]))
    z = fitting.last
    best = min((fitting.fit(own, z), fitting.fit(own, fitting.spreads_of(truth["nominal"]))), key=lambda fit: fit.chi)
    fits = [fitting.fit(law, z) for name in rivals for law in _instead_of(truth, name)]
    nearest = min([nothing.chi, *(fit.chi for fit in fits)])
    return {"tells": bool(nearest - best.chi >= LIMIT**2), "rivals": list(rivals), "chi": [["nothing", nothing.chi], *([" + ".join(f.law.effects), f.chi] for f in (best, *fits))],
            "fitted": best.values, "wall_seconds": time.process_time() - begun_s}


def _instead_of(truth: dict, name: str) -> "list[Law]":
    """The laws that a name may be, each in the place of one of the truth's; by the truth's kind of formula: the stand-in's or the catalogue's."""
    from epa_rt.models.catalogue import BY_NAME as CATALOGUE
    from sim_backend.stand_in.effects import BY_NAME
    from sim_backend.stand_in.fitted import catalogue_law, law_of, together

    if truth["same_law"]:
        return [catalogue_law(name, dict(zip(CATALOGUE[name].knobs, CATALOGUE[name].starts[0], strict=True)))]
    rig_laws = [h for h in BY_NAME.values() if name in h.answers]
    laws = [law_of(h.name, share=SHARES[h.either_sign]) for h in rig_laws]
    if len(truth["effects"]) == 1:
        return laws
    own = [law_of(e["name"], e["fields"]) for e in truth["effects"]]
    return [together(kept, law) for kept in own for law in laws if not set(kept.effects) & set(law.effects)]

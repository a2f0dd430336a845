"""What the data of proposed next experiments allow: the oracle, told the true law, over the logs
and the experiment that the diagnosis asked for.

Its rivals are the names that the diagnosis could not tell from the truth, before the experiment or
after it.
"""

import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import BAD_INPUT, VerbError
from epa_rt.cli.gap.blind.next import UNANSWERED
from epa_rt.cli.gap.blind.side_by_side import side_by_side
from epa_rt.cli.gap.blind.told import chi_of, told_the_law, weak_law
from epa_rt.cli.write import write_whole

if TYPE_CHECKING:
    from sim_backend.stand_in.fitted import Law


def oracle_next(cases: Path, sealed: Path, out: Path, jobs: int, said: Path) -> str:
    """Judges every case that was 'not separable' and whose truth can be named (resumable), writes
    the JSON, returns table and closing line.

    ``said``: folder of the diagnosis' answers, those with the next experiment among them. Opens the
    truth. Raises SealError, VerbError.
    """
    from epa_rt.benchmark.figures import after_next
    from epa_rt.benchmark.kept import ORACLE, check_given, hash_of, take
    from epa_rt.benchmark.seal import opened
    from epa_rt.benchmark.shown import closing_line, table

    answers = out.with_suffix(".answers")
    if not any(said.glob("*_next.json")) or answers.resolve() == said.resolve():
        raise VerbError(
            f"{said}: found no answers of next experiments, or this oracle's own, expected those"
            " that score --next has kept (--answers)",
            BAD_INPUT,
        )
    check_given(said, cases)
    asked = _asked(opened(sealed, cases)["cases"], said)
    take(answers, cases, ORACLE)
    ran = [
        (truth, _rivals(truth, before, after))
        for truth, before, after in asked
        if _kept(said, truth).exists()
    ]  # also where the second diagnosis died
    work = [
        (cases / truth["case"] / "next", truth, rivals, _kept(answers, truth))
        for truth, rivals in ran
    ]
    for _ in side_by_side(jobs, _one, work, "next experiments judged"):
        pass
    told = {truth["case"]: _read(_kept(answers, truth)) for truth, _ in ran}
    judged = [
        (
            truth,
            {
                **before,
                "after_next": after,
                "oracle_tells": told.get(truth["case"], {"tells": False})["tells"],
            },
        )
        for truth, before, after in asked
    ]
    found = after_next(judged)
    rows = [{"truth": t, "said": s, "oracle": told.get(t["case"])} for t, s in judged]
    write_whole(
        out,
        json.dumps(
            {
                "figures": [f._asdict() for f in found],
                "truth_sha256": hash_of(cases),
                "cases": rows,
            },
            indent=1,
        ),
    )
    return f"{table(found)}\n{closing_line(found)}"


def _asked(truths: Sequence[dict], said: Path) -> list[tuple[dict, dict, dict]]:
    """Truth, answer, and answer after the next experiment; an error in its place where none was
    proposed or none completed.
    """
    found = []
    for truth in truths:
        before, after = (said / f"{truth['case']}{end}.json" for end in ("", "_next"))
        first = _read(before) if before.exists() else {}
        if first.get("verdict") == UNANSWERED and truth["effects"] and truth["kind"] != "withheld":
            found.append(
                (
                    truth,
                    first,
                    (
                        _read(after)
                        if after.exists()
                        else {"error": "no next experiment was proposed, or none completed"}
                    ),
                )
            )
    return found


def _read(path: Path) -> dict:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise VerbError(
            f"{path}: found no whole JSON ({error}), expected an answer; delete it to have it made"
            " again",
            BAD_INPUT,
        ) from None


def _kept(answers: Path, truth: dict) -> Path:
    return answers / f"{truth['case']}_next.json"


def _rivals(truth: dict, *said: dict) -> list[str]:
    """Names of the catalogue that stood for a truth, and are none."""
    from epa_rt.benchmark.figures import family_of, named, right

    names = [
        name
        for one in said
        for e in named(one)
        for name in (e["name"], *(e.get("not_separable_from") or ()))
    ]
    return [
        name
        for name in dict.fromkeys(names)
        if not any(right(e, name, family_of(name)) for e in truth["effects"])
    ]


def _one(folder: Path, truth: dict, rivals: list[str], out: Path) -> None:
    if not out.exists() or _read(out)["rivals"] != rivals:
        write_whole(out, json.dumps(judge_next(folder, truth, rivals)))


def judge_next(folder: Path, truth: dict, rivals: Sequence[str]) -> dict:
    """Chi-square of the true law, of nothing and of every rival over the logs of ``folder``;
    ``tells``: whether all of these are further off, None where a rival has no law that could be
    fitted. ``cpu_seconds``.
    """
    from epa_rt.benchmark.oracle import LIMIT

    begun_s = time.process_time()
    known = told_the_law(folder, truth)
    laws, unasked = laws_instead(truth, rivals)
    fits = [known.fitting.fit(law, known.z) for law in laws]
    apart = min([known.nothing.chi, *(fit.chi for fit in fits)]) - known.own.chi >= LIMIT**2
    return {
        "tells": None if apart and unasked else bool(apart),
        "rivals": list(rivals),
        "unasked": unasked,
        "chi": chi_of(known.nothing, known.own, *fits),
        "fitted": known.own.values,
        "cpu_seconds": time.process_time() - begun_s,
    }


def laws_instead(truth: dict, rivals: Sequence[str]) -> "tuple[list[Law], list[str]]":
    """The laws that names of the catalogue may be on this rig, each in the place of one of the
    truth's, and each of a pair alone; and the names that have none.

    By the stand-in's formulas; by the catalogue's where the truth is, or where the stand-in has
    none for a lone truth.
    """
    from epa_rt.models.catalogue import BY_NAME as CATALOGUE
    from sim_backend.stand_in.effects import BY_NAME
    from sim_backend.stand_in.fitted import catalogue_law, law_of, together

    lone, unasked, laws = len(truth["effects"]) == 1, [], {}
    own = [] if lone else [law_of(e["name"], e["fields"]) for e in truth["effects"]]
    for name in rivals:
        hidden = (
            []
            if truth["same_law"]
            else [h for h in BY_NAME.values() if name in h.answers and truth["rig"] in h.rigs]
        )
        made = [weak_law(h.name) for h in hidden]
        if not made and lone:
            made = [
                catalogue_law(
                    name, dict(zip(CATALOGUE[name].knobs, CATALOGUE[name].starts[0], strict=True))
                )
            ]
        made = (
            made
            if lone
            else [
                together(kept, law)
                for kept in own
                for law in made
                if not set(kept.effects) & set(law.effects)
            ]
        )
        unasked += [] if made else [name]
        laws |= {law.effects: law for law in made}
    return [*own, *laws.values()], unasked

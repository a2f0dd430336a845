"""Every figure of the benchmark and how it is counted. The only place that defines them.

A *case* is a pair (truth, said): the truth as it was sealed, and the answer's JSON. An answer that
ended in an error counts as wrong everywhere. *Judged* are cases whose effect is at least twice the
detection limit (oracle.py), is seen in these logs, and is told from its rivals by the oracle. A
name is *right* where it is one of the truth's answers, or of their family. The *block said* is that
of the first effect named, else of the first place of the gap; none where the verdict is that there
is no gap, or nothing to see it by.

first: the first effect named is right, judged cases. in_set: any effect named or said to be alike
is right; judged cases and those made not to be separable. pair: both named, whatever else is. none:
anything named, or an error. withheld: that verdict, and the first place of the gap in a block of
the truth; at least twice the limit. withheld_apart: those of them that the oracle tells from every
effect that can be named. wrong_sure: any effect named with a confidence of SURE or more, or an
error; wrong_sure_apart: the same of those that the oracle tells. block: singles, same law and
withheld, at least twice the limit. intervals: parameters of right first names, by name. closed: all
channels in units of their floors, teacher-forced, held out, against the refitted nominal plant; at
least twice the limit; an error counts as nothing closed. gate: an error counts as missed, the
gate's own or that of a diagnosis where there is an effect; a run with no gap to predict is not
counted. next: nothing but the truth's families is left in the set. first_weak: as first, from half
the limit to twice. next_named: as next, without withheld truths. next_oracle: of these, where every
rival has a law to fit, those whose experiment tells: the true law, fitted over all logs and the new
one, leaves 25 less than nothing and than every law that a name said before or after may be.
next_apart: next_named of those.
"""

from collections.abc import Iterable, Sequence
from functools import cache

from epa_rt.benchmark.counted import Case, Figure, middle, share

SURE = 0.8  # from this confidence on a name counts as given with confidence
TWICE = 2.0  # multiples of the detection limit


def named(said: dict) -> list[dict]:
    """Effects that the answer names; none where it says that there is nothing, or nothing of the
    catalogue.
    """
    return (
        []
        if said.get("verdict") in ("no_gap", "not_in_catalogue", "not_excited", None)
        else list(said.get("effects") or ())
    )


def right(effect: dict, name: str, family: str | None = None) -> bool:
    """Whether a name (and family) said means the truth's effect. Families may have been renamed
    since a set was made: an answer's family of today counts as well.
    """
    if name in effect["answers"] or (family is not None and family in effect["families"]):
        return True
    today = family_of(name)
    return today is not None and today in map(family_of, effect["answers"])


def block_said(said: dict) -> str | None:
    """The block that the answer points at first; None where it says that there is no gap, or that
    these logs show none.
    """
    if said.get("verdict") in ("no_gap", "not_excited"):
        return None  # it ranks all its links even then
    for entry in (*named(said), *(said.get("location") or ())):
        return entry["block"]
    return None


def strong(truth: dict) -> bool:
    """Every effect at least twice its detection limit."""
    return bool(truth["effects"]) and all(e["multiple"] >= TWICE for e in truth["effects"])


def not_lost(truth: dict) -> bool:
    """Every effect at least half its detection limit."""
    return all(e["multiple"] >= 0.5 for e in truth["effects"])


def judged(truth: dict) -> bool:
    """A single effect of the catalogue that these logs show and tell from its rivals."""
    return (
        truth["kind"] in ("single", "same_law")
        and strong(truth)
        and truth["separable"]
        and bool(truth["effects"][0]["families"])
    )


def _first_right(truth: dict, said: dict) -> bool:
    first = named(said)[:1]
    return bool(first) and right(truth["effects"][0], first[0]["name"], first[0].get("family"))


def _in_set(truth: dict, said: dict) -> bool:
    names = [(e["name"], e.get("family")) for e in named(said)] + [
        (n, family_of(n)) for e in named(said) for n in e.get("not_separable_from") or ()
    ]
    return any(right(truth["effects"][0], name, family) for name, family in names)


def _both(truth: dict, said: dict) -> bool:
    return all(
        any(right(effect, n["name"], n.get("family")) for n in named(said))
        for effect in truth["effects"]
    )


def _withheld(truth: dict, said: dict) -> bool:
    places = said.get("location") or ()
    return (
        said.get("verdict") == "not_in_catalogue"
        and bool(places)
        and places[0]["block"] in truth["effects"][0]["blocks"]
    )


def _wrong_and_sure(truth: dict, said: dict) -> bool:
    return "error" in said or any(
        n.get("confidence", 1.0) >= SURE and not right(truth["effects"][0], n["name"])
        for n in named(said)
    )


def _block(truth: dict, said: dict) -> bool:
    return block_said(said) in {block for effect in truth["effects"] for block in effect["blocks"]}


def wrong(truth: dict, said: dict) -> bool:
    """Whether an answer misses what its case was made for: the first name, both of a pair, the
    refusal or the block.
    """
    if truth["kind"] == "withheld":
        return strong(truth) and not _withheld(truth, said)
    if truth["kind"] == "pair":
        return not _both(truth, said)
    return judged(truth) and not (_first_right(truth, said) and _block(truth, said))


def _not_tested(truth: dict, said: dict) -> bool:
    return not named(said) and (
        said.get("verdict") == "not_excited"
        or any(right(truth["effects"][0], n) for n in said.get("not_tested") or ())
    )


def _separated(truth: dict, said: dict) -> bool:
    """After the proposed experiment the answer names something, and all of its set is the
    truth's.
    """
    after = said["after_next"]
    names = [(e["name"], e.get("family")) for e in named(after)] + [
        (n, family_of(n)) for e in named(after) for n in e.get("not_separable_from") or ()
    ]
    return (
        bool(names)
        and after["verdict"] != "not_separable"
        and all(any(right(e, *name) for e in truth["effects"]) for name in names)
    )


@cache
def family_of(name: str) -> str | None:
    """Family of a name of the catalogue."""
    from epa_rt.models.catalogue import BY_NAME

    return BY_NAME[name].family if name in BY_NAME else None


def _intervals(cases: Iterable[Case]) -> Iterable[Case]:
    """Every parameter of a right-named effect whose law is the catalogue's own, as a pair (truth,
    Number).
    """
    for truth, said in cases:
        for effect in truth["effects"] if truth["kind"] == "same_law" else ():
            for n in named(said)[:1]:
                if n["name"] in effect["answers"]:
                    for number in n.get("parameters") or ():
                        found = [
                            v
                            for key, v in effect["fields"].items()
                            if key.split(".")[-1] == number["name"].split(".")[-1]
                        ]
                        if found:
                            yield {"value": found[0]}, number


def closed(said: dict) -> float | None:
    """Share of the gap closed on held-out logs; None where there was none to close."""
    rows = [
        row["closed_share"]
        for row in said.get("shrinkage") or ()
        if row["channel"] == "all channels"
        and row["log"] == "all"
        and row["mode"] == "teacher_forced"
        and row.get("baseline", "refitted") == "refitted"
    ]
    return 0.0 if "error" in said else rows[0] if rows else None


def after_next(cases: Sequence[Case]) -> list[Figure]:
    """Of answers that said 'not separable' of what can be named: how many are separated, how often
    the oracle says that the experiment tells, and how many of these are.
    """
    asked = [(t, s) for t, s in cases if s["oracle_tells"] is not None]
    return [
        share(
            "next_named",
            "separated after the proposed next experiment, where the truth can be named",
            "",
            cases,
            _separated,
        ),
        share(
            "next_oracle",
            "next experiments that tell, as the oracle has it",
            "",
            asked,
            lambda t, s: s["oracle_tells"],
        ),
        share(
            "next_apart",
            "separated after the proposed next experiment, where the oracle tells",
            ">= 80 %",
            [(t, s) for t, s in asked if s["oracle_tells"]],
            _separated,
        ),
    ]


def figures(cases: Sequence[Case]) -> list[Figure]:
    """All figures of issue 4's table, in its order, and a few more."""
    of = {
        kind: [(t, s) for t, s in cases if t["kind"] == kind]
        for kind in {t["kind"] for t, _ in cases}
    }
    single = [(t, s) for t, s in cases if judged(t)]
    withheld = [(t, s) for t, s in of.get("withheld", ()) if strong(t)]
    placed = [
        (t, s) for t, s in cases if t["kind"] in ("single", "same_law", "withheld") and strong(t)
    ]
    hidden = [(t, s) for t, s in cases if t["kind"] in ("single", "same_law", "pair") and strong(t)]
    weak = [
        (t, s)
        for t, s in cases
        if t["kind"] in ("single", "same_law")
        and t["effects"][0]["families"]
        and not strong(t)
        and not_lost(t)
    ]
    gates = [
        s if "error" in s else s["gate"]
        for t, s in cases
        if "error" in s
        and t["effects"]
        or s.get("gate")
        and ("error" in s["gate"] or s["gate"].get("points") is not None)
    ]
    return [
        share("first", "right first effect (family)", ">= 95 %", single, _first_right),
        share(
            "in_set",
            "truth within the reported set",
            ">= 99 %",
            [*single, *((t, s) for t, s in of.get("not_separable", ()) if strong(t))],
            _in_set,
        ),
        share("pair", "both of a pair", ">= 85 %", of.get("pair", ()), _both),
        share(
            "none",
            "false name where there is none",
            "<= 2 %",
            of.get("none", ()),
            lambda t, s: "error" in s or bool(named(s)),
        ),
        share(
            "withheld",
            "not_in_catalogue with the right block where withheld",
            ">= 90 %",
            withheld,
            _withheld,
        ),
        share(
            "withheld_apart",
            "the same where the oracle tells it from all that can be named",
            "",
            [(t, s) for t, s in withheld if t["separable"]],
            _withheld,
        ),
        share(
            "wrong_sure",
            "wrong name with confidence where withheld",
            "<= 5 %",
            withheld,
            _wrong_and_sure,
        ),
        share(
            "wrong_sure_apart",
            "the same where the oracle tells it from all that can be named",
            "",
            [(t, s) for t, s in withheld if t["separable"]],
            _wrong_and_sure,
        ),
        share("block", "right block", ">= 97 %", placed, _block),
        share(
            "intervals",
            "95 % intervals that hold the truth, same law",
            "90-99 %",
            _intervals(cases),
            lambda t, n: n["low"] <= t["value"] <= n["high"],
        ),
        middle(
            "closed",
            "median share of the gap closed, held out",
            ">= 95 %",
            [c for _, s in hidden if (c := closed(s)) is not None],
        ),
        share(
            "gate",
            "predicted within 5 points of achieved in the gate",
            ">= 90 %",
            [({}, g) for g in gates],
            lambda _, g: bool(g.get("passed")),
        ),
        share(
            "next",
            "separated after the proposed next experiment",
            ">= 80 %",
            [(t, s) for t, s in cases if "after_next" in s],
            _separated,
        ),
        share("first_weak", "right first effect, half to twice its limit", "", weak, _first_right),
        share(
            "not_excited",
            "said to be not excited or not tested",
            "",
            of.get("not_excited", ()),
            _not_tested,
        ),
        share(
            "not_separable",
            "said to be not separable",
            "",
            of.get("not_separable", ()),
            lambda t, s: s.get("verdict") == "not_separable",
        ),
        share(
            "errors", "diagnoses that ended in an error", "0 %", cases, lambda t, s: "error" in s
        ),
        middle(
            "seconds",
            "seconds per diagnosis, median",
            "<= 120 s",
            [s["wall_seconds"] for _, s in cases if "wall_seconds" in s],
        ),
    ]

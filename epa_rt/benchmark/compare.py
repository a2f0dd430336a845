"""Two diagnosers on the same sealed cases: who gives the truth more probability, and whether a
probability that is said holds.

Log score: mean log probability of the truth. Brier score: mean of (1 - that probability)^2. A
name's probability holds where names of 0.8 are right four times in five (reliability; expected
calibration error: mean distance of the two over all names).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb, log
from typing import NamedTuple

from epa_rt.benchmark.counted import Case, wilson
from epa_rt.benchmark.figures import family_of, named, right, strong, wrong

LEAST = 1e-3  # no probability counts for less: one case must not decide alone
TOO_MANY = 0.5  # of a set that names the truth and something else
# An answer without a probability ("no gap", "not in the catalogue") is taken at the level of this
# project's intervals.
SAID = 0.95
APART = 0.01  # of probability, by less two answers are as good
BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)


class Shares(NamedTuple):
    """Probability of nothing, of something that the catalogue lacks, and of sets of names, each
    with its family.
    """

    none: float
    unknown: float
    sets: Sequence[tuple[Mapping[str, str | None], float]]


def of_truth(truth: Mapping, said: Mapping) -> float:
    """Probability that an answer gives to the truth."""
    return share_of(truth, _shares(said))


def share_of(truth: Mapping, shares: Shares) -> float:
    """Probability of the truth: of nothing, of something that the catalogue lacks, or of the sets
    that hold a family of each effect; one with a name too many counts half. An effect that is not
    twice its detection limit may as well be none.
    """
    none, unknown, sets = shares
    if truth["kind"] == "none":
        return none
    if truth["kind"] == "withheld":
        share = unknown
    else:
        effects = truth["effects"]
        share = sum(
            probability * (1.0 if len(set(names.values())) == len(effects) else TOO_MANY)
            for names, probability in sets
            if all(any(right(effect, *one) for one in names.items()) for effect in effects)
        )
    return share if strong(truth) and truth["kind"] != "not_excited" else share + none


def _shares(said: Mapping) -> Shares:
    posterior = said.get("posterior")
    if posterior:
        sets = [(one["effects"], one["probability"]) for one in posterior["models"]]
        none = sum(share for effects, share in sets if not effects)
        named_sets = [({n: family_of(n) for n in e}, share) for e, share in sets if e]
        return Shares(none, posterior["unknown"], named_sets)
    names = named(said)
    if not names:
        is_calm = said.get("verdict") in ("no_gap", "not_excited")
        return Shares(SAID, 1.0 - SAID, ()) if is_calm else Shares(1.0 - SAID, SAID, ())
    sure = min(one["confidence"] for one in names)
    said_sets = [{one["name"]: one.get("family") for one in names}]
    for one in names:
        others = {name: family for name, family in said_sets[0].items() if name != one["name"]}
        alike = one.get("not_separable_from") or ()
        said_sets += [{**others, name: family_of(name)} for name in alike]
    by_kind = {frozenset(one.values()): one for one in reversed(said_sets)}
    rest = 0.5 * (1.0 - sure)
    return Shares(rest, rest, [(one, sure / len(by_kind)) for one in by_kind.values()])


@dataclass(frozen=True)
class Scored:
    """One diagnoser on a set. ``names``: of each first name its probability, and whether it is
    right. ``right``: cases that are answered as they were made for.
    """

    of_truth: tuple[float, ...]
    names: tuple[tuple[float, bool], ...]
    right: int

    @property
    def log_score(self) -> float:
        return _mean([log(max(one, LEAST)) for one in self.of_truth])

    @property
    def brier(self) -> float:
        return _mean([(1.0 - one) ** 2 for one in self.of_truth])

    @property
    def calibration_error(self) -> float:
        rows = reliability(self.names)
        total = sum(row["names"] for row in rows)
        return sum(row["names"] * abs(row["said"] - row["right"]) for row in rows) / max(total, 1)


def scored(cases: Sequence[Case]) -> Scored:
    """Of all cases of a set."""
    names = []
    for truth, said in cases:
        for one in named(said)[:1]:
            is_right = any(right(e, one["name"], one.get("family")) for e in truth["effects"])
            names.append((min(float(one["confidence"]), 1.0), is_right))
    return Scored(
        tuple(of_truth(truth, said) for truth, said in cases),
        tuple(names),
        sum(not wrong(truth, said) for truth, said in cases),
    )


def reliability(names: Sequence[tuple[float, bool]]) -> list[dict[str, float]]:
    """By bins of a name's probability: how many names, the mean that was said, the part that is
    right, and Wilson's 95 % interval of that.
    """
    rows = []
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        inside = [one for one in names if low <= one[0] < high or one[0] == high == 1.0]
        if inside:
            hits = sum(is_right for _, is_right in inside)
            interval = wilson(hits, len(inside))
            rows.append(
                {
                    "from": low,
                    "to": high,
                    "names": len(inside),
                    "said": _mean([share for share, _ in inside]),
                    "right": hits / len(inside),
                    "low": interval[0],
                    "high": interval[1],
                }
            )
    return rows


@dataclass(frozen=True)
class Compared:
    """``ahead``, ``alike``, ``behind``: cases to whose truth the first gives more probability, as
    much, less. ``chance``: of a split as uneven where both are as good (sign test, two-sided).
    """

    ahead: int
    alike: int
    behind: int
    chance: float


def compared(first: Scored, second: Scored) -> Compared:
    """The same cases in the same order."""
    apart = [a - b for a, b in zip(first.of_truth, second.of_truth, strict=True)]
    ahead, behind = sum(one > APART for one in apart), sum(one < -APART for one in apart)
    return Compared(ahead, len(apart) - ahead - behind, behind, sign_test(ahead, behind))


def sign_test(ahead: int, behind: int) -> float:
    """Two-sided chance of a split as uneven as this one where each case goes either way."""
    of, less = ahead + behind, min(ahead, behind)
    tail = sum(comb(of, k) for k in range(less + 1)) / 2.0**of
    return min(2.0 * tail, 1.0)


def _mean(values: Sequence[float]) -> float:
    return sum(values) / len(values) if values else 0.0

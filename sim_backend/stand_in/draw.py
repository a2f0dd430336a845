"""What cases a benchmark has: kinds in fixed shares, effects in turn, rigs, plans and noise levels
spread over them.
"""

from typing import NamedTuple

import numpy as np

from epa_rt.benchmark.plans import NARROW, RICH, STILL
from epa_rt.models.catalogue import BY_NAME as CATALOGUE
from sim_backend.stand_in.effects import BY_NAME, EFFECTS, IN_PLACE, Hidden

SHARES = {
    "single": 0.40,
    "same_law": 0.10,
    "pair": 0.12,
    "none": 0.10,
    "withheld": 0.14,
    "not_excited": 0.07,
    "not_separable": 0.07,
}
KINDS = tuple(SHARES)
NOISE = (0.4, 1.0, 2.5)
KNEE_SHARE = 0.25
# strength in multiples of the detection limit, from and to; drawn evenly in the logarithm
MULTIPLES = {
    "single": (0.5, 50.0),
    "same_law": (1.0, 50.0),
    "pair": (4.0, 40.0),
    "withheld": (3.0, 50.0),
    "not_separable": (3.0, 12.0),
}  # there: at most
# of the catalogue's own laws what bench and knee do not show at three times a typical strength; all
# others are drawn as they are
FAINT = (
    "bus_sag",
    "guide_friction",
    "motor_torque_offset",
    "supply_gauge_gain",
    "supply_gauge_offset",
    "joint_speed_gain",
    "joint_speed_offset",
    "load_position_gain",
    "load_position_offset",
    "muscle0_gauge_gain",
    "muscle1_gauge_bow",
    "force_gain",
)
OF_THE_KNEE = ("load.", "sensors.joint", "sensors.muscle1")


# what one pressure and one small sine show so much alike that the oracle cannot tell them from one
# of their rivals at twice the limit
ALIKE = (
    "late_command",
    "old_encoder",
    "thermal_gas",
    "slow_gauge",
    "braid_tanh",
    "braid_low_speed",
    "wet_braid",
    "slow_force",
    "mesh_loss",
    "dry_gear",
    "rubber_wall",
    "rubber_threshold",
)


class Spec(NamedTuple):
    """One case before anything is known of strengths. ``effects``: candidates in the order in which
    they are tried, a pair needs two of them; names of the stand-in, for 'same_law' of the
    catalogue. ``laws``: which formulas take the first ones' places (effects.IN_PLACE).
    """

    index: int
    kind: str
    rig: str
    plan: str
    noise: float
    effects: tuple[str, ...]
    multiple: float
    laws: int = 1

    @property
    def own_law(self) -> bool:
        """Whether its effect is the catalogue's own law."""
        return self.kind == "same_law" or any(name not in BY_NAME for name in self.effects)


def families(effect: Hidden) -> tuple[str, ...]:
    """Families of the catalogue that mean this effect; empty where the catalogue has no such
    thing.
    """
    return tuple(
        dict.fromkeys(CATALOGUE[name].family for name in effect.answers if name in CATALOGUE)
    )


def left_out(name: str) -> list[str]:
    """Every name of the catalogue that means this effect, of the stand-in or of the catalogue, or
    is of its families.
    """
    own = families(BY_NAME[name]) if name in BY_NAME else (CATALOGUE[name].family,)
    return [name for name, item in CATALOGUE.items() if item.family in own]


def draw(seed: int, cases: int, kinds: tuple[str, ...] = KINDS, laws: int = 1) -> list[Spec]:
    """The cases of a benchmark, in mixed order. ``laws``: with 2 to 6 the same cases, with other
    formulas (effects.IN_PLACE) where there are any.
    """
    rng = np.random.default_rng([seed, 0])
    counts = _counts(cases, kinds)
    specs: list[Spec] = []
    for kind, count in counts.items():
        effects = _turns(kind, count, rng)
        ranks = rng.permutation(count)
        for i in range(count):
            names, rig = effects[i]
            low, high = MULTIPLES.get(kind, (1.0, 1.0))
            place = (ranks[i] + rng.uniform()) / count
            plan = {"not_excited": STILL, "not_separable": NARROW}.get(kind, RICH)
            specs.append(
                Spec(
                    0,
                    kind,
                    rig,
                    plan,
                    NOISE[(i + int(rng.integers(3))) % 3],
                    names,
                    float(low * (high / low) ** place),
                )
            )
    return [
        with_laws(specs[k]._replace(index=n), laws)
        for n, k in enumerate(rng.permutation(len(specs)))
    ]


def with_laws(spec: Spec, laws: int) -> Spec:
    """A case with the first to sixth formulas of its effects; the catalogue's own laws stay."""
    others = {} if spec.kind == "same_law" else IN_PLACE[laws]
    return spec._replace(
        laws=laws,
        effects=tuple(others[name].name if name in others else name for name in spec.effects),
    )


def _counts(cases: int, kinds: tuple[str, ...]) -> dict[str, int]:
    total = sum(SHARES[kind] for kind in kinds)
    wanted = {kind: cases * SHARES[kind] / total for kind in kinds}
    counts = {kind: int(value) for kind, value in wanted.items()}
    for kind in sorted(kinds, key=lambda kind: counts[kind] - wanted[kind])[
        : cases - sum(counts.values())
    ]:
        counts[kind] += 1
    return counts


def _turns(kind: str, count: int, rng: np.random.Generator) -> list[tuple[tuple[str, ...], str]]:
    """Candidates and rig of every case of a kind. What is easily shown on one rig only goes
    there.
    """
    out = []
    known = [effect.name for effect in EFFECTS if families(effect)]
    never = [
        str(name)
        for name in rng.permutation([effect.name for effect in EFFECTS if not families(effect)])
    ]
    if kind == "withheld":  # every family in turn, every third case what the catalogue never had
        one_each = list({families(BY_NAME[name]): name for name in rng.permutation(known)}.values())
        mixed = [
            name
            for pair in zip(
                rng.permutation(one_each),
                np.resize(rng.permutation(one_each), len(one_each)),
                strict=True,
            )
            for name in pair
        ]
        pool = [
            never.pop(0) if (i % 3 == 2 and never) else mixed[i % len(mixed)] for i in range(count)
        ]
    elif kind == "same_law":
        pool = [
            str(name)
            for name in np.resize(
                rng.permutation([name for name in CATALOGUE if name not in FAINT]), count
            )
        ]
    elif kind == "not_separable":
        turns = np.resize(
            rng.permutation(ALIKE), count
        )  # each in turn, another where it does not fit
        return [
            (tuple(dict.fromkeys(str(name) for name in (first, *rng.permutation(ALIKE)))), "bench")
            for first in turns
        ]
    elif kind == "none":
        return [((), "knee" if rng.uniform() < KNEE_SHARE else "bench") for _ in range(count)]
    else:
        pool = [str(name) for name in np.resize(rng.permutation(known), count)]
    for name in pool:
        rigs = BY_NAME[name].rigs if name in BY_NAME else (_rig_of_own(name),)
        rig = (
            "knee"
            if "knee" in rigs and ("bench" not in rigs or rng.uniform() < KNEE_SHARE)
            else "bench"
        )
        others = (
            [n for n in rng.permutation(known) if n != name and rig in BY_NAME[n].rigs]
            if kind != "same_law"
            else []
        )
        if kind == "pair":
            own = families(BY_NAME[name])
            others = [n for n in others if not set(families(BY_NAME[n])) & set(own)]
        out.append(
            (
                (
                    (name, *(str(n) for n in others[:4]))
                    if kind in ("pair", "not_excited")
                    else (name,)
                ),
                rig,
            )
        )
    return out


def one_of_each() -> list[Spec]:
    """Every hidden effect once, withheld, well above detection: the cases of the leave-one-out
    matrix.
    """
    return [
        Spec(i, "withheld", effect.rigs[0], RICH, 1.0, (effect.name,), 20.0)
        for i, effect in enumerate(EFFECTS)
    ]


def each_alone(multiple: float, laws: int) -> list[Spec]:
    """Every hidden effect that the catalogue knows, alone, on every rig that shows it, ``multiple``
    times its detection limit: a set to develop on, for what is strong shows where the catalogue's
    words are too narrow for it.
    """
    cases = [(effect.name, rig) for effect in EFFECTS if families(effect) for rig in effect.rigs]
    return [
        with_laws(Spec(i, "single", rig, RICH, 1.0, (name,), multiple), laws)
        for i, (name, rig) in enumerate(cases)
    ]


def one_of_the_others() -> list[Spec]:
    """Every effect of the catalogue for which the stand-in has no formula, by the catalogue's own
    law; else like one_of_each.
    """
    played = {name for effect in EFFECTS for name in effect.answers}
    rest = [name for name in CATALOGUE if name not in played]
    return [
        Spec(i, "withheld", _rig_of_own(name), RICH, 1.0, (name,), 20.0)
        for i, name in enumerate(rest)
    ]


def _rig_of_own(name: str) -> str:
    """The rig that shows an effect of the catalogue."""
    return "knee" if any(key.startswith(OF_THE_KNEE) for key in CATALOGUE[name].knobs) else "bench"

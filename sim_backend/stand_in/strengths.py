"""How strong a case's hidden effects are, and what an oracle that knows the law says of them."""

from typing import Any

import numpy as np

from epa_rt.benchmark.oracle import LIMIT, Bench, distance, left, strength_for
from epa_rt.models.catalogue import BY_NAME as CATALOGUE
from epa_rt.models.effect import Effect
from sim_backend.stand_in.distances import Apart
from sim_backend.stand_in.draw import Spec, families
from sim_backend.stand_in.effects import BY_NAME, EFFECTS, MOTOR, Hidden
from sim_backend.stand_in.fitted import law_of
from sim_backend.stand_in.truth import TruePlant, catalogue_fields, readings

TWICE = 2.0  # multiples of the limit from which an effect counts as seen
# a single effect is made stronger where its fitted distance is so many times below what was asked
# for
LOST = 1.4
SHOWS_IN = {
    "drive.viscous": MOTOR,
    "sensors.motor": MOTOR,
    "sensors.muscle": ("gas", "muscle"),
    "sensors.gauge": ("gas", "muscle"),
    "sensors.supply": ("gas",),
    "sensors.joint": ("load",),
    "sensors.load": ("load",),
}  # where a fault shows: the blocks that a reading goes through, or whose balance has its torque
SO_NEAR = (
    0.8  # of the limit: how far off the nearest rival of a case is that is not to be separable
)


class Unfit(Exception):
    """No candidate gives a case of the kind that was asked for."""


class Workshop:
    """One case's plant, its oracle's bench and the commands of its logs."""

    def __init__(
        self,
        spec: Spec,
        plant: TruePlant,
        bench: Bench,
        commands: list[np.ndarray],
        rng: np.random.Generator,
    ):
        self.spec, self.plant, self.bench, self.commands, self.rng = (
            spec,
            plant,
            bench,
            commands,
            rng,
        )

    def effects(self) -> list[dict[str, Any]]:
        """The hidden effects with their fields and what the oracle says. Raises Unfit."""
        kind, names = self.spec.kind, self.spec.effects
        if kind == "none":
            return []
        if self.spec.own_law:
            return [self._same_law(names[0])]
        if kind == "pair":
            return self._pair()
        wanted = {"not_excited": self._unseen, "not_separable": self._ambiguous}.get(
            kind, self._single
        )
        for name in names:
            found = wanted(BY_NAME[name])
            if found is not None:
                return [found]
        raise Unfit(
            f"found none of {', '.join(names)}, expected one that makes a case of kind {kind}"
        )

    def _shapes(self, effect: Hidden) -> dict[str, float]:
        return {name: float(self.rng.uniform(low, high)) for name, low, high in effect.shapes}

    def _with(self, *named: tuple[str, dict[str, float]]) -> np.ndarray:
        return readings(self.plant._replace(effects=tuple(named)), self.commands)

    def _single(self, effect: Hidden) -> dict[str, Any] | None:
        """An effect at the wanted multiple of its limit; once made stronger by what a fit of the
        nominal parameters took of it.
        """
        found = self._judged(effect)
        wanted = min(found["linear"], LIMIT * self.spec.multiple)
        strength, lost = found["fields"][effect.field], wanted / max(found["distance"], 1e-9)
        if lost > LOST and abs(strength) < effect.most:
            strength = float(np.clip(strength * lost, -effect.most, effect.most))
            found = self.judged(effect, {**found["fields"], effect.field: strength})
        return None if self.spec.kind == "withheld" and found["multiple"] < TWICE else found

    def _judged(
        self, effect: Hidden, multiple: float | None = None, fitted: bool = True
    ) -> dict[str, Any]:
        """An effect at the wanted multiple of its detection limit (linear), with its rivals'
        distances.
        """
        shapes = self._shapes(effect)
        sign = -1.0 if effect.either_sign and self.rng.uniform() < 0.5 else 1.0
        wanted = LIMIT * (self.spec.multiple if multiple is None else multiple)

        def at(strength: float) -> float:
            return distance(
                self.bench, self._with((effect.name, {**shapes, effect.field: sign * strength}))
            )

        strength, _ = strength_for(wanted, at, effect.typical, effect.most)
        return self.judged(effect, {**shapes, effect.field: sign * strength}, fitted)

    def judged(
        self, effect: Hidden, fields: dict[str, float], fitted: bool = True
    ) -> dict[str, Any]:
        """What the oracle says of an effect with these fields; distances linear where not
        ``fitted``.
        """
        apart = self._apart(fitted, (effect.name, fields))
        own, withheld = (
            set(families(effect)),
            self.spec.kind == "withheld",
        )  # then anything that can be named is a rival
        asked = (
            [item.name for item in EFFECTS if item is not effect and families(item)]
            if withheld
            else effect.rivals
        )
        names = [
            name
            for name in asked
            if self.spec.rig in BY_NAME[name].rigs and not set(families(BY_NAME[name])) & own
        ]
        return _record(effect, fields, apart, apart.rivals(names, fitted))

    def _apart(self, fitted: bool, *named: tuple[str, dict[str, float]]) -> Apart:
        return Apart(self.plant, self.bench, self.commands, self._with(*named), fitted)

    def _unseen(self, effect: Hidden) -> dict[str, Any] | None:
        """An effect of typical strength that these logs do not show."""
        found = self.judged(effect, {**self._shapes(effect), effect.field: effect.typical})
        return found if found["distance"] < 0.5 * LIMIT else None

    def _ambiguous(self, effect: Hidden) -> dict[str, Any] | None:
        """An effect that these logs show but cannot tell from another family's (a fit in free run
        has to show it), as strong as it may be.
        """
        found = self._judged(effect, 2.0 * TWICE, fitted=False)
        nearest = min(found["rivals"].values(), default=np.inf)
        multiple = min(found["multiple"] * SO_NEAR * LIMIT / max(nearest, 1e-9), self.spec.multiple)
        if multiple < TWICE:
            return None
        strength = found["fields"][effect.field] * multiple / found["multiple"]
        found = self.judged(
            effect,
            {**found["fields"], effect.field: float(np.clip(strength, -effect.most, effect.most))},
        )
        return found if found["multiple"] >= TWICE and found.get("shown", np.inf) < LIMIT else None

    def _pair(self) -> list[dict[str, Any]]:
        """Two effects of which each is still seen where the other may take what it can."""
        first = self._judged(BY_NAME[self.spec.effects[0]])
        for name in self.spec.effects[1:]:
            second = self._judged(
                BY_NAME[name], float(np.exp(self.rng.uniform(np.log(4.0), np.log(40.0))))
            )
            a, b = (
                self.bench.white(self._with((item["name"], item["fields"])))
                for item in (first, second)
            )
            if (
                min(left(a, self.bench.nominal, [b]), left(b, self.bench.nominal, [a]))
                < TWICE * LIMIT
            ):
                continue
            both = self._apart(False, *((item["name"], item["fields"]) for item in (first, second)))
            if all(
                both.beside(law_of(item["name"], item["fields"])) >= TWICE * LIMIT
                for item in (first, second)
            ):
                return [first, second]
        raise Unfit(
            f"found no partner for {self.spec.effects[0]} among {', '.join(self.spec.effects[1:])},"
            " expected two that stand apart"
        )

    def _same_law(self, name: str) -> dict[str, Any]:
        """An effect of the catalogue, by the catalogue's own law."""
        effect, start = CATALOGUE[name], int(self.rng.integers(len(CATALOGUE[name].starts)))
        if name == "fill_heat":
            start = 1

        def at(share: float) -> float:
            return distance(self.bench, self._with((name, catalogue_fields(name, start, share))))

        share, _ = strength_for(LIMIT * self.spec.multiple, at, 1.0, 3.0)
        apart = self._apart(True, (name, catalogue_fields(name, start, share)))
        return {
            "name": name,
            "law": "the catalogue's own",
            "fields": catalogue_fields(name, start, share),
            "answers": [name],
            "families": [effect.family],
            "blocks": _blocks(effect) if self.spec.kind == "withheld" else [effect.block],
            **_said(apart),
            "rivals": {},
            "same_law": True,
        }


def _blocks(effect: Effect) -> list[str]:
    """Where a law of the catalogue sits for one who lacks its name: what the stand-in says of its
    family, else where its numbers show.
    """
    of_family = [
        block for item in EFFECTS if effect.family in families(item) for block in item.blocks
    ]
    shows_in = [
        block
        for start, blocks in SHOWS_IN.items()
        for block in blocks
        if any(key.startswith(start) for key in effect.knobs)
    ]
    return list(dict.fromkeys([effect.block, *of_family, *shows_in]))


def _said(apart: Apart) -> dict[str, float]:
    shown = {"shown": apart.shown} if np.isfinite(apart.shown) else {}
    return {
        "distance": apart.distance,
        "linear": apart.linear,
        "multiple": apart.distance / LIMIT,
        **shown,
    }


def _record(
    effect: Hidden, fields: dict[str, float], apart: Apart, rivals: dict[str, float]
) -> dict[str, Any]:
    return {
        "name": effect.name,
        "law": effect.law,
        "fields": fields,
        "answers": list(effect.answers),
        "families": list(families(effect)),
        "blocks": list(effect.blocks),
        **_said(apart),
        "rivals": rivals,
        "same_law": False,
    }

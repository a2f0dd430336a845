"""How probable a set of effects is before any data."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import comb, inf, log


@dataclass(frozen=True)
class Prior:
    """Sets of families share the odds of their size, laws of a family theirs.

    ``families``: of each effect of the catalogue. ``in_plant``: effects that the plant file has.
    They share their odds of another strength among themselves, whatever else is missing, and with
    no law of their families. ``measured``: healthy runs have measured the plant, so that its own
    effects change no more often than others set in.
    """

    families: Mapping[str, str]
    in_plant: Collection[str] = ()
    measured: bool = False

    def log(self, effects: Sequence[str], one: float, further: float) -> float:
        """Log odds of a set against none. ``one``: those of one effect of any family; ``further``:
        of one more.
        """
        lacking = [family for name, family in self.families.items() if name not in self.in_plant]
        others = [self.families[name] for name in effects if name not in self.in_plant]
        laws = sum(log(lacking.count(family)) for family in others)
        return sum(_odds(n, of, one, further) for n, of in self._pools(effects)) - laws

    def log_of_one_more(self, effects: Sequence[str], one: float, further: float) -> float:
        """What the odds grow by with one effect more, the most probable and alone in its family."""
        pools = [(n, of) for n, of in self._pools(effects) if n < of]
        steps = [_odds(n + 1, of, one, further) - _odds(n, of, one, further) for n, of in pools]
        return max(steps, default=-inf)

    def _pools(self, effects: Sequence[str]) -> list[tuple[int, int]]:
        """How many of a set, and of how many: of families, and of the plant file's own effects."""
        if self.measured:
            return [(len(effects), len(set(self.families.values())))]
        own = len([name for name in effects if name in self.in_plant])
        kinds = {family for name, family in self.families.items() if name not in self.in_plant}
        return [(len(effects) - own, len(kinds)), (own, len(self.in_plant))]


def _odds(count: int, of: int, one: float, further: float) -> float:
    """Log odds of one set of ``count`` of so many against none."""
    if not count:
        return 0.0
    if count > of:
        return -inf
    return one + (count - 1) * further - log(comb(of, count))

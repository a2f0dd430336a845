"""How probable a set of effects is before any data."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import comb, inf, log


@dataclass(frozen=True)
class Prior:
    """Sets of families share the odds of their size, laws of a family theirs.

    ``families``: of each effect of the catalogue. ``in_plant``: effects that the plant file has.
    Their strengths are guesses: they share the odds that one is wrong among themselves, each for
    itself, whatever else is missing. ``measured``: healthy runs have measured the plant, so that
    its own effects change no more often than others set in. Either way they share their families'
    odds with no other law.
    """

    families: Mapping[str, str]
    in_plant: Collection[str] = ()
    measured: bool = False

    def log_odds(self, effects: Sequence[str], further: float) -> float:
        """Of a set against none: a rig has an effect that its plant file lacks as often as not.
        ``further``: those of one more.
        """
        lacking = [family for name, family in self.families.items() if name not in self.in_plant]
        laws = sum(
            log(lacking.count(self.families[name])) for name in effects if name not in self.in_plant
        )
        size, of = self._of_families(effects)
        guessed = sum(self._of_guess() for name in effects if name in self._guessed)
        return _odds(size, of, further) + guessed - laws

    def log_of_one_more(self, effects: Sequence[str], further: float) -> float:
        """What the odds grow by with one effect more, the most probable and alone in its family."""
        size, of = self._of_families(effects)
        more = _odds(size + 1, of, further) - _odds(size, of, further)
        left = any(name not in effects for name in self._guessed)
        return max(more, self._of_guess()) if left else more

    @property
    def _guessed(self) -> Collection[str]:
        return () if self.measured else self.in_plant

    def _of_families(self, effects: Sequence[str]) -> tuple[int, int]:
        """How many of a set share the odds of its size, and of how many families."""
        guessed = self._guessed
        kinds = {family for name, family in self.families.items() if name not in guessed}
        return len([name for name in effects if name not in guessed]), len(kinds)

    def _of_guess(self) -> float:
        return -log(len(self.in_plant))


def _odds(count: int, of: int, further: float) -> float:
    """Log odds of one set of ``count`` of so many against none."""
    if not count:
        return 0.0
    if count > of:
        return -inf
    return (count - 1) * further - log(comb(of, count))

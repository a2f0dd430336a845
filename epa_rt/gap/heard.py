"""What free run says of the named effects, and what that counts for."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from epa_rt.gap.bars import BARS
from epa_rt.gap.further import most_of_one
from epa_rt.gap.refit import Fit
from epa_rt.gap.rules import Rules

# of a gap: what one right law in other words may leave of it where no second one was found (right
# ones of two sets with a gap above 1000 0.0063 at most or 30, wrong ones 0.0096 and more)
MOST_OF_ONE = 0.0075
# of a gap: what a right law in other words may leave of it (stirred gas beside creep 0.01005; wrong
# ones 0.017 and more)
CLOSELY = 0.013
THIRD = 1.0 / 3.0  # of a gap: a name that leaves more is not trusted at all
USUAL = (
    Rules.noise
)  # chi-square in free run that the method leaves of rigs without a gap at most (3 to 25)
CHANCE = 4.0  # that chance gains with a number or two
# chi-square in free run that an effect must take off where nothing else speaks for it than a
# believed gain in its blocks
HELPED = Rules.helps


class Beside(NamedTuple):
    """Chi-square in free run by which a law is behind the one in whose place it was tried, all
    others as they were then, and whether that tells them apart.
    """

    behind: float
    told: bool


@dataclass(frozen=True)
class Heard:
    """``gap``, ``left``: chi-square above noise and steps in free run without effects and with
    those named, nominal parameters fitted in both; ``strain``: what the latter cost with those
    named, in squares of spreads. ``beside``: by named effect what was tried in its place.
    ``as_well``: by effect that was found there what explains it as well there. ``alone``: whether
    one effect is named. ``refitted``: nominal parameters without effects, fitted to blocks and free
    run together like those with the named ones; None where these do not carry the whole plant.
    ``tied``: what was tried in the place of the only named one and free run puts nothing between.
    ``one_form``: whether what is named can hardly have another form, ``exact``: whether it cannot
    (forms.py). ``bare``: nominal parameters without effects, fitted to free run alone. ``pressed``:
    numbers of the named ones that want to go on from where their law ends, and where that is
    (law_ends.py).
    """

    gap: float
    left: float
    strain: float
    beside: Mapping[str, Mapping[str, Beside]]
    as_well: Mapping[str, tuple[Fit, ...]]
    alone: bool = False
    refitted: Mapping[str, float] | None = None
    tied: frozenset[str] = frozenset()
    one_form: bool = False
    exact: bool = False
    bare: Mapping[str, float] = field(default_factory=dict)
    pressed: Mapping[str, float] = field(default_factory=dict)

    def apart_from(self, named: str) -> frozenset[str]:
        """Effects that free run tells from a named one."""
        return frozenset(law for law, one in self.beside.get(named, {}).items() if one.told)

    @property
    def told_apart(self) -> tuple[str, ...]:
        """All that it tells from the named ones, in whichever's place they were tried."""
        laws = {law for named in self.beside for law in self.apart_from(named)}
        return tuple(
            sorted(
                law
                for law in laws
                if all(tried[law].told for tried in self.beside.values() if law in tried)
            )
        )

    @property
    def part(self) -> float | None:
        """Of the gap that the named effects explain; None where free run shows none, or neither
        that they explain it nor that they do not.
        """
        silent = self.gap <= Rules.first or (self.little and self.gap - self.left <= Rules.first)
        return None if silent else 1.0 - max(self.left - USUAL, 0.0) / self.gap

    @property
    def little(self) -> bool:
        """Whether too little is left to be missing: no more than rigs without a gap leave, or
        little more and less than a third of the gap (39 of 84: a held-back flow named for a gauge's
        scale).
        """
        return self.left <= max(USUAL, min(BARS.little_left, THIRD * self.gap))

    @property
    def shows(self) -> bool:
        """Whether there is a gap whatever the blocks say."""
        return self.gap > BARS.shows

    @property
    def large(self) -> bool:
        """Whether the whole plant has a gap worth the word without the effects."""
        return self.gap > 10.0 * USUAL

    @property
    def too_much_left(self) -> bool:
        """Whether more of a small gap is left than a right law in other words leaves of it; of a
        larger one, where one law is named: two leave more. Where no other words are possible it is
        no more than what the method leaves, whatever the gap.
        """
        if self.part is None or self.little:
            return False
        return (
            self.gap < BARS.shapeless
            or (self.alone and self.left > most_of_one(self.gap, MOST_OF_ONE))
            or (self.one_form and self.left > Rules().anothers)
        )

    @property
    def carried(self) -> bool:
        """Whether the named effects carry the whole plant, or it has no gap to carry."""
        return self.counted is None or (self.counted >= BARS.carried and not self.too_much_left)

    @property
    def asks_for_one(self) -> bool:
        """Whether one law by itself is looked for: nothing that is named carries the plant, or two
        do and leave more than one right law would, for they may both stand for another one (a
        joint's zero of 0.08 rad: a braid that locks and a leaning frame left 449 of 5508, the zero
        alone 8).
        """
        return self.shows and not (self.carried and (self.alone or self.left <= USUAL))

    @property
    def supports(self) -> bool:
        """Whether the whole plant is any better with the effects than without."""
        return self.gap - self.left > CHANCE

    @property
    def leaves_more(self) -> bool:
        """Whether the whole plant is further off with the effects than rigs without a gap are: of
        66 right answers of the tenth set 63 left 21 at most, three 31 to 95, and of three wrong
        names two 31 and 52, whatever part of the gap that is.
        """
        return self.left > USUAL

    @property
    def helps(self) -> bool:
        """Whether the whole plant is plainly better with the effects, and little of what is missing
        stays: a faint effect that blocks and free run agree on (zeros of a quiet knee's force cell:
        28 to 9, 40 to 9; rigs without a gap show 0 to 16, and nothing that takes more than chance
        off it).
        """
        return self.gap - self.left > HELPED and self.left < max(0.5 * self.gap, USUAL)

    @property
    def to_noise(self) -> bool:
        """Whether the whole plant has a gap worth the word without the effects, and with them none
        that is told from the method's own.
        """
        return self.left <= USUAL and self.large

    @property
    def borne(self) -> bool:
        """Whether the effects carry the whole plant with nominal parameters that a plant file may
        have. A right law in other words leaves something of a large gap: a knee's friction at 42
        limits 367 of 84 053 (of the names that two sets refused for their parameters all others
        left 0.017 of it and more).
        """
        return self.left <= max(Rules.stays, CLOSELY * self.gap) and self.strain <= BARS.strain

    @property
    def proves(self) -> bool:
        """Whether the effects explain a large gap with nominal parameters that a plant file may
        have. A drift of 10 N of a knee's force cell had zero within its interval by blocks, and
        took 2669 of 2725 in free run.
        """
        return self.large and self.carried and self.borne

    @property
    def counted(self) -> float | None:
        """The same as a verdict counts it: where too little stays to be missing, they explain
        it.
        """
        return 1.0 if self.part is not None and self.little else self.part

"""When free run decides, and what a fit of the whole plant leaves and costs."""

from dataclasses import dataclass

from epa_rt.gap.point import Point


@dataclass(frozen=True)
class Rules:
    """When free run decides; the figures are from the development cases.

    ``better``: chi-square by which a law is ahead, and ``part`` of what the best one explains: no
    law is the rig's own. ``near``: of the best law's gain block by block, from which a law is
    tried; ``tries``: at most as many for each effect, and ``kin`` of its own family, each like
    itself also in ``shapes`` of those from which its fits begin (creep of a braid that blocks had
    taken for half a second's: 53 of 5636 left, from ten milliseconds 29). ``stays``: chi-square
    above noise and steps (rigs without a gap leave 3 to 25), and ``rest`` of what there is without
    effects, from which something is missing: the right law in other words left up to 0.02 of it;
    what nominal parameters cannot bear is missing whatever part it is; ``first``: the same where
    nothing is named (60 rigs without a gap of five sets showed 18 at most, missed effects at twice
    their limit and more 45 to 73), and ``faint``: where what is looked for takes at least ``helps``
    and no other law does half as much (a drift of the force cell at 2.3 limits: 29, of which the
    drift takes 16, the next law 5). ``most``: of that which a further effect must explain, and
    ``gained`` at least, or ``better`` of a second one in another block that takes the plant to the
    noise and of which no other law does ``half`` (a current's scale 33 of 46, the next law 3), and
    of what a law leaves, below which another of its family takes its place; ``never``: of the gap,
    of which a twelfth is the most that all names together may leave: a last law that leaves more is
    not gone on with; ``together``: effects from which free run looks for no other, for what takes a
    third one that no block shows is rather one that is not in the catalogue; ``screened``: families
    that are fitted for it, ``rough``: as ``near``, of a fit with derivatives kept from before (a
    soft regulator that leaves 27 had left 84). ``plain``: gain from which it is named however weak
    it is. ``noise``: chi-square above noise that one law leaves at most, and another twice that at
    least, where 5 % count for nothing if the first has no more numbers than the other: it is the
    rig's own to the noise. ``tied``: chi-square by which a law that is behind in free run is not
    told apart there (two kinds of friction under one small sine lie 2 to 5 apart, laws that logs
    tell apart 10 and more).
    """

    better: float = 25.0
    part: float = 0.05
    near: float = 0.8
    tries: int = 4
    kin: int = 2
    shapes: int = 2
    stays: float = 60.0
    first: float = 40.0
    faint: float = 25.0
    helps: float = 15.0
    rest: float = 0.025
    most: float = 0.5
    never: float = 0.25
    together: int = 2
    gained: float = 40.0
    screened: int = 4
    rough: float = 0.4
    plain: float = 1e3
    noise: float = 25.0
    tied: float = 7.0
    half: float = 0.5

    @property
    def anothers(self) -> float:
        """Chi-square above noise from which it is not what a law leaves that is the rig's own to
        the noise.
        """
        return 2.0 * self.noise

    def margin(self, none: Point, best: Point) -> float:
        """Chi-square by which a law must be ahead of another, where ``best`` explains what it does
        of ``none``.
        """
        return max(self.better, self.part * (none.normal.chi - best.normal.chi))

    def told(self, none: Point, best: Point, chi: float, noise: float, plain: bool) -> bool:
        """Whether a law that leaves ``chi`` is told from the best one. ``noise``: chi-square that
        noise and steps alone leave. ``plain``: whether the best one has no more numbers than the
        other.

        A spring of the knee left 14 of 57 088 over both ends of its range, a leaning frame 85.
        """
        to_noise = plain and above(best, noise) <= self.noise and chi - noise > self.anothers
        return to_noise or chi - best.normal.chi > self.margin(none, best)

    def in_its_place(self, best: Point, other: Point, noise: float) -> bool:
        """Whether another law of the best one's own family takes its place: the name is as right,
        and what it leaves is what a second effect is looked for in. Slip in elements left 92 of 86
        286 and a weight on the shin beside it 48; a Preisach braid 513, and nothing was found
        beside it.
        """
        return best.normal.chi - other.normal.chi > self.better and above(
            other, noise
        ) < self.half * above(best, noise)


def strain(point: Point) -> float:
    """What nominal parameters cost, in squares of spreads: more than plant files do where they
    stand for something.
    """
    return float(point.normal.prior @ point.normal.z**2)


def above(point: Point, noise: float) -> float:
    """Chi-square above what noise and steps alone leave."""
    return max(point.normal.chi - noise, 0.0)

"""The verdict: from what was found, what is left, and what the logs could have shown at all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from epa_rt.gap.bars import BARS, Bars
from epa_rt.gap.coverage import Coverage
from epa_rt.gap.diagnosis import Verdict


@dataclass(frozen=True)
class Evidence:
    """What a verdict hangs on. ``gap``: any link has one. ``ambiguous``: an effect cannot be told
    from one of another family. ``untested``: part of the catalogue that the logs could not have
    shown. ``odd``: a nominal parameter is beyond belief and hides more than the effects explain.
    ``whole``: part of the gap in free run that the effects explain, None where it shows none.
    ``lost``: chi-square above noise in free run where no effect is named, None where one is or the
    rig has no model of the whole. ``to_noise``: with the effects the whole plant follows its
    commands to the noise, whatever a block still shows (dry friction of a knee: 2933 to 9, and half
    of the gap in its acceleration). ``too_much_left``: more of the gap is left there than a right
    law leaves of it. ``groundless``: names that are hardly ever first, and the whole plant is no
    better with them. ``exact``: what the names explain of the links that they have to do with,
    where each is a zero, a scale or a shift in time of a reading or a command. ``breaks``: links
    that agreed no longer do with the effects on. ``elsewhere``: other links have a gap of which
    they explain nothing. ``helps``: with them the whole plant is better by more than chance.
    ``trust``: what the names' confidence counts, from what they leave of what the verdict counts.
    """

    gap: bool
    effects: Sequence[str]
    found: Coverage
    ambiguous: bool = False
    untested: float = 0.0
    odd: bool = False
    whole: float | None = None
    lost: float | None = None
    to_noise: bool = False
    breaks: bool = False
    elsewhere: bool = False
    helps: bool = False
    trust: float = 1.0
    too_much_left: bool = False
    groundless: bool = False
    exact: Coverage | None = None

    def incredible(self, bars: Bars) -> bool:
        """Whether the whole plant has a gap, and the effects leave so much of what the blocks or it
        show that nothing is left of their confidence; not where it follows its commands to the
        noise (an encoder's wobble and a current's scale, 2 119 647 to 21 there, left 42 % of what
        the blocks show).
        """
        return (
            bool(self.effects)
            and self.whole is not None
            and self.trust < bars.no_trust
            and not self.to_noise
        )

    def other_form(self, bars: Bars) -> bool:
        """Whether names that can have one form alone leave something in the blocks that they have
        to do with: then it is another thing that looks like it.
        """
        return (
            self.exact is not None
            and self.exact.part < bars.exact
            and self.exact.left > bars.trifle
        )

    def little(self, bars: Bars) -> bool:
        """Whether the effects explain too little of what the blocks show to be the cause, and
        nothing else speaks for them.
        """
        faint = (
            self.helps and self.whole is None and self.found.left < bars.trifle
        )  # too little for the blocks' bars, and both agree on what it is
        alone = (
            not self.gap and self.whole is not None and self.whole >= bars.carried
        )  # no block has a gap that could be left: free run's word counts
        return (
            not self.to_noise
            and not faint
            and not alone
            and (self.found.part < bars.covered or self.found.least < bars.covered_link)
        )


def decided(of: Evidence, bars: Bars = BARS) -> Verdict:
    """The verdict on the evidence."""
    if (
        of.odd
        or (of.effects and of.breaks and not of.to_noise)
        or (of.effects and of.whole is not None and of.whole < bars.carried)
    ):
        return "not_in_catalogue"
    if (
        of.incredible(bars)
        or of.too_much_left
        or of.other_form(bars)
        or (of.lost is not None and of.lost > bars.shows)
    ):
        return "not_in_catalogue"
    if not of.effects or of.groundless:
        return (
            "not_in_catalogue"
            if of.gap
            else "not_excited"
            if of.untested > bars.mostly
            else "no_gap"
        )
    if of.little(bars):
        if of.found.left < bars.trifle and of.whole is None:
            return "no_gap"
        if of.found.left > bars.trifle or of.whole is None:
            return "not_in_catalogue"
    if of.ambiguous:
        return "not_separable"
    much = of.found.left < bars.small or (of.found.part > bars.whole and of.found.left < bars.few)
    return "explained" if much and not of.elsewhere else "partly_explained"


def untested(
    typical: Mapping[str, float], names: Sequence[str], bars: Bars = BARS
) -> tuple[str, ...]:
    """Effects of which a typical strength would have stayed below detection, nominal parameters
    projected out.
    """
    return tuple(name for name in names if typical.get(name, 0.0) < bars.tested)


def informed(
    links: Mapping[str, Sequence[str]], silent: Sequence[str], bars: Bars = BARS
) -> tuple[str, ...]:
    """Links that these logs can judge. ``links``: to the effects that touch each; ``silent``:
    effects that were not tested.
    """
    return tuple(
        name for name, own in links.items() if len(set(own) & set(silent)) <= bars.mostly * len(own)
    )

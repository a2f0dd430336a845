"""The verdict: from what was found, what is left, and what the logs could have shown at all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.bars import BARS, Bars
from epa_rt.gap.coverage import Coverage
from epa_rt.gap.diagnosis import Number, Verdict


@dataclass(frozen=True)
class Evidence:
    """What a verdict hangs on. ``gap``: any link has one. ``ambiguous``: an effect cannot be told from one of another family. ``untested``: part of
    the catalogue that the logs could not have shown. ``odd``: a nominal parameter is beyond
    belief and hides more than the effects explain. ``whole``: part of the gap in free run that the effects explain, None where it shows none.
    ``lost``: chi-square above noise in free run where no effect is named, None where one is or the rig has no model of the whole. ``to_noise``: with the
    effects the whole plant follows its commands to the noise, whatever a block still shows (dry friction of a knee: 2933 to 9, and half of the gap in its acceleration).
    ``too_much_left``: more of the gap is left there than a right law leaves of it. ``groundless``: names that are hardly ever first, and the whole plant is no better with them. ``exact``: what the names explain of the links that they have to do with, where each is a zero, a scale or a shift in time of a reading or a command. ``breaks``: links that agreed no longer do with the effects on. ``elsewhere``: other links have a gap of which they explain nothing. ``helps``: with them the
    whole plant is better by more than chance. ``trust``: what the names' confidence counts, from what they leave of what the verdict counts."""

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
        """Whether the whole plant has a gap, and the effects leave so much of what the blocks or it show that nothing is left of their confidence; not where it
        follows its commands to the noise (an encoder's wobble and a current's scale, 2 119 647 to 21 there, left 42 % of what the blocks show)."""
        return bool(self.effects) and self.whole is not None and self.trust < bars.no_trust and not self.to_noise

    def other_form(self, bars: Bars) -> bool:
        """Whether names that can have one form alone leave something in the blocks that they have to do with: then it is another thing that looks like it."""
        return self.exact is not None and self.exact.part < bars.exact and self.exact.left > bars.trifle

    def little(self, bars: Bars) -> bool:
        """Whether the effects explain too little of what the blocks show to be the cause, and nothing else speaks for them."""
        faint = self.helps and self.whole is None and self.found.left < bars.trifle  # too little for the blocks' bars, and both agree on what it is
        alone = not self.gap and self.whole is not None and self.whole >= bars.carried  # no block has a gap that could be left: free run's word counts
        return not self.to_noise and not faint and not alone and (self.found.part < bars.covered or self.found.least < bars.covered_link)


def decided(of: Evidence, bars: Bars = BARS) -> Verdict:
    """The verdict on the evidence."""
    if of.odd or (of.effects and of.breaks and not of.to_noise) or (of.effects and of.whole is not None and of.whole < bars.carried):
        return "not_in_catalogue"
    if of.incredible(bars) or of.too_much_left or of.other_form(bars) or (of.lost is not None and of.lost > bars.shows):
        return "not_in_catalogue"
    if not of.effects or of.groundless:
        return "not_in_catalogue" if of.gap else "not_excited" if of.untested > bars.mostly else "no_gap"
    if of.little(bars):
        if of.found.left < bars.trifle and of.whole is None:
            return "no_gap"
        if of.found.left > bars.trifle or of.whole is None:
            return "not_in_catalogue"
    if of.ambiguous:
        return "not_separable"
    much = of.found.left < bars.small or (of.found.part > bars.whole and of.found.left < bars.few)
    return "explained" if much and not of.elsewhere else "partly_explained"


def untested(typical: Mapping[str, float], names: Sequence[str], bars: Bars = BARS) -> tuple[str, ...]:
    """Effects of which a typical strength would have stayed below detection, nominal parameters projected out."""
    return tuple(name for name in names if typical.get(name, 0.0) < bars.tested)


def informed(links: Mapping[str, Sequence[str]], silent: Sequence[str], bars: Bars = BARS) -> tuple[str, ...]:
    """Links that these logs can judge. ``links``: to the effects that touch each; ``silent``: effects that were not tested."""
    return tuple(name for name, own in links.items() if len(set(own) & set(silent)) <= bars.mostly * len(own))


def said(verdict: Verdict, effects: Sequence[str], sets: Sequence[Sequence[str]], links: Sequence[str], part: float, not_tested: int, of: int,
         odd: Sequence[str] = (), whole: float | None = None, lost: float | None = None, breaks: Sequence[str] = (), faint: tuple[float, float] | None = None,
         over: tuple[float, float] | None = None, other_form: Coverage | None = None, ends: Sequence[str] = ()) -> str:
    """The verdict in one or two sentences. ``faint``: chi-square in free run before and after, where little else speaks for the names; ``over``: where too much of the gap stays;
    ``other_form``: what names that have one form explain in the blocks, where they leave something; ``ends``: numbers of the nearest law, with value and unit, that want to go on
    from where it ends."""
    names, (explain, them) = " and ".join(effects), ("explain", "them") if len(effects) > 1 else ("explains", "it")
    where = ", ".join(links)
    if verdict == "no_gap":
        return f"Nothing is left beyond the noise floor once the nominal parameters are refitted; {of - not_tested} of {of} effects would have shown at a typical strength."
    if verdict == "not_excited":
        return f"No gap shows, but these logs could not have shown {not_tested} of {of} effects at a typical strength."
    if verdict == "not_in_catalogue" and ends:
        return f"What comes nearest ({names}) does so only with {', '.join(ends)}, where its law ends, and would go on from there: " \
               "something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and odd and not where:
        return f"These logs only agree with the plant at values of {', '.join(odd)} that nobody believes: something like it is missing, " \
               "and no effect of the catalogue explains it better."
    if verdict == "not_in_catalogue" and odd:
        return f"There is a gap in {where}; what comes nearest explains it only with values of {', '.join(odd)} that nobody believes."
    if verdict == "not_in_catalogue" and effects and breaks:
        return f"{names} {explain} {_percent(part)} of what the blocks show one by one, but with {them} {', '.join(breaks)} no longer agrees with the plant, as it did before: " \
               "something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and effects and whole is not None and whole < BARS.carried:
        return f"{names} {explain} {_percent(part)} of what the blocks show one by one, but in free run {_percent(whole)} of the gap: " \
               "something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and effects and over is not None:
        return f"What comes nearest ({names}) leaves in free run a chi-square of {over[1]:.0f} of {over[0]:.0f} above the noise, more than a right law leaves of such " \
               "a gap: something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and effects and other_form:
        return f"The nearest ({names}) {'leave' if len(effects) > 1 else 'leaves'} {_percent(1.0 - other_form.part)} of the gap that the blocks show. A zero, a scale or a delay of a reading or a " \
               "command has one formula, so that the right one would leave nothing: something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and effects and whole is not None and part < BARS.covered:
        return f"{names} {explain} {_percent(whole)} of the gap in free run, but only {_percent(part)} of what the blocks show one by one: " \
               "something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and not where and lost is not None:
        return f"The blocks one by one show no gap, but from its commands alone the plant does not follow the rig (chi-square {lost:.0f} above its noise): " \
               "something is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue":
        return f"There is a gap in {where or 'the residual'}, and no effect of the catalogue explains it."
    if where and whole is not None and part < BARS.covered and verdict in ("explained", "partly_explained"):
        return f"{names} {explain} {_percent(whole)} of the gap in free run, from commands to readings; one by one the blocks still show something in {where}."
    if faint is not None and verdict in ("explained", "partly_explained"):
        return f"{names}: faint, but the blocks' fits and free run agree on it (chi-square {faint[0]:.0f} to {faint[1]:.0f} above its noise)."
    if not where and whole is not None and effects and verdict != "not_separable":
        return f"{names} {explain} {_percent(whole)} of the gap in free run; the blocks one by one show it too faintly to say where."
    if verdict == "not_separable":
        return f"{names} {explain} {_percent(part)} of what can be explained in {where or 'the residual'}; this data cannot tell it from " \
               f"{'; '.join(', '.join(s) for s in sets if s)}."
    if verdict == "partly_explained":
        return f"{names} {explain} {_percent(part)} of what can be explained in {where or 'the residual'}; the rest is described by data alone."
    return f"{names} {explain} {_percent(part)} of what can be explained in {where or 'the residual'}."


def _percent(part: float) -> str:
    return f"{100.0 * float(np.clip(part, 0.0, 1.0)):.0f} %"


def said_of_moved(moved: Sequence[Number]) -> str:
    """What hides in the plant file's own numbers where nothing else shows."""
    numbers = ", ".join(f"{one.name} to {one.value:.3g} {one.unit} (plant file: {one.neutral:.3g})" for one in moved)
    return f"For that these went further from the plant file than it should be wrong: {numbers}."

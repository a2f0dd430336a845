"""The verdict: from what was found, what is left, and what the logs could have shown at all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.diagnosis import Verdict
from epa_rt.gap.yardstick import Left


@dataclass(frozen=True)
class Bars:
    """Where one verdict ends and the next begins; the figures are from the development cases.

    ``gap``: explainable chi-square per sample from which a link has a gap worth a word, however many samples prove it;
    ``sure``: the same summed over its samples, so that few samples do not invent one. ``predictable``: part of a link's excess
    over the floor that the effects or the generic model must foresee on data left out; less is noise that the floor does not know.
    ``alone``: chi-square per sample below which the generic model's word alone is no gap: the torque balances of gap-free stand-in
    rigs reach it. ``noise``: chi-square per sample that the method itself may leave of a rig without a gap. ``covered``: part of the excess
    over that which the effects must explain to be the cause, over all links and (``covered_link``) in each that has at
    least ``major`` of the excess; ``carried``: the same of the gap in free run. ``trifle``: what stays over the noise without being a gap. They are all of it where no more
    than ``small`` is left over the noise, or where they explain ``whole`` of the excess and leave less than ``few``, three
    times the floor: another formula of the right physics leaves that much of a large gap, and the simulation then serves; at
    ten times the floor something real is missing, whatever part it is of the gap. ``tested``: expected chi-square of an effect of
    typical strength below which the logs could not have shown it. ``mostly``: part of the catalogue not tested from which
    silence means nothing, and so does the residual of a link of whose effects that many were not tested. ``belief``: spreads
    beyond which a nominal parameter is a gap of its own: no plant file is that wrong, so it stands for something else
    (experiments of little motion alone move some by 8); ``belief_named``: the same with effects on, which leave those of little motion
    where they were. ``strain``: sum of squares of all nominal parameters' distances in spreads from which the named effects stand for something
    else: right names of the spent sets left 5 to 30, wrong or incomplete ones mostly 42 to 1000; what was further off than ``own`` without them and stays there
    is the plant file's own error and does not count. ``shows``: chi-square in free run, where no effect is named, from which there is a gap
    whatever the links say (gap-free rigs leave 3 to 28, weak effects up to 53, pressures that no noise dithers once 126). ``quiet``: chi-square per
    sample that 14 gap-free rigs left (1.25 in the load's link, less in all others); ``strict``: how many times what is left counts against a name's confidence.
    ``breaks``: chi-square per sample by which a link that was content may grow with the effects on; ``touched``: part of a link's excess of which effects must
    explain more to have to do with it.
    """

    gap: float = 0.05
    sure: float = 300.0
    predictable: float = 0.2
    alone: float = 1.6
    noise: float = 1.4
    covered: float = 0.7
    covered_link: float = 0.65
    carried: float = 0.93
    major: float = 0.1
    trifle: float = 0.5
    whole: float = 0.9
    few: float = 8.0
    small: float = 1.0
    tested: float = 40.0
    mostly: float = 0.6
    belief: float = 12.0
    belief_named: float = 6.0
    strain: float = 40.0
    own: float = 3.0
    shows: float = 200.0
    quiet: float = 1.2
    strict: float = 3.0
    breaks: float = 1.0
    touched: float = 0.3


BARS = Bars()


@dataclass(frozen=True)
class Coverage:
    """``part`` of the excess over the noise that the effects explain, over all links; ``least``: the smallest part in a link
    that has much of it and keeps more than a trifle; ``left``: the largest chi-square per sample over the noise that stays in any of those."""

    part: float
    least: float
    left: float


def gaps(before: Left, after: Left, bars: Bars = BARS) -> tuple[str, ...]:
    """Links with a residual that the generic model or the effects explain beyond a trifle, the largest first."""
    most = {name: _most(before, after, name, bars) for name in before.links}
    sums = {name: before.links[name].samples * part for name, part in most.items()
            if part > max(bars.gap, bars.predictable * (before.links[name].before - 1.0))}
    return tuple(sorted((name for name in sums if sums[name] > bars.sure), key=lambda name: -sums[name]))


def _most(before: Left, after: Left, name: str, bars: Bars) -> float:
    """Chi-square per sample of a link that could be explained, by the better of three yardsticks.

    The generic model at the start may know less than the effects do; then what it still finds after them counts. Its word
    alone is none where the link is no further off than the method itself may be.
    """
    first, last = before.links[name], after.links[name]
    if first.before < bars.alone:
        return max(first.before - max(last.before, 1.0), 0.0)
    return max(first.before - max(min(first.after, last.after, last.before), 1.0), 0.0)


def coverage(before: Left, after: Left, bars: Bars = BARS) -> Coverage:
    """What the effects explain of all that lies above the noise, whether or not the generic model could."""
    excess, stays = _over(before, bars.noise), _over(after, bars.noise)
    total = sum(excess.values())
    if total <= 0.0:
        return Coverage(1.0, 1.0, 0.0)
    major = [name for name, amount in excess.items() if amount > bars.major * total]
    seen = [name for name in major if after.links[name].before - bars.noise > bars.trifle]
    return Coverage(1.0 - sum(stays.values()) / total, min((1.0 - stays[name] / excess[name] for name in seen), default=1.0),
                    max(after.links[name].before - bars.noise for name in major))


def trust(before: Left, after: Left, whole: float | None = None, bars: Bars = BARS) -> float:
    """What a name's confidence counts: all where its effects leave no more than gap-free rigs do, nothing where they leave a third of the gap.

    The right law in other words leaves a few percent, a wrong one that comes near leaves more. ``whole``: part of the gap in free run
    that they explain, which counts likewise, and alone where no link keeps more than a trifle; None where it shows none.
    """
    excess, stays = sum(_over(before, bars.quiet).values()), sum(_over(after, bars.quiet).values())
    alone = 1.0 - bars.strict * stays / excess if excess > 0.0 else 1.0
    if whole is not None and all(fit.before - bars.quiet < bars.trifle for fit in after.links.values()):
        alone = 1.0
    return float(np.clip(alone, 0.0, 1.0) * np.clip(1.0 - bars.strict * (1.0 - (1.0 if whole is None else whole)), 0.0, 1.0))


def broken(before: Left, after: Left, bars: Bars = BARS) -> tuple[str, ...]:
    """Links that agreed with the plant and no longer do with the effects on, the worst first: a right law breaks none."""
    grown = {name: after.links[name].before - max(fit.before, 1.0) for name, fit in before.links.items() if fit.before < bars.noise}
    return tuple(sorted((name for name, by in grown.items() if by > bars.breaks and by * before.links[name].samples > bars.sure), key=lambda name: -grown[name]))


def passed_over(before: Left, after: Left, bars: Bars = BARS) -> tuple[str, ...]:
    """Links with a gap of which the effects explain next to nothing: there is a second cause, or another one for both."""
    excess = {name: before.links[name].before - bars.noise for name in gaps(before, after, bars)}
    return tuple(name for name, over in excess.items() if over > bars.trifle and after.links[name].before - bars.noise > (1.0 - bars.touched) * over)


def above_noise(left: Left, scale: Mapping[str, float], bars: Bars = BARS) -> float:
    """Chi-square over all links, in units of ``scale``, above what the method itself may leave."""
    return sum(amount / scale[name] ** 2 for name, amount in _over(left, bars.noise).items() if name in scale)


def _over(left: Left, noise: float) -> dict[str, float]:
    """Chi-square of every link above ``noise`` per sample."""
    return {name: fit.samples * max(fit.before - noise, 0.0) for name, fit in left.links.items()}


def decided(gap: bool, effects: Sequence[str], found: Coverage, ambiguous: bool, untested: float, odd: bool = False,
            whole: float | None = None, lost: float | None = None, to_noise: bool = False, breaks: bool = False, elsewhere: bool = False, bars: Bars = BARS) -> Verdict:
    """``gap``: any link has one. ``ambiguous``: an effect cannot be told from one of another family. ``untested``: part of
    the catalogue that the logs could not have shown. ``odd``: a nominal parameter is beyond
    belief and hides more than the effects explain. ``whole``: part of the gap in free run that the effects explain, None where it shows none.
    ``lost``: chi-square above noise in free run where no effect is named, None where one is or the rig has no model of the whole. ``to_noise``: with the
    effects the whole plant follows its commands to the noise, whatever a block still shows (dry friction of a knee: 2933 to 9, and half of the gap in its acceleration). ``breaks``: links that agreed no longer do with the
    effects on. ``elsewhere``: other links have a gap of which they explain nothing."""
    if odd or (effects and breaks and not to_noise) or (effects and whole is not None and whole < bars.carried):
        return "not_in_catalogue"
    if lost is not None and lost > bars.shows:
        return "not_in_catalogue"
    little = not to_noise and (found.part < bars.covered or found.least < bars.covered_link)
    if not gap and not effects:
        return "not_excited" if untested > bars.mostly else "no_gap"
    if effects and little and found.left < bars.trifle and whole is None:
        return "no_gap"
    if not effects or (little and (found.left > bars.trifle or whole is None)):
        return "not_in_catalogue"
    if ambiguous:
        return "not_separable"
    much = found.left < bars.small or (found.part > bars.whole and found.left < bars.few)
    return "explained" if much and not elsewhere else "partly_explained"


def untested(typical: Mapping[str, float], names: Sequence[str], bars: Bars = BARS) -> tuple[str, ...]:
    """Effects of which a typical strength would have stayed below detection, nominal parameters projected out."""
    return tuple(name for name in names if typical.get(name, 0.0) < bars.tested)


def informed(links: Mapping[str, Sequence[str]], silent: Sequence[str], bars: Bars = BARS) -> tuple[str, ...]:
    """Links that these logs can judge. ``links``: to the effects that touch each; ``silent``: effects that were not tested."""
    return tuple(name for name, own in links.items() if own and len(set(own) & set(silent)) <= bars.mostly * len(own))


def said(verdict: Verdict, effects: Sequence[str], sets: Sequence[Sequence[str]], links: Sequence[str], part: float, not_tested: int, of: int,
         odd: Sequence[str] = (), whole: float | None = None, lost: float | None = None, breaks: Sequence[str] = ()) -> str:
    """The verdict in one or two sentences."""
    names = " and ".join(effects)
    where = ", ".join(links)
    if verdict == "no_gap":
        return f"Nothing is left beyond the noise floor once the nominal parameters are refitted; {of - not_tested} of {of} effects would have shown."
    if verdict == "not_excited":
        return f"No gap shows, but these logs could not have shown {not_tested} of {of} effects at a typical strength."
    if verdict == "not_in_catalogue" and odd and not where:
        return f"These logs only agree with the plant at values of {', '.join(odd)} that nobody believes: something like it is missing, " \
               "and no effect of the catalogue explains it better."
    if verdict == "not_in_catalogue" and odd:
        return f"There is a gap in {where}; what comes nearest explains it only with values of {', '.join(odd)} that nobody believes."
    if verdict == "not_in_catalogue" and effects and breaks:
        return f"{names} explains {_percent(part)} of what the blocks show one by one, but with it {', '.join(breaks)} no longer agrees with the plant, as it did before: " \
               "something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and effects and whole is not None and whole < BARS.carried:
        return f"{names} explains {_percent(part)} of what the blocks show one by one, but in free run {_percent(whole)} of the gap: " \
               "something else is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue" and not where and lost is not None:
        return f"The blocks one by one show no gap, but from its commands alone the plant does not follow the rig (chi-square {lost:.0f} above its noise): " \
               "something is missing, and no effect of the catalogue explains it."
    if verdict == "not_in_catalogue":
        return f"There is a gap in {where or 'the residual'}, and no effect of the catalogue explains it."
    if where and whole is not None and part < BARS.covered and verdict in ("explained", "partly_explained"):
        return f"{names} explains {_percent(whole)} of the gap in free run, from commands to readings; one by one the blocks still show something in {where}."
    if not where and whole is not None and effects and verdict != "not_separable":
        return f"{names} explains {_percent(whole)} of the gap in free run; the blocks one by one show it too faintly to say where."
    if verdict == "not_separable":
        return f"{names} explains {_percent(part)} of what can be explained in {where}; this data cannot tell it from " \
               f"{'; '.join(', '.join(s) for s in sets if s)}."
    if verdict == "partly_explained":
        return f"{names} explains {_percent(part)} of what can be explained in {where}; the rest is described by data alone."
    return f"{names} explains {_percent(part)} of what can be explained in {where or 'the residual'}."


def _percent(part: float) -> str:
    return f"{100.0 * float(np.clip(part, 0.0, 1.0)):.0f} %"

"""What effects explain of the gap, link by link: how much, what they leave, what they break, what
they pass over.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from epa_rt.gap.bars import BARS, Bars
from epa_rt.gap.yardstick import Left


@dataclass(frozen=True)
class Coverage:
    """``part`` of the excess over the noise that the effects explain, over all links; ``least``:
    the smallest part in a link that has much of it and keeps more than a trifle; ``left``: the
    largest chi-square per sample over the noise that stays in any of those.
    """

    part: float
    least: float
    left: float


def gaps(before: Left, after: Left, bars: Bars = BARS) -> tuple[str, ...]:
    """Links with a residual that the generic model or the effects explain beyond a trifle, the
    largest first.
    """
    most = {name: _most(before, after, name, bars) for name in before.links}
    sums = {
        name: before.links[name].samples * part
        for name, part in most.items()
        if part > max(bars.gap, bars.predictable * (before.links[name].before - 1.0))
    }
    return tuple(
        sorted((name for name in sums if sums[name] > bars.sure), key=lambda name: -sums[name])
    )


def unforeseen(before: Left, sources: Mapping[str, str], bars: Bars = BARS) -> str | None:
    """The link that is furthest from the plant though nothing measured foresees what it leaves;
    None where none is far.

    ``sources``: by link what its floor is from; that of the sensors alone knows no noise of the
    rig's own.
    """
    far = {
        name: fit.before
        for name, fit in before.links.items()
        if np.sqrt(fit.before)
        > (bars.loud_beside_sensors if sources.get(name) == "sensors" else bars.loud)
    }
    return max(far, key=far.__getitem__, default=None)


def _most(before: Left, after: Left, name: str, bars: Bars) -> float:
    """Chi-square per sample of a link that could be explained, by the better of three yardsticks.

    The generic model at the start may know less than the effects do; then what it still finds after
    them counts. Its word alone is none where the link is no further off than the method itself may
    be.
    """
    first, last = before.links[name], after.links[name]
    if first.before < bars.alone:
        return max(first.before - max(last.before, 1.0), 0.0)
    return max(first.before - max(min(first.after, last.after, last.before), 1.0), 0.0)


def coverage(before: Left, after: Left, bars: Bars = BARS, but: Collection[str] = ()) -> Coverage:
    """What the effects explain of all that lies above the noise, whether or not the generic model
    could; in all links ``but`` these.
    """
    excess, stays = (
        {name: amount for name, amount in _over(left, bars.noise).items() if name not in but}
        for left in (before, after)
    )
    total = sum(excess.values())
    if total <= 0.0:
        return Coverage(1.0, 1.0, 0.0)
    major = [name for name, amount in excess.items() if amount > bars.major * total]
    seen = [name for name in major if after.links[name].before - bars.noise > bars.trifle]
    return Coverage(
        1.0 - sum(stays.values()) / total,
        min((1.0 - stays[name] / excess[name] for name in seen), default=1.0),
        max(after.links[name].before - bars.noise for name in major),
    )


def trust(before: Left, after: Left, whole: float | None = None, bars: Bars = BARS) -> float:
    """What a name's confidence counts: all where its effects leave no more than gap-free rigs do,
    nothing where they leave a third of the gap.

    The right law in other words leaves a few percent, a wrong one that comes near leaves more.
    ``whole``: part of the gap in free run that they explain, which counts likewise, and alone where
    no link keeps more than a trifle; None where it shows none.
    """
    excess, stays = sum(_over(before, bars.quiet).values()), sum(_over(after, bars.quiet).values())
    alone = 1.0 - bars.strict * stays / excess if excess > 0.0 else 1.0
    if whole is not None and all(
        fit.before - bars.quiet < bars.trifle for fit in after.links.values()
    ):
        alone = 1.0
    return float(
        np.clip(alone, 0.0, 1.0)
        * np.clip(1.0 - bars.strict_whole * (1.0 - (1.0 if whole is None else whole)), 0.0, 1.0)
    )


def broken(before: Left, after: Left, bars: Bars = BARS) -> tuple[str, ...]:
    """Links that agreed with the plant and no longer do with the effects on, the worst first: a
    right law breaks none.
    """
    grown = {
        name: after.links[name].before - max(fit.before, 1.0)
        for name, fit in before.links.items()
        if fit.before < bars.noise
    }
    return tuple(
        sorted(
            (
                name
                for name, by in grown.items()
                if by > bars.breaks and by * before.links[name].samples > bars.sure
            ),
            key=lambda name: -grown[name],
        )
    )


def passed_over(before: Left, after: Left, bars: Bars = BARS) -> tuple[str, ...]:
    """Links with a gap of which the effects explain next to nothing: there is a second cause, or
    another one for both.
    """
    excess = {name: before.links[name].before - bars.noise for name in gaps(before, after, bars)}
    return tuple(
        name
        for name, over in excess.items()
        if over > bars.trifle
        and after.links[name].before - bars.noise > (1.0 - bars.touched) * over
    )


def above_noise(left: Left, scale: Mapping[str, float], bars: Bars = BARS) -> float:
    """Chi-square over all links, in units of ``scale``, above what the method itself may leave."""
    return sum(
        amount / scale[name] ** 2
        for name, amount in _over(left, bars.noise).items()
        if name in scale
    )


def _over(left: Left, noise: float) -> dict[str, float]:
    """Chi-square of every link above ``noise`` per sample."""
    return {name: fit.samples * max(fit.before - noise, 0.0) for name, fit in left.links.items()}

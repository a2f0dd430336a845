"""What is left after the named effects: which variables, memories and rates it depends on, and how
much they explain.
"""

from collections.abc import Mapping

import numpy as np

from epa_rt.gap.diagnosis import Remainder
from epa_rt.gap.likelihood.floor import Floor, left_over
from epa_rt.gap.likelihood.generic import Design, GenericFit, designed, fit_generic
from epa_rt.gap.subject import Subject, Values

Designs = dict[str, Design]
WORTH_DESCRIBING = (
    1.3  # whitened chi-square per sample below which nothing is left that could be described
)


def generic_of(
    subject: Subject,
    prepared: Mapping[str, object],
    values: Values,
    floors: Mapping[str, Floor],
    link: str,
    ranked: bool = False,
    designs: Designs | None = None,
) -> GenericFit:
    """The generic model of one link's residual at these values, over all recordings.

    ``designs``: the whitened terms by link, kept by who asks again for the same recordings and
    floors.
    """
    floor = floors[link]
    residuals = {
        name: left_over(subject, one, values, floor, name) for name, one in prepared.items()
    }
    residuals = {name: r for name, r in residuals.items() if np.isfinite(r).any()}
    if not residuals:
        return GenericFit(link, 0, 1.0, 1.0, 0.0, ())
    designs = {} if designs is None else designs
    if link not in designs:
        states = {name: subject.features(prepared[name], link) for name in residuals}
        designs[link] = designed(residuals, states, floor, subject.rate_hz)
    return fit_generic(link, residuals, designs[link], ranked)


def remainders(
    subject: Subject,
    prepared: Mapping[str, object],
    before: Values,
    after: Values,
    floors: Mapping[str, Floor],
    designs: Designs | None = None,
) -> tuple[Remainder, ...]:
    """What is left at ``after`` (named effects on) in every link, and how much of what could be
    explained was.

    ``before``: values with the nominal parameters refitted and no effect. Links at their floor are
    left out. ``designs``: as for ``generic_of``.
    """
    found, designs = [], {} if designs is None else designs
    for link in subject.links:
        if link.name not in floors:
            continue
        rest = generic_of(subject, prepared, after, floors, link.name, ranked=True, designs=designs)
        if rest.samples == 0 or rest.before < WORTH_DESCRIBING:
            continue
        first = generic_of(subject, prepared, before, floors, link.name, designs=designs)
        explainable = first.before - first.after
        residual = np.concatenate(
            [
                left_over(subject, one, after, floors[link.name], name)
                for name, one in prepared.items()
            ]
        )
        found.append(
            Remainder(
                link=link.name,
                channel=link.channel,
                unit=link.unit,
                rms=float(np.sqrt(np.nanmean(residual**2))),
                floor=floors[link.name].rms,
                depends_on=_shares(rest),
                explained_share=rest.explained,
                coverage=(first.before - rest.before) / explainable if explainable > 0.05 else None,
            )
        )
    return tuple(sorted(found, key=lambda r: -r.rms / r.floor))


def _shares(fit: GenericFit) -> tuple[tuple[str, float], ...]:
    """Each group's own share instead of the running sum."""
    shares, before = [], 0.0
    for name, together in fit.ranked:
        shares.append((name, together - before))
        before = together
    return tuple(shares)

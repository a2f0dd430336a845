"""The effects of your own that there are, and the sum of what they pull beside a muscle's braid."""

from collections.abc import Callable, Sequence

from epa_rt.models.added import found
from epa_rt.models.compiled import inlined


def _sum(laws: Sequence[Callable[..., float]]) -> Callable[..., float]:
    """The sum of compiled laws as one; it is compiled into what calls it, which is cached."""
    if not laws:

        @inlined
        def nothing(p, gauge_pa, stretch_m, speed_m_s):
            return 0.0

        return nothing
    first, others = laws[0], _sum(laws[1:])

    @inlined
    def both(p, gauge_pa, stretch_m, speed_m_s):
        return first(p, gauge_pa, stretch_m, speed_m_s) + others(p, gauge_pa, stretch_m, speed_m_s)

    return both


ADDED = found()
tension_n = _sum([one.tension_n for one in ADDED])

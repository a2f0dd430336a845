"""Why names are doubted, in sentences: what takes from all of an answer's confidence at once."""

from collections.abc import Sequence

from epa_rt.gap.heard import USUAL, Heard

# of a name's confidence is left where the whole plant is no better with it, or further off than any
# without a gap: wrong there nearly as often as right
UNSUPPORTED = 0.4


def doubted(there: Heard | None) -> bool:
    """Whether free run speaks against names."""
    return there is not None and (not there.supports or there.leaves_more)


def doubts(there: Heard | None, elsewhere: Sequence[str]) -> tuple[str, ...]:
    """Sentences, each of something that takes ``1 - UNSUPPORTED`` from every name's confidence.
    ``elsewhere``: links with a gap of which the names explain next to nothing.
    """
    found = []
    if there is not None and not there.supports:
        found.append(
            "run from the commands alone, the whole plant is no better with the named effects than"
            " without"
        )
    elif there is not None and there.leaves_more:
        found.append(
            f"run from the commands alone, the whole plant keeps {there.left:,.0f} of its"
            f" {there.gap:,.0f} squared errors (each divided by the noise) with the named effects,"
            f" where a rig without a gap keeps {USUAL:.0f} at most: the law may have another form"
            " than the rig's, or be a neighbour's"
        )
    if elsewhere:
        found.append(
            f"the named effects explain next to nothing of the gap in {', '.join(elsewhere)}"
        )
    return tuple(f"Every confidence counts {UNSUPPORTED:g} of itself: {words}." for words in found)

"""That no effect explains a gap says nothing of those that the logs could not have shown: these are
named in the same sentence.
"""

from collections.abc import Sequence

from epa_rt.gap.problem import Problem
from epa_rt.gap.wording import NONE_EXPLAINS

MOST = 6


def could_sit(problem: Problem, links: Sequence[str], silent: Sequence[str]) -> tuple[str, ...]:
    """The effects of ``silent`` that touch any of the links; all of them where no link is known to
    have the gap.
    """
    return tuple(
        name
        for name in silent
        if not links or set(problem.touched(problem.effects[name].knobs)) & set(links)
    )


def with_unshown(says: str, names: Sequence[str]) -> str:
    """Verdict's sentences, where they say that no effect explains it with the effects beside that
    were not tested and could sit there.
    """
    if not names:
        return says
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    shown = NONE_EXPLAINS.replace("catalogue", "catalogue that these logs could have shown")
    return says.replace(NONE_EXPLAINS, f"{shown} (not tested: {', '.join(names[:MOST])}{more})")

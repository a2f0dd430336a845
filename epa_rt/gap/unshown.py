"""That no effect explains a gap says nothing of those that the logs could not have shown: these are named in the same sentence."""

import re
from collections.abc import Sequence

from epa_rt.gap.problem import Problem

MOST = 6
_NONE = re.compile(r"no effect of the catalogue explains it( better)?")


def could_sit(problem: Problem, links: Sequence[str], silent: Sequence[str]) -> tuple[str, ...]:
    """The effects of ``silent`` that touch any of the links; all of them where no link is known to have the gap."""
    return tuple(name for name in silent if not links or set(problem.touched(problem.effects[name].knobs)) & set(links))


def with_unshown(says: str, names: Sequence[str]) -> str:
    """Verdict's sentences, where they say that no effect explains it with the effects beside that were not tested and could sit there."""
    if not names:
        return says
    more = f" and {len(names) - MOST} more" if len(names) > MOST else ""
    return _NONE.sub(lambda found: f"no effect of the catalogue that these logs could have shown explains it{found[1] or ''} (not tested: {', '.join(names[:MOST])}{more})", says)

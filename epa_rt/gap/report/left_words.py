"""What is left, in words: which measured states it goes with, how much a description by data alone
explains, and which numbers wanted to go on from where their law ends.
"""

from epa_rt.gap.diagnosis import Diagnosis, Remainder
from epa_rt.gap.report.words import MODES, headline, parameter_words, percent, times


def goes_with(left: Remainder) -> list[tuple[str, float]]:
    """Features and their shares, ranked, of all that states explain where that is more than what
    lies above the floor.

    The JSON divides the fall of chi-square by its excess over 1, the floor's own. A floor may hold
    more noise than the logs have, and then states that explain everything bring chi-square below 1:
    shares of 139 %.
    """
    whole = max(1.0, left.explained_share, sum(part for _, part in left.depends_on))
    return [(name, part / whole) for name, part in left.depends_on]


def explained_words(left: Remainder) -> str:
    """Two sentences: how much of what is left states explain, and of what could be explained at
    first the named effects.
    """
    found = (
        f"States explain {percent(min(left.explained_share, 1.0))} of what lies above the floor. "
    )
    if left.coverage is None:
        return found
    part = "all" if left.coverage >= 1.0 else percent(left.coverage)
    return (
        f"{found}The named effects explain {part} of what a description by data alone could have"
        " explained at first."
    )


def ends_words(diagnosis: Diagnosis) -> str:
    """'gas.heat_ratio = 0.1500 stands at the end of the range of its law; 9.9 × floor left block by
    block': numbers of named effects that wanted to go on, as a wrong law's do; '' where none
    did.
    """
    ends = [
        one
        for effect in diagnosis.effects
        if effect.who != "plant_file"
        for one in effect.parameters
        if one.at_end
    ]
    if not ends:
        return ""
    row, said = (
        headline(diagnosis),
        " and ".join(
            " ".join(
                (
                    one.name,
                    "=",
                    *(words for words in parameter_words(one)[::3] if words not in ("", "–")),
                )
            )
            for one in ends
        ),
    )
    left = f"; {times(row.times_floor)} floor left {MODES[row.mode]}" if row is not None else ""
    return (
        f"{said} {'stands' if len(ends) == 1 else 'stand'} at the end of the range of"
        f" {'its' if len(ends) == 1 else 'their'} law{left}"
    )

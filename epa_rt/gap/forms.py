"""Whether what is named can follow another formula than ours: a zero or a scale cannot, a bend may,
a friction mostly does.
"""

from epa_rt.gap.problem import Problem
from epa_rt.gap.select import Selection

READS_OR_COMMANDS = ("sensors", "bus")
EXACT = (
    "_offset",
    "_gain",
    "_skew",
    "_delay",
)  # endings of the names of zeros, scales and shifts in time


def of_one_form(problem: Problem, selection: Selection) -> bool:
    """Whether all that is named is a single number of a reading or a command: its zero, scale, lag
    or age. No other words for these follow another formula, so that of any gap, however large, the
    right one leaves next to nothing (109 of seven sets 24 at most, of gaps of up to 13 million; an
    encoder's age named for a command's, or the other way round, 431 to 2227).
    """
    return all_read_or_command(problem, selection) and all(
        len(problem.effects[role.best.effect].knobs) == 1 for role in selection.roles
    )


def exact(problem: Problem, selection: Selection) -> bool:
    """Whether all that is named is a zero, a scale or a shift in time of a reading or a command: a
    bend or a lag may follow another curve than ours, these may not.
    """
    return of_one_form(problem, selection) and all(
        role.best.effect.endswith(EXACT) for role in selection.roles
    )


def all_read_or_command(problem: Problem, selection: Selection) -> bool:
    """Whether all that is named is a reading's or a command's. Few of these have another formula,
    and those that do leave little (an encoder's wobble 24 of 1.5 million at most): what stays
    beside one is a second effect's, however little it is of the gap (beside a wobble heat of the
    gas left 590 of 1 052 667).
    """
    return bool(selection.roles) and all(
        problem.effects[role.best.effect].block in READS_OR_COMMANDS for role in selection.roles
    )

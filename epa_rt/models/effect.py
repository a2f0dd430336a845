"""What an entry of the catalogue of effects says: a named addition to one block, with the knobs
that switch it on.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple


class Knob(NamedTuple):
    """One number of a plant that may differ between the simulation and the rig.

    ``key`` is where a plant file has it: block (``muscle0`` or ``muscle1`` for one of two,
    ``muscle`` for both), a dot, the row's name with its unit. ``value`` is the plant file's (the
    neutral one of an effect that is off). ``spread``: of a nominal parameter the standard deviation
    believed before any data is seen, of an effect's knob the distance from neutral to a typical
    strength. ``effect`` is None for a nominal parameter. ``absent``: of an effect's knob, the value
    at which the effect is not there, which a plant file that has the effect does not have; None:
    ``value``. ``stated``: of an effect's knob, the standard deviation that the rig's own papers
    give it; None: they say nothing.
    """

    key: str
    unit: str
    value: float
    low: float
    high: float
    spread: float
    effect: str | None = None
    absent: float | None = None
    stated: float | None = None


class Effect(NamedTuple):
    """One effect of the catalogue.

    ``knobs``: keys of the numbers that a fit may move. ``starts``: values of those knobs from which
    fits begin, in the same order, a typical strength first; signs and shapes that a fit cannot
    cross to are starts of their own. ``family``: laws for one and the same thing share it, so that
    the answer can be the family. ``says``: one clause for people; ``equation`` where docs/plant.md
    has it; ``source`` where it comes from. ``swings_over``: the measured angle, in rad and as a
    subject's features name it, over which it swings with periods that nobody knows beforehand; its
    first knobs then are strength, periods to a turn and phase. ``sets_in``: it does nothing below a
    strength that the logs set; fits then begin at its starts as they are, never at a weaker one
    that screening makes of them.
    """

    name: str
    family: str
    block: str
    knobs: tuple[str, ...]
    starts: tuple[tuple[float, ...], ...]
    says: str
    equation: str
    source: str
    swings_over: str | None = None
    sets_in: bool = False


def one_of_each_family(
    names: Iterable[str], effects: Mapping[str, Effect], but: Iterable[str] = ()
) -> list[str]:
    """The first law of each family, in their order; none of the families of ``but``. ``effects``:
    by name.
    """
    there, found = {effects[name].family for name in but}, {}
    for name in names:
        found.setdefault(effects[name].family, name)
    return [name for family, name in found.items() if family not in there]

"""What an effect of your own adds to the plant: numbers, its entry of the catalogue, its law."""

from collections.abc import Callable
from typing import NamedTuple

from epa_rt.models.effect import Effect
from epa_rt.models.tables import Parameter, Table

SECTION = "Muscle"  # of docs/plant.md


class Addition(NamedTuple):
    """One file of the room ``added``. ``rows``: numbers of the muscle, each of them neutral in a
    plant that lacks the effect. ``tension_n(p, gauge_pa, stretch_m, speed_m_s)``: compiled, adds to
    a muscle's pull, N.
    """

    effect: Effect
    rows: Table
    tension_n: Callable[..., float]


def of_muscle(
    name: str,
    family: str,
    says: str,
    source: str,
    rows: Table,
    starts: tuple[tuple[float, ...], ...],
    tension_n: Callable[..., float],
) -> Addition:
    """An effect beside the braid. ``rows``: the first one is its strength, 0 where it is absent.
    ``starts``: values of the rows from which fits begin, a typical strength first.
    """
    switched = (rows[0]._replace(effect=name), *rows[1:])
    knobs = tuple(f"muscle.{row.name}" for row in rows)
    effect = Effect(name, family, "muscle", knobs, starts, says, SECTION, source)
    return Addition(effect, switched, tension_n)


def row(
    name: str, unit: str, low: float, high: float, meaning: str, neutral: float = 0.0
) -> Parameter:
    """A number of an effect: ``name`` ends in its SI unit, bounds in SI."""
    return Parameter(name, unit, neutral, low, high, meaning, "")

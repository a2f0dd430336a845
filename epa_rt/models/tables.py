"""What a row of a parameter table is, and how a table becomes a record type."""

from typing import NamedTuple

import numpy as np


class Parameter(NamedTuple):
    """One row: ``name`` ends in its SI unit; ``effect`` names the effect that the row exists for,
    None if nominal.

    ``neutral`` is the default. For the row of an effect it switches the effect off exactly
    (bit-identical output). ``low`` and ``high`` are the bounds a plant file is held to, both
    inside.
    """

    name: str
    unit: str
    neutral: float
    low: float
    high: float
    meaning: str
    source: str
    effect: str | None = None


Table = tuple[Parameter, ...]


def record_type(table: Table) -> np.dtype:
    """The aligned record of a table, one f8 per row, in table order."""
    return np.dtype([(row.name, "f8") for row in table], align=True)

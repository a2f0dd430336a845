"""Numbers of a plant by key: "muscle.viscous_n_s_m" for both muscles, "muscle0.viscous_n_s_m" for
one.
"""

from typing import NamedTuple

import numpy as np

from epa_rt.models.effect import Effect
from epa_rt.models.parameters import BLOCKS, TWICE, Parameter


class Nominal(NamedTuple):
    """A nominal parameter that competes with every effect: believed to ``relative`` of its value,
    at least ``least``.

    ``relative``: one standard deviation over the value. ``least``: one in the row's unit, for
    values at or near 0.
    """

    key: str
    relative: float
    least: float = 0.0


def row_of(key: str) -> tuple[str, Parameter, int | None]:
    """Block, row and muscle (None: both, or a block that exists once) of a key. Raises KeyError
    where there is none.
    """
    place, _, name = key.partition(".")
    block = place[:-1] if place[:-1] in TWICE and place[-1] in ("0", "1") else place
    for row in BLOCKS.get(block, ()):
        if row.name == name:
            return block, row, int(place[-1]) if block != place else None
    raise KeyError(
        f"found '{key}', expected BLOCK.ROW such as muscle.viscous_n_s_m or gas0.leak_per_s"
    )


def read_knob(params: np.ndarray, key: str) -> float:
    """Value of a number in ``params`` (shape (1,), PARAMS); of both muscles that of the first one
    present.
    """
    block, row, muscle = row_of(key)
    if block not in TWICE:
        return float(params[block][row.name][0])
    if muscle is None:
        muscle = 0 if params["muscle"]["present"][0, 0] > 0.5 else 1
    return float(params[block][row.name][0, muscle])


def write_knob(params: np.ndarray, key: str, value: float) -> None:
    """Sets a number in ``params`` (shape (1,), PARAMS), in both muscles unless the key names one.
    Bounds are not checked.
    """
    block, row, muscle = row_of(key)
    if muscle is None:
        params[block][row.name] = value
    else:
        params[block][row.name][0, muscle] = value


def without_muscle(key: str) -> str:
    """The catalogue's form of a key: "muscle.dahl_m" of "muscle1.dahl_m"."""
    block, row, _ = row_of(key)
    return f"{block}.{row.name}"


def effect_spread(effect: Effect, key: str, neutral: float) -> float:
    """Distance from neutral to a typical strength; of a row that only shapes the effect, half its
    typical value.
    """
    typical = effect.starts[0][effect.knobs.index(key)]
    if typical != neutral:
        return abs(typical - neutral)
    return 0.5 * abs(typical) if typical != 0.0 else 1.0

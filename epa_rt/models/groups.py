"""Groups of effects that the plant is compiled with or without: what is off in a plant costs it
nothing.

A plant whose effects are all off runs faster by half than one that asks of each whether it is on.
Most of that is due to gas and muscle, whose rates are taken sixteen times a cycle.
"""

import numpy as np

from epa_rt.models.parameters import PARAMS, TWICE, rows

OTHERS, GAS, MUSCLE = 1, 2, 4  # bits: others are bus, drive, transmission, load and sensors
# what is compiled, each with the effects of some groups; compiling takes a second or two for each
COMPILED = (0, OTHERS, OTHERS | GAS, OTHERS | MUSCLE, OTHERS | GAS | MUSCLE)
_GROUP = {"gas": GAS, "muscle": MUSCLE}


def _places() -> list[tuple[int, float, int]]:
    """Byte in PARAMS, neutral value and group of every number that switches an effect on."""
    found = []
    for block, row in rows():
        if row.effect is not None:
            record, start = PARAMS.fields[block][:2]
            one = record.base
            for i in range(2 if block in TWICE else 1):
                place = start + i * one.itemsize + one.fields[row.name][1]
                found.append((place, float(row.neutral), _GROUP.get(block, OTHERS)))
    return found


_PLACES = _places()
_NUMBERS = np.array([place // 8 for place, _, _ in _PLACES])
_NEUTRAL = np.array([neutral for _, neutral, _ in _PLACES]).view("i8")
_GROUPS = np.array([group for _, _, group in _PLACES])


def known_places(groups: int) -> list[tuple[int, float]]:
    """Byte in PARAMS and neutral value of every number whose group is not in ``groups``."""
    return [(place, neutral) for place, neutral, group in _PLACES if not group & groups]


def groups_of(params: np.ndarray) -> int:
    """The fewest groups of ``COMPILED`` that hold every effect of ``params`` (shape (1,), PARAMS).

    A number counts as off if it is its neutral value to the last bit.
    """
    numbers = np.ascontiguousarray(params).view("i8")[_NUMBERS]
    on = int(np.bitwise_or.reduce(_GROUPS[numbers != _NEUTRAL]))
    return next(groups for groups in COMPILED if on & ~groups == 0)

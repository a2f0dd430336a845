"""All parameters of the plant: one table per block, and the nested record type derived from
them.
"""

from collections.abc import Iterator

import numpy as np

from epa_rt.models.beside import ADDED
from epa_rt.models.tables import Parameter, Table, record_type
from epa_rt.models.tables_load import LOAD, SENSORS_TABLE
from epa_rt.models.tables_motor import BUS, DRIVE, TRANSMISSION
from epa_rt.models.tables_muscle import GAS, MUSCLE

__all__ = ["BLOCKS", "PARAMS", "Parameter", "Table", "copied", "effects", "neutral_params", "rows"]

BLOCKS: dict[str, Table] = {
    "bus": BUS,
    "drive": DRIVE,
    "transmission": TRANSMISSION,
    "gas": GAS,
    "muscle": (*MUSCLE, *(row for one in ADDED for row in one.rows)),
    "load": LOAD,
    "sensors": SENSORS_TABLE,
}
TWICE = ("gas", "muscle")  # blocks that exist once per muscle

PARAMS = np.dtype(
    [
        (name, record_type(table), (2,)) if name in TWICE else (name, record_type(table))
        for name, table in BLOCKS.items()
    ],
    align=True,
)


def neutral_params() -> np.ndarray:
    """A plant with every parameter at its default: nominal values, all effects off. Shape (1,),
    dtype PARAMS.
    """
    params = np.zeros(1, PARAMS)
    for block, row in rows():
        params[block][row.name] = row.neutral
    return params


def copied(params: np.ndarray) -> np.ndarray:
    """A copy of a contiguous PARAMS array, its bytes at once: field by field takes ten times as
    long.
    """
    return params.view("f8").copy().view(PARAMS)


def rows() -> Iterator[tuple[str, Parameter]]:
    """Every (block name, row), in table order."""
    for block, table in BLOCKS.items():
        for row in table:
            yield block, row


def effects() -> dict[str, tuple[tuple[str, Parameter], ...]]:
    """Effect name to the (block, row) pairs that switch it on."""
    found: dict[str, tuple[tuple[str, Parameter], ...]] = {}
    for block, row in rows():
        if row.effect is not None:
            found[row.effect] = (*found.get(row.effect, ()), (block, row))
    return found

"""Whether an effect of a file can be fitted: what it says of its rows, and its pull, asked once."""

from collections.abc import Container, Sequence

import numba
import numpy as np

from epa_rt.models.addition import Addition
from epa_rt.models.room import Fault, check_starts, check_unit
from epa_rt.models.tables import Table, record_type
from epa_rt.models.tables_muscle import MUSCLE

# gauge pressure, stretch and speed of lengthening of a muscle, in SI; a slack one is not asked
ASKED = np.array([(0.0, 0.005, 0.0), (3e5, 0.01, 0.1), (3e5, 0.02, -0.1)])


def check_said(one: Addition, names: Container[str], taken: Container[str]) -> None:
    """What an effect says of itself and its rows. ``names``, ``taken``: effects, and rows of the
    muscle, that there are already. Raises Fault.
    """
    if one.effect.name in names:
        raise Fault("name", f"effect '{one.effect.name}'", "a name that no other effect has")
    for row in one.rows:
        check_unit(row.name, row.unit)
        if row.name in taken:
            raise Fault(row.name, f"row '{row.name}'", "a name that no other row of a muscle has")
        if not row.low <= row.neutral <= row.high:
            raise Fault(row.name, f"'{row.name}' neutral {row.neutral:g}", "it within its bounds")
    if one.rows[0].neutral != 0.0:
        found = "a first row that is not 0 where the effect is absent"
        raise Fault("rows", found, "its strength")
    bounds = [(row.low, row.high) for row in one.rows]
    check_starts(one.effect.starts, [row.name for row in one.rows], bounds, "row")
    if not numba.config.DISABLE_JIT and not hasattr(one.tension_n, "py_func"):
        raise Fault(_name(one), f"{_name(one)} without @compiled", "@compiled before it")


def check_pull(one: Addition, added: Table) -> None:
    """Asks its law for some pulls, where it is absent and where its fits begin, as Python runs it.
    ``added``: rows of all files. Raises Fault, and whatever the law raises.
    """
    table = (*MUSCLE, *added)
    plant = np.zeros(1, record_type(table)).view(np.recarray)
    for row in table:
        plant[row.name] = row.neutral
    law = getattr(one.tension_n, "py_func", one.tension_n)
    off = [[0.0, *start[1:]] for start in one.effect.starts]
    for values in ([row.neutral for row in one.rows], *off, *one.effect.starts):
        for row, value in zip(one.rows, values, strict=True):
            plant[row.name] = value
        for asked in ASKED:
            with np.errstate(all="ignore"):
                _check_pull(law(plant[0], *asked), one, values, asked)


def _check_pull(
    pull_n: object, one: Addition, values: Sequence[float], asked: Sequence[float]
) -> None:
    if not isinstance(pull_n, (int, float, np.number)):
        raise Fault(_name(one), f"a pull {pull_n}", "a number")
    rows = ", ".join(f"{row.name} {x:g}" for row, x in zip(one.rows, values, strict=True))
    at = f"{rows}, {asked[0]:g} Pa, {asked[1]:g} m, {asked[2]:g} m/s"
    if not np.isfinite(pull_n):
        raise Fault(_name(one), f"a pull of {pull_n:g} N at {at}", "a finite one")
    if values[0] == 0.0 and pull_n != 0.0:
        raise Fault(_name(one), f"a pull of {pull_n:g} N at {at}", "0 N at strength 0")


def _name(one: Addition) -> str:
    return getattr(one.tension_n, "__name__", "tension_n")

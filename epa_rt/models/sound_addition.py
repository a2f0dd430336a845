"""Whether an effect of a file can be fitted: what it says of its rows, and its pull, asked once."""

from collections.abc import Container

import numpy as np

from epa_rt.models.addition import Addition
from epa_rt.models.room import Fault
from epa_rt.models.tables import Table, record_type
from epa_rt.models.tables_muscle import MUSCLE

# gauge pressure, stretch and speed of lengthening of a muscle, in SI
ASKED = ((0.0, 0.0, 0.0), (3e5, 0.01, 0.1), (3e5, 0.02, -0.1))


def check_said(one: Addition, taken: Container[str]) -> None:
    """What an effect says of its rows. ``taken``: names of rows of the muscle that there are
    already. Raises Fault.
    """
    for row in one.rows:
        if row.name in taken:
            raise Fault(row.name, f"row '{row.name}'", "a name that no other row of a muscle has")
        if not row.low <= row.neutral <= row.high:
            raise Fault(row.name, f"'{row.name}' neutral {row.neutral:g}", "it within its bounds")
    if one.rows[0].neutral != 0.0:
        found = "a first row that is not 0 where the effect is absent"
        raise Fault("rows", found, "its strength")
    starts: object = one.effect.starts
    if not isinstance(starts, (tuple, list)) or not starts:
        raise Fault("starts", f"starts {starts}", "one or more, each a value for each row")
    for start in starts:
        if not isinstance(start, (tuple, list)) or len(start) != len(one.rows):
            raise Fault("starts", f"a start {start}", "a value for each row")


def check_pull(one: Addition, added: Table) -> None:
    """Asks its law for some pulls, where it is absent and where its fits begin, as Python runs it.
    ``added``: rows of all files. Raises Fault, and whatever the law raises.
    """
    table = (*MUSCLE, *added)
    plant = np.zeros(1, record_type(table)).view(np.recarray)
    for row in table:
        plant[row.name] = row.neutral
    law = getattr(one.tension_n, "py_func", one.tension_n)
    for values in ([row.neutral for row in one.rows], *one.effect.starts):
        for row, value in zip(one.rows, values, strict=True):
            plant[row.name] = value
        for gauge_pa, stretch_m, speed_m_s in ASKED:
            with np.errstate(all="ignore"):
                pull_n: object = law(plant[0], gauge_pa, stretch_m, speed_m_s)
            if not isinstance(pull_n, (int, float, np.number)):
                raise Fault("tension_n", f"a pull {pull_n}", "a number")

"""Effects of your own in the simulated rig: each file of this room that holds an ``ADDITION`` adds
one to the muscle (docs/add-an-effect.md).
"""

from functools import partial

from epa_rt.models.addition import Addition
from epa_rt.models.catalogue_chain import CHAIN
from epa_rt.models.catalogue_muscle import GAS_EFFECTS, MUSCLE_EFFECTS
from epa_rt.models.catalogue_sensors import SENSOR_EFFECTS
from epa_rt.models.room import held, sound
from epa_rt.models.sound_addition import check_pull, check_said
from epa_rt.models.tables_muscle import MUSCLE

HOW = "of_muscle(...) of epa_rt.models.addition"


def found() -> tuple[Addition, ...]:
    """The ``ADDITION`` of every file of this room, in order of the files' names. Raises
    ConfigError, with file and line, for one that has none, for a name that is taken, and for an
    effect that no fit could ask.
    """
    there = held(__name__, __path__, "ADDITION", Addition, HOW)
    others = (*CHAIN, *GAS_EFFECTS, *MUSCLE_EFFECTS, *SENSOR_EFFECTS)
    names, taken = {one.name for one in others}, {row.name for row in MUSCLE}
    for file, one in there:
        sound(file, "ADDITION", one.effect.name, partial(check_said, one, names, taken))
        names.add(one.effect.name)
        taken.update(row.name for row in one.rows)
    rows = tuple(row for _, one in there for row in one.rows)
    for file, one in there:
        sound(file, "ADDITION", one.effect.name, partial(check_pull, one, rows))
    return tuple(one for _, one in there)

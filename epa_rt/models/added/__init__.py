"""Effects of your own in the simulated rig: each file of this room that holds an ``ADDITION`` adds
one to the muscle (docs/add-an-effect.md).
"""

from epa_rt.config.source import ConfigError
from epa_rt.models.addition import Addition
from epa_rt.models.room import held

HOW = "of_muscle(...) of epa_rt.models.addition"


def found() -> tuple[Addition, ...]:
    """The ``ADDITION`` of every file of this room, in order of the files' names. Raises
    ConfigError, with the file, for one that has none or that is not absent at its neutral numbers.
    """
    there = held(__name__, __path__, "ADDITION", Addition, HOW)
    for file, addition in there:
        problem = _problem(addition)
        if problem is not None:
            raise ConfigError(file, 1, addition.effect.name, *problem)
    return tuple(addition for _, addition in there)


def _problem(addition: Addition) -> tuple[str, str] | None:
    """What is found and what is expected, where an addition is wrong."""
    for row in addition.rows:
        if not row.low <= row.neutral <= row.high:
            return f"'{row.name}' neutral {row.neutral:g}", "it within its bounds"
    if addition.rows[0].neutral != 0.0:
        return "a first row that is not 0 where the effect is absent", "its strength"
    if any(len(start) != len(addition.rows) for start in addition.effect.starts):
        return f"starts {addition.effect.starts}", "a value for each row"
    return None

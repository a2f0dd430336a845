"""Laws of your own for whatever slides or turns: each file of this room that holds a ``LAW`` adds
one to carriage, shaft and piston (docs/add-an-effect.md).
"""

from collections.abc import Sequence

from epa_rt.config.source import ConfigError
from epa_rt.gap.rig.foreign.law import Law
from epa_rt.models.room import held

HOW = "law(...) of epa_rt.gap.rig.foreign.law"


def found(beside: Sequence[Law]) -> tuple[Law, ...]:
    """The ``LAW`` of every file of this room, in order of the files' names. ``beside``: laws that
    there are already.

    Raises ConfigError, with the file, for one without a law, for a name or number that is taken,
    and for a law that is not absent at its neutral numbers.
    """
    names = {one.effect.name for one in beside}
    keys = {key for one in beside for key in one.effect.knobs}
    there = held(__name__, __path__, "LAW", Law, HOW)
    for file, law in there:
        problem = _problem(law, names, keys)
        if problem is not None:
            raise ConfigError(file, 1, law.effect.name, *problem)
        names.add(law.effect.name)
        keys.update(law.effect.knobs)
    return tuple(law for _, law in there)


def _problem(law: Law, names: set[str], keys: set[str]) -> tuple[str, str] | None:
    """What is found and what is expected, where a law is wrong."""
    if law.effect.name in names:
        return f"effect '{law.effect.name}'", "a name that no other effect has"
    for number in law.parameters:
        if number.key in keys:
            return f"number '{number.key}'", "a name that no other number has"
        if number.effect != law.effect.name:
            return f"number '{number.key}' of '{number.effect}'", f"of '{law.effect.name}'"
        neutral = number.neutral
        if neutral is None or not number.low <= neutral <= number.high:
            return f"'{number.key}' neutral {neutral}", "one within its bounds"
    if not law.parameters or law.parameters[0].neutral != 0.0:
        return "a first number that is not 0 where the law is absent", "its strength"
    if any(len(start) != len(law.parameters) for start in law.effect.starts):
        return f"starts {law.effect.starts}", "a value for each number"
    return None

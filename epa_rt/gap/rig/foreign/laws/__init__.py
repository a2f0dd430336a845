"""Laws of your own for whatever slides or turns: each file of this room that holds a ``LAW`` adds
one to carriage, shaft and piston (docs/add-an-effect.md).
"""

import importlib
import pkgutil
from collections.abc import Sequence

from epa_rt.gap.rig.foreign.law import Law


def found(beside: Sequence[Law]) -> tuple[Law, ...]:
    """The ``LAW`` of every file of this room, in order of the files' names. ``beside``: laws that
    there are already.

    Raises ValueError, with the file, for one without a law, for a name or number that is taken, and
    for a law that is not absent at its neutral numbers.
    """
    names = {one.effect.name for one in beside}
    keys, laws = {key for one in beside for key in one.effect.knobs}, []
    for file in sorted(pkgutil.iter_modules(__path__), key=lambda one: one.name):
        module = importlib.import_module(f"{__name__}.{file.name}")
        law = vars(module).get("LAW")
        problem = _problem(law, names, keys)
        if problem:
            raise ValueError(f"{module.__file__}: {problem}")
        names.add(law.effect.name)
        keys.update(law.effect.knobs)
        laws.append(law)
    return tuple(laws)


def _problem(law: object, names: set[str], keys: set[str]) -> str:
    """What is wrong with a law in one sentence, '' where nothing is."""
    if not isinstance(law, Law):
        return "found no LAW, expected LAW = law(...) of epa_rt.gap.rig.foreign.law"
    if law.effect.name in names:
        return f"found effect '{law.effect.name}', expected a name that no other effect has"
    for number in law.parameters:
        if number.key in keys:
            return f"found number '{number.key}', expected a name that no other number has"
        if number.effect != law.effect.name:
            return f"found number '{number.key}' of '{number.effect}', expected of the law's own"
        neutral = number.neutral
        if neutral is None or not number.low <= neutral <= number.high:
            return f"found '{number.key}' neutral {neutral}, expected one within its bounds"
    if not law.parameters or law.parameters[0].neutral != 0.0:
        return "found a first number that is not 0 where the law is absent, expected its strength"
    if any(len(start) != len(law.parameters) for start in law.effect.starts):
        return f"found starts {law.effect.starts}, expected a value for each number"
    return ""

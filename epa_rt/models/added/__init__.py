"""Effects of your own in the simulated rig: each file of this room that holds an ``ADDITION`` adds
one to the muscle (docs/add-an-effect.md).
"""

import importlib
import pkgutil

from epa_rt.models.addition import Addition


def found() -> tuple[Addition, ...]:
    """The ``ADDITION`` of every file of this room, in order of the files' names. Raises ValueError,
    with the file, for one that has none or that is not absent at its neutral numbers.
    """
    additions: list[Addition] = []
    for file in sorted(pkgutil.iter_modules(__path__), key=lambda one: one.name):
        module = importlib.import_module(f"{__name__}.{file.name}")
        addition = vars(module).get("ADDITION")
        problem = _problem(addition)
        if problem:
            raise ValueError(f"{module.__file__}: {problem}")
        additions.append(addition)
    return tuple(additions)


def _problem(addition: object) -> str:
    """What is wrong with an addition in one sentence, '' where nothing is."""
    if not isinstance(addition, Addition):
        return "found no ADDITION, expected ADDITION = of_muscle(...) of epa_rt.models.addition"
    for row in addition.rows:
        if not row.low <= row.neutral <= row.high:
            return f"found '{row.name}' neutral {row.neutral:g}, expected it within its bounds"
    if addition.rows[0].neutral != 0.0:
        return "found a first row that is not 0 where the effect is absent, expected its strength"
    if any(len(start) != len(addition.rows) for start in addition.effect.starts):
        return f"found starts {addition.effect.starts}, expected a value for each row"
    return ""

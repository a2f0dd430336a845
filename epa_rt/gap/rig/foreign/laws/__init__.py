"""Laws of your own for whatever slides or turns: each file of this room that holds a ``LAW`` adds
one to carriage, shaft and piston (docs/add-an-effect.md).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from epa_rt.gap.rig.foreign.law import Law
from epa_rt.gap.rig.foreign.sound_law import asked_of_a_trial, check_said
from epa_rt.models.room import held, line_of, sound

HOW = "law(...) of epa_rt.gap.rig.foreign.law"

# where effects and numbers of this room are said
FILES: dict[str, Path] = {}


def place(name: str) -> tuple[Path, int]:
    """File and line of an effect or a number; of one that is not of this room, the room."""
    if name not in FILES:
        return Path(__path__[0]), 1
    return FILES[name], line_of(FILES[name], "LAW", name.rpartition(".")[2])


def found(beside: Sequence[Law]) -> tuple[Law, ...]:
    """The ``LAW`` of every file of this room, in order of the files' names. ``beside``: laws that
    there are already.

    Raises ConfigError, with file and line, for one without a law, for a name or number that is
    taken, and for a law that no fit could ask.
    """
    names = {one.effect.name for one in beside}
    keys = {key for one in beside for key in one.effect.knobs}
    there = held(__name__, __path__, "LAW", Law, HOW)
    for file, law in there:
        sound(file, "LAW", law.effect.name, partial(check_said, law, names, keys))
        names.add(law.effect.name)
        keys.update(law.effect.knobs)
        FILES.update({one: file for one in (law.effect.name, *law.effect.knobs)})
    others = (*beside, *(law for _, law in there))
    asked = {
        file: sound(file, "LAW", law.effect.name, partial(asked_of_a_trial, law, others))
        for file, law in there
    }
    return tuple(replace(law, asks=asked[file]) for file, law in there)

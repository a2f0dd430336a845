"""From an answer back to numbers: the values and effects that a diagnosis found, and the plant file that has them."""

import json
from pathlib import Path

from epa_rt.gap.diagnosis import Diagnosis, Number
from epa_rt.gap.subject import Subject


class PatchError(Exception):
    """What is wrong with a diagnosis file, as a sentence."""


def load_diagnosis(path: Path) -> Diagnosis:
    """A diagnosis as ``epa gap diagnose --json`` wrote it. Raises PatchError."""
    from pydantic import TypeAdapter, ValidationError

    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise PatchError(f"{path}: cannot be read ({error.strerror})") from None
    except (ValueError, RecursionError) as error:
        raise PatchError(f"{path}: found no JSON ({error}), expected a diagnosis of epa gap diagnose") from None
    try:
        return TypeAdapter(Diagnosis).validate_python(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise PatchError(f"{path}: {where}: found {str(first['input'])[:60]!r}, expected a diagnosis of epa gap diagnose ({first['msg']})") from None


def check_rig(diagnosis: Diagnosis, subject: Subject) -> None:
    """Raises PatchError where a diagnosis says that it is of another rig: most numbers of one fit into another's plant file."""
    told = diagnosis.inputs.get("subject")
    if told is not None and told != subject.name:
        raise PatchError(f"found a diagnosis of the rig {told}, expected one of {subject.name}")


def numbers(diagnosis: Diagnosis) -> tuple[Number, ...]:
    """Every number that the diagnosis moved: nominal parameters, then those of the effects."""
    return (*diagnosis.nominal_moved, *(number for effect in diagnosis.effects for number in effect.parameters))


def values_of(diagnosis: Diagnosis, subject: Subject) -> tuple[dict[str, float], tuple[str, ...]]:
    """Knob values and names of the effects. Raises PatchError where the rig knows no such knob."""
    check_rig(diagnosis, subject)
    values = diagnosis.fitted or {number.name: number.value for number in numbers(diagnosis)}
    for key in values:
        if key not in subject.knobs:
            raise PatchError(f"found the parameter '{key}' in the diagnosis, expected one that the rig {subject.name} has")
    return dict(values), tuple(effect.name for effect in diagnosis.effects)


def patched_text(diagnosis: Diagnosis, subject: Subject) -> str:
    """Text of the plant file with everything that the diagnosis found. Raises PatchError."""
    return subject.patched(*values_of(diagnosis, subject))

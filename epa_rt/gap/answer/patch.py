"""From an answer back to numbers: the values and effects that a diagnosis found, and the plant file
that has them.
"""

import hashlib
import json
import math
from pathlib import Path

from epa_rt.config.json_file import read_json
from epa_rt.config.units import with_unit
from epa_rt.gap.diagnosis import Diagnosis, Number
from epa_rt.gap.subject import Subject, Values

PLANT_DIGEST = "plant_sha256"  # among the inputs of a diagnosis
SLACK = 1e-9  # of a number that stands at the end of its range: it has been through text


class PatchError(Exception):
    """What is wrong with a diagnosis file, as a sentence."""


def load_diagnosis(path: Path) -> Diagnosis:
    """A diagnosis as ``epa gap diagnose --json`` wrote it. Raises PatchError."""
    from pydantic import TypeAdapter, ValidationError

    data = read_json(path, "a diagnosis of epa gap diagnose", PatchError)
    try:
        return TypeAdapter(Diagnosis).validate_python(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise PatchError(
            f"{path}: {where}: found {str(first['input'])[:60]!r}, expected a diagnosis of epa gap"
            f" diagnose ({first['msg']})"
        ) from None


def check_rig(diagnosis: Diagnosis, subject: Subject) -> None:
    """Raises PatchError where a diagnosis says that it is of another rig: most numbers of one fit
    into another's plant file.
    """
    told = diagnosis.inputs.get("subject")
    if told is not None and told != subject.name:
        raise PatchError(f"found a diagnosis of the rig {told}, expected one of {subject.name}")


def check_names(diagnosis: Diagnosis, subject: Subject, listed_by: str) -> None:
    """Raises PatchError where a diagnosis names an effect that the rig cannot have; ``listed_by``:
    the command that lists those that it can.
    """
    known = {effect.name for effect in subject.catalogue}
    named = [name for one in diagnosis.effects for name in (one.name, *one.not_separable_from)]
    instead = diagnosis.posterior.instead if diagnosis.posterior else ()
    for name in (*named, *(name for one in instead for name in one)):
        if name not in known:
            raise PatchError(
                f"found the effect {name}, expected one of the catalogue of {subject.name}"
                f" ({listed_by})"
            )


def check_values(values: Values, subject: Subject) -> None:
    """Raises PatchError where a number of a diagnosis is none that the rig's plant file takes: it
    has been through other hands.
    """
    for key, value in values.items():
        knob = subject.knobs[key]
        ends = [end for end in (knob.low, knob.high, knob.value, knob.absent) if end is not None]
        if (
            not min(ends) - SLACK * abs(value) <= value <= max(ends) + SLACK * abs(value)
        ):  # not so of NaN either
            raise PatchError(
                f"{key}: found {with_unit(f'{value:.6g}', knob.unit)}, expected"
                f" {with_unit(f'{knob.low:.6g} to {knob.high:.6g}', knob.unit)}"
            )


def digest_of(subject: Subject) -> str:
    """A digest of every number of a plant file, comments and order left out: a diagnosis says of
    which it is.
    """
    return hashlib.sha256(
        json.dumps(sorted((key, knob.value) for key, knob in subject.knobs.items())).encode()
    ).hexdigest()


def check_plant(diagnosis: Diagnosis, values: Values, subject: Subject) -> None:
    """Raises PatchError where a diagnosis says that it is of another plant file; one whose numbers
    are all the patched ``values`` is none.
    """
    told = diagnosis.inputs.get(PLANT_DIGEST)
    if told is None or told == digest_of(subject):
        return
    if all(
        math.isclose(subject.knobs[key].value, value, rel_tol=1e-12)
        for key, value in values.items()
    ):
        return  # has been patched with it already
    raise PatchError(
        f"found a diagnosis of the plant file {diagnosis.inputs.get('plant')}, expected one of the"
        " plant file that is to be patched, which has other numbers (give the one that was"
        " diagnosed: --plant)"
    )


def numbers(diagnosis: Diagnosis) -> tuple[Number, ...]:
    """Every number that the diagnosis moved: nominal parameters, then those of the effects."""
    return (
        *diagnosis.nominal_moved,
        *(number for effect in diagnosis.effects for number in effect.parameters),
    )


def values_of(diagnosis: Diagnosis, subject: Subject) -> tuple[dict[str, float], tuple[str, ...]]:
    """Knob values and names of the effects. Raises PatchError where the rig knows no such knob."""
    check_rig(diagnosis, subject)
    values = diagnosis.fitted or {number.name: number.value for number in numbers(diagnosis)}
    for key in values:
        if key not in subject.knobs:
            raise PatchError(
                f"found the parameter '{key}' in the diagnosis, expected one that the rig"
                f" {subject.name} has"
            )
    return dict(values), tuple(dict.fromkeys(effect.name for effect in diagnosis.effects))


PATCHED_BY = "epa gap patch"


def patched_text(diagnosis: Diagnosis, subject: Subject) -> str:
    """Text of the plant file with everything that the diagnosis found. Raises PatchError."""
    head = f"# What a diagnosis found was put in by '{PATCHED_BY}'.\n"
    return f"{head}{subject.patched(*values_of(diagnosis, subject))}"

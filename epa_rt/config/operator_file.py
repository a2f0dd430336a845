"""The operator file beside the rig files: who works here, and which specimens are built in.

``config/rigs/operator.yaml`` serves all rigs of ``config/rigs``. Every log carries what it says.
"""

from pathlib import Path
from typing import Annotated

from pydantic import Field, StringConstraints

from epa_rt.config.fields import Frozen, Name
from epa_rt.config.source import Located, load_yaml, validate

Words = Annotated[str, StringConstraints(strip_whitespace=True, max_length=200)]
Note = Annotated[str, StringConstraints(strip_whitespace=True, max_length=2000)]


class RigAsBuilt(Frozen):
    """One rig: its serial number, the muscle in each place of the rig file, a note."""

    serial: Words = ""
    muscles: dict[Name, Words] = Field(default_factory=dict)
    note: Note = ""


class OperatorFile(Frozen):
    """``operator``: who runs; ``note``: for every run; ``rigs``: by the rig file's name."""

    operator: Words = ""
    note: Note = ""
    rigs: dict[Name, RigAsBuilt] = Field(default_factory=dict)


def operator_path(rig_path: Path) -> Path:
    """``operator.yaml`` in the rig file's folder."""
    return rig_path.with_name("operator.yaml")


def read_operator(path: Path, rig_name: str, muscles: tuple[str, ...]) -> OperatorFile | None:
    """The operator file; None where there is none.

    Raises ConfigError where it is not sound, or names a muscle that the rig ``rig_name`` lacks.
    """
    if not path.exists():
        return None
    return operator_from(load_yaml(path), {rig_name: muscles})


def operator_from(located: Located, rigs: dict[str, tuple[str, ...]]) -> OperatorFile:
    """The typed file. ``rigs``: muscle names of the rigs that are known. Raises ConfigError."""
    found = validate(located, OperatorFile)
    for rig, muscles in rigs.items():
        built = found.rigs.get(rig)
        for name in built.muscles if built else ():
            if name not in muscles:
                raise located.error(
                    ("rigs", rig, "muscles", name),
                    f"'{name}'",
                    f"a muscle of the rig '{rig}' ({', '.join(muscles) or 'it has none'})",
                )
    return found

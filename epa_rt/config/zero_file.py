"""The zero file beside a rig file: what set the zero of travel, when, by whom, and where it ended.

``config/rigs/bench.yaml`` has ``config/rigs/bench.zero.yaml``. ``epa home`` writes it, a run on the
real rig reads it. It is written whole or not at all. An emulated bus has a file of its own.
"""

from datetime import datetime
from pathlib import Path
from typing import Annotated

import yaml
from pydantic import Field, field_validator

from epa_rt.config.fields import Frozen, Name, quantity
from epa_rt.config.source import Located, load_yaml, parse_yaml, validate
from epa_rt.config.units import UnitError
from epa_rt.config.whole_file import write_synced

Count = Annotated[int, Field(ge=-(1 << 31), lt=1 << 31)]
_APPLIED = ("method", "when", "who", "drive", "offset", "end")
APPLIED = "applied_zero"  # the section of a log's own copy of the rig file
_COMMENT = "# taken from the zero file"
_HEAD = "# Written by epa home. Do not edit: home again instead.\n"


class ZeroFile(Frozen):
    """``at``: the travel that was set, in m. ``offset``, ``end`` (counts): of a wired drive."""

    rig: Name
    method: str
    at: quantity("m")
    when: str
    who: str = ""
    drive: str = ""
    scatter: quantity("m", 0.0) | None = None
    offset: Count = 0
    end: Count | None = None

    @field_validator("when")
    @classmethod
    def _is_a_time(cls, value: str) -> str:
        try:
            datetime.fromisoformat(value)
        except ValueError:
            raise UnitError(f"found '{value}', expected a time as 2026-01-31T12:00:00Z") from None
        return value

    @property
    def facts(self) -> str:
        """One line for log and screen."""
        by = f" by {self.who}" if self.who else ""
        return f"zero by {self.method} at {1e3 * self.at:g} mm, set {self.when}{by}"


def zero_path(rig_path: Path, emulated: bool = False) -> Path:
    """``bench.zero.yaml`` beside ``bench.yaml``; of an emulated bus ``bench.emulated.zero.yaml``:
    what is tried there says nothing of the rig.
    """
    return rig_path.with_name(f"{rig_path.stem}{'.emulated' if emulated else ''}.zero.yaml")


def read_zero(path: Path, rig_name: str) -> ZeroFile | None:
    """The zero file; None where there is none. Raises ConfigError where it is damaged or another
    rig's.
    """
    if not path.exists():
        return None
    located = load_yaml(path)
    zero = validate(located, ZeroFile)
    if zero.rig != rig_name:
        raise located.error(("rig",), f"'{zero.rig}'", f"'{rig_name}', the rig beside it")
    return zero


def write_zero(path: Path, zero: ZeroFile) -> None:
    """Writes the whole file under another name, then renames it. Raises OSError."""
    values: dict[str, object] = {
        "rig": zero.rig,
        "method": zero.method,
        "at": f"{1e3 * zero.at:.9g} mm",
        "when": zero.when,
        "who": zero.who,
        "drive": zero.drive,
    }
    if zero.scatter is not None:
        values["scatter"] = f"{1e3 * zero.scatter:.6g} mm"
    if zero.end is not None:
        values |= {"offset": zero.offset, "end": zero.end}
    write_synced(path, _HEAD + yaml.safe_dump(values, sort_keys=False, allow_unicode=True))


def with_zero(rig: Located, zero: ZeroFile) -> Located:
    """The rig file's text with what the zero file says, as the log is to carry it."""
    values = {key: value for key in _APPLIED if (value := getattr(zero, key)) is not None}
    section = yaml.safe_dump({APPLIED: values}, sort_keys=False, allow_unicode=True)
    if isinstance(rig.data, dict) and APPLIED in rig.data:
        raise rig.error(
            (APPLIED,), "a section that only a log has", "no applied_zero beside a zero file"
        )
    if rig.text.lstrip().startswith("{"):  # a file in one pair of braces: nothing can be appended
        return parse_yaml(yaml.safe_dump(rig.data, sort_keys=False) + section, rig.path)
    return parse_yaml(f"{rig.text.rstrip()}\n\n{_COMMENT}\n{section}", rig.path)


def without_zero(text: str) -> str:
    """The text of a log's own rig file as it was before a zero file was joined to it."""
    node = yaml.compose(text)
    if not isinstance(node, yaml.MappingNode):
        return text
    for key, value in node.value:
        if key.value == APPLIED:
            start, stop = key.start_mark.index, value.end_mark.index
            before = text[:start].removesuffix(f"{_COMMENT}\n").rstrip()
            return f"{before}\n{text[stop:].lstrip()}"
    return text

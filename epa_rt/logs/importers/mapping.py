"""The mapping file: which columns of a foreign recording become which signals, with unit, clock and
trials. docs/import.md.
"""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StringConstraints, field_validator, model_validator

from epa_rt.config.fields import Frozen, Name, Seconds, pressure, quantity
from epa_rt.config.kinds import expect_kind
from epa_rt.config.rig_rows import PLACES
from epa_rt.config.source import Located, load_yaml, validate
from epa_rt.config.units import UnitError, unit
from epa_rt.logs.importers.line import line_of
from epa_rt.logs.importers.rig_text import atmosphere_of
from epa_rt.logs.layout import ANSWERED_AFTER


def _column(value: Any) -> str | int:
    """A name, or a number from 1."""
    is_number = isinstance(value, int) and not isinstance(value, bool)
    if is_number and 1 <= value <= 10_000 or isinstance(value, str) and 1 <= len(value) <= 200:
        return value
    raise UnitError(f"found {str(value)[:60]!r}, expected a column's name, or its number from 1")


def _factor(value: Any) -> Any:
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise UnitError(
            f"found {str(value)[:60]!r}, expected a number, with its unit where it has one"
        )
    return value


Column = Annotated[Any, BeforeValidator(_column)]
Factor = Annotated[Any, BeforeValidator(_factor)]
Text = Annotated[str, StringConstraints(min_length=1, max_length=200)]


TOPIC_KINDS = ("mcap", "rosbag")


class Format(Frozen):
    """How the files are written. Of CSV: ``delimiter``, ``decimal``, ``thousands`` (where it is the
    decimal sign too, the last one is the decimal), ``header``, ``skip_lines`` before it,
    ``skip_below_header`` (lines of units), ``missing`` (texts that mean no value; in other files
    'nan' and 'null'). ``final_newline:
    false``: the last line may end without a line end, so that a file cut there cannot be told.
    """

    kind: Literal["csv", "mat", "mcap", "rosbag", "parquet", "jsonl", "npz"]
    delimiter: Annotated[str, StringConstraints(min_length=1, max_length=1)] = ","
    decimal: Literal[".", ","] = "."
    thousands: Literal[".", ",", " ", "'"] | None = None
    header: bool = True
    skip_lines: Annotated[int, Field(ge=0, le=1000)] = 0
    skip_below_header: Annotated[int, Field(ge=0, le=10)] = 0
    encoding: Literal["utf-8", "latin-1", "utf-16"] = "utf-8"
    final_newline: bool = True
    missing: Annotated[tuple[str, ...], Field(max_length=20)] = ()

    @field_validator("delimiter")
    @classmethod
    def _no_sign_of_numbers(cls, value: str) -> str:
        if value.isalnum() or value in '+-"\r\n\0':
            raise UnitError(
                f"found {value!r}, expected a sign that stands in no number, such as a comma, a"
                " semicolon or \\t"
            )
        return value

    @model_validator(mode="after")
    def _signs_differ(self) -> "Format":
        if self.kind == "csv" and self.delimiter in (self.decimal, self.thousands):
            raise UnitError(
                f"found the delimiter {self.delimiter!r} also as a sign within numbers, expected"
                " signs that differ"
            )
        if self.skip_below_header and not self.header:
            raise UnitError(
                f"found 'skip_below_header: {self.skip_below_header}' with 'header: false',"
                " expected lines before the numbers to count as 'skip_lines' there"
            )
        return self


class Clock(Frozen):
    """When a row was: a ``column`` of stamps with its ``unit``, or a ``rate``.

    ``period``: of the log's grid (default: the stamps' mean step). ``jitter``: how far stamps may
    lie off that grid and still be taken as they are (default: a tenth of the period). ``resample:
    linear`` puts values onto the grid where they do not; grid points in gaps longer than
    ``max_gap`` (default: three periods) count as lost.
    """

    column: Column | None = None
    unit: Text | None = None
    rate: quantity("Hz", 1e-6, 1e6) | None = None
    period: quantity("s", 1e-6, 1e6) | None = None
    jitter: Seconds | None = None
    resample: Literal["linear"] | None = None
    max_gap: Seconds | None = None

    @model_validator(mode="after")
    def _one_clock(self) -> "Clock":
        if (self.column is None) == (self.rate is None):
            raise UnitError(
                "found "
                + ("neither" if self.rate is None else "both")
                + ", expected one of column and rate"
            )
        if self.column is not None:
            if self.unit is None:
                raise UnitError(
                    "found a column of stamps without a unit, expected a unit such as ms"
                )
            if unit(self.unit)[1] != unit("s")[1]:
                raise UnitError(f"found the unit '{self.unit}', expected a unit of time")
        elif self.unit or self.resample or self.max_gap or self.jitter:
            raise UnitError(
                "found a rate with unit, jitter, resample or max_gap, expected a rate alone"
            )
        return self


class Signal(Frozen):
    """Where a signal comes from: SI value = column in ``unit`` x ``scale`` x ``scale_variable`` +
    ``offset``.

    ``scale_variable``: a scalar of the MAT or NPZ file; its unit is that of ``scale`` ('1 N/V').
    ``integral``: the column is the signal's speed, which is added up over time, from 0 on.

    A pressure's unit ends in gauge, abs or difference. ``file``: which of several files (a part of
    its name); ``topic``: of MCAP and ROS bags; ``stamp``: the field with the stamps of this topic
    where it is not the clock's column.
    """

    column: Column
    unit: str
    scale: Factor = 1.0
    scale_variable: Text | None = None
    offset: Factor | None = None
    integral: bool = False
    file: Text | None = None
    topic: Text | None = None
    stamp: Text | None = None

    def column_of(self, name: str) -> str:
        """The name that a signal's column would have by itself: of its speed where that is given.

        Raises UnitError where a signal has no speed.
        """
        if not self.integral:
            return name
        if not name.endswith(PLACES):
            raise UnitError(
                f"found 'integral' for {name}, expected it for a place or an angle: a name that"
                " ends in _m or _rad"
            )
        return f"{name}_s"


class Stretch(Frozen):
    """A trial by time, in s since the log's first row."""

    name: Name
    begin: Seconds
    end: Seconds

    @model_validator(mode="after")
    def _forwards(self) -> "Stretch":
        if not self.begin < self.end:
            raise UnitError(
                f"found begin {self.begin:g} s and end {self.end:g} s, expected the begin before"
                " the end"
            )
        return self


class TrialColumn(Frozen):
    """Trials by a column of whole numbers: every stretch of one value other than zero is a
    trial.
    """

    column: Column
    file: Text | None = None
    topic: Text | None = None


class Mapping(Frozen):
    """The whole file. ``rig_file`` is attached to the log and must say ``rig:`` as this one does,
    and no other ``atmosphere``; read by ``load_mapping``, ``atmosphere`` is the rig's, in Pa, where
    this one does not say it. ``answered_after``: rows until the readings show what a row's commands
    did, of a rig of this house; its own loop's stands where nothing is said.
    """

    mapping: Name
    description: str = ""
    rig: Name
    rig_file: Text | None = None
    experiment: Name | None = None
    answered_after: Annotated[int, Field(ge=0, le=ANSWERED_AFTER)] = ANSWERED_AFTER
    atmosphere: pressure(30e3, 120e3) | None = None
    format: Format
    clock: Clock
    measured: Annotated[dict[Name, Signal], Field(min_length=1, max_length=64)]
    commands: Annotated[dict[Name, Signal], Field(max_length=256)] = {}
    references: Annotated[dict[Name, Signal], Field(max_length=256)] = {}
    trials: Annotated[tuple[Stretch, ...], Field(max_length=1000)] | TrialColumn = ()

    @property
    def signals(self) -> dict[str, Signal]:
        """Measured, references, commands, in the order of the log."""
        return {**self.measured, **self.references, **self.commands}


def load_mapping(path: Path | str) -> tuple[Mapping, Located]:
    """Reads and checks a mapping file. Raises ConfigError: one sentence with file, line, found,
    expected.
    """
    located = load_yaml(path)
    expect_kind(located, "mapping")
    mapping = validate(located, Mapping)
    mapping = mapping.model_copy(update={"atmosphere": atmosphere_of(mapping, located)})
    seen: set[str] = set()
    for section, prefix in (("measured", ""), ("commands", "cmd_"), ("references", "ref_")):
        for name, signal in getattr(mapping, section).items():
            where = (section, name)
            if name in seen:
                raise located.error(where, f"the signal '{name}' a second time", "each name once")
            seen.add(name)
            fits = (
                name.startswith(prefix) if prefix else not name.startswith(("cmd_", "ref_", "est_"))
            )
            if not fits:
                raise located.error(
                    where,
                    f"the name '{name}'",
                    (
                        f"a name that begins with {prefix}"
                        if prefix
                        else "a measured signal, without prefix"
                    ),
                )
            _check_signal(located, where, name, signal, mapping)
    return mapping, located


def _check_signal(
    located: Located, where: tuple, name: str, signal: Signal, mapping: Mapping
) -> None:
    if signal.scale_variable is not None and mapping.format.kind not in ("mat", "npz"):
        raise located.error(
            (*where, "scale_variable"),
            "a variable",
            f"none: a {mapping.format.kind.upper()} file has no variables",
        )
    for key in ("topic", "stamp"):
        if getattr(signal, key) is not None and mapping.format.kind not in TOPIC_KINDS:
            raise located.error(
                (*where, key),
                f"a {key}",
                f"none: a {mapping.format.kind.upper()} file has no topics",
            )
    try:
        own = signal.column_of(name)
        line_of(own, signal.unit, signal.scale, signal.offset, mapping.atmosphere)
    except UnitError as error:
        found, _, expected = str(error).removeprefix("found ").partition(", expected ")
        if signal.integral:  # no such name stands in the file
            expected = expected.replace(f"the name {name}_s says", f"the speed of {name} has")
        raise located.error(where, found, expected) from None

"""The calibration file that a rig includes: each reading's line, how certain it is, who made it.

``epa calibrate`` writes it; a rig file names it under ``calibrations``. A log carries what was used
as ``applied_calibrations``, so that it decodes and replays by itself.
"""

import math
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import yaml
from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema, field_validator

from epa_rt.config.fields import Frozen, Name, written
from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.source import Located, load_yaml, named_file, parse_yaml, validate
from epa_rt.config.units import UnitError, parse_quantity, unit, with_unit
from epa_rt.config.whole_file import write_synced

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

APPLIED = "applied_calibrations"
MOST_POINTS = 1000
LARGEST_CHANGE = 2.0  # of the gain against the row's own: more is another sensor or a wrong unit
_HEAD = "# Written by epa calibrate. Do not edit: calibrate again instead.\n"
_COMMENT = "# taken from the calibration files"

Si = Annotated[float, written("the signal's own unit")]
PerNative = Annotated[float, written("the signal's unit per native unit, such as N/V")]
InNative = Annotated[float, written("the entry's native unit, such as V")]


class _OfSignal(Frozen):
    """Base of what has a signal's unit and an entry's; a subclass declares ``signal``, ``native``
    first.
    """

    signal: Name
    native: Literal["V", "mA", "count", "rpm", "permille", "1"]

    @field_validator("signal")
    @classmethod
    def _has_a_unit(cls, signal: str) -> str:
        if si_unit_of(signal) == "":
            raise UnitError(f"found the signal '{signal}', expected one with a unit")
        return signal


def _si(value: Any, info: ValidationInfo) -> float | None:
    """A value in the signal's unit; a gauge pressure where its sensor reads gauge."""
    return (
        None
        if value is None
        else parse_quantity(value, si_unit_of(info.data.get("signal", "x_ratio")))
    )


def _positive(value: Any, info: ValidationInfo) -> float | None:
    result = _si(value, info)
    if result is not None and not result >= 0.0:
        raise UnitError(f"found '{value}', expected zero or more")
    return result


def _per_native(value: Any, info: ValidationInfo) -> float:
    si_unit, native = (si_unit_of(info.data.get("signal", "x_ratio")), info.data.get("native", "1"))
    return parse_quantity(value, f"{si_unit}/({native})") * unit(native)[0]


def _native(value: Any, info: ValidationInfo) -> float:
    native = info.data.get("native", "1")
    return parse_quantity(value, native) / unit(native)[0]


def _pair(value: Any, info: ValidationInfo) -> tuple[float, float]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise UnitError(f"found {value!r}, expected a pair [low, high]")
    low, high = (parse_quantity(v, si_unit_of(info.data.get("signal", "x_ratio"))) for v in value)
    if not low < high:
        raise UnitError(f"found {list(value)!r}, expected the lower end first")
    return low, high


Range = Annotated[
    tuple[float, float],
    BeforeValidator(_pair),
    WithJsonSchema({"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2}),
]
Uncertainty = Annotated[Si, BeforeValidator(_positive)]


class CalibrationPoint(_OfSignal):
    """One point as it was fitted: the reference and its standard uncertainty; the reading's mean,
    the scatter of its samples, and the mean's standard uncertainty.
    """

    reference: Annotated[Si, BeforeValidator(_si)]
    reference_uncertainty: Uncertainty
    reading: Annotated[InNative, BeforeValidator(_native)]
    scatter: Annotated[InNative, BeforeValidator(_native)]
    reading_uncertainty: Annotated[InNative, BeforeValidator(_native)]
    direction: Literal["up", "down"] = "up"


class SignalCalibration(_OfSignal):
    """A reading's line: value = ``gain`` x native + ``offset``, with their standard uncertainties.

    ``reading_uncertainty``: of one reading at rest, all included. ``coverage_factor``: expanded (95
    %) over standard uncertainty. ``range``: the references, outside of which the line is
    extrapolated. Pressures are gauge where the row reads gauge. ``source``: what was calibrated.
    """

    kind: Literal["force", "pressure", "joint"]
    entry: Annotated[str, Field(max_length=130)]
    source: Literal["rig", "simulation", "log"]
    when: str
    operator: Annotated[str, Field(max_length=200)] = ""
    serial: Annotated[str, Field(max_length=200)] = ""
    method: Annotated[str, Field(max_length=400)] = ""
    gain: Annotated[PerNative, BeforeValidator(_per_native)]
    offset: Annotated[Si, BeforeValidator(_si)]
    gain_uncertainty: Annotated[PerNative, BeforeValidator(_per_native)]
    offset_uncertainty: Uncertainty
    correlation: Annotated[float, Field(ge=-1.0, le=1.0)]
    coverage_factor: Annotated[float, Field(ge=1.0, le=20.0)]
    reading_uncertainty: Uncertainty
    range: Range
    linearity: Uncertainty | None = None
    hysteresis: Uncertainty | None = None
    repeatability: Uncertainty | None = None
    zero_drift: Annotated[Si, BeforeValidator(_si)] | None = None
    points: Annotated[tuple[dict[str, Any], ...], Field(max_length=MOST_POINTS)] = ()

    @field_validator("operator", "serial", "method")
    @classmethod
    def _is_one_line(cls, value: str) -> str:
        if not value.isprintable():
            raise UnitError(f"found {value!r}, expected one line of text")
        return value

    @field_validator("when")
    @classmethod
    def _is_a_time(cls, value: str) -> str:
        try:
            time = datetime.fromisoformat(value)
        except ValueError:
            time = None
        if time is None or time.tzinfo is None:
            raise UnitError(f"found '{value}', expected a time as 2026-01-31T12:00:00Z")
        return value

    @field_validator("gain")
    @classmethod
    def _is_a_slope(cls, value: float) -> float:
        if not 1e-30 < abs(value) < 1e30:
            raise UnitError(f"found a gain of {value:g}, expected a line neither flat nor upright")
        return value

    @field_validator("gain_uncertainty")
    @classmethod
    def _is_not_negative(cls, value: float) -> float:
        if not value >= 0.0:
            raise UnitError(f"found {value:g}, expected zero or more")
        return value

    @field_validator("points", mode="before")
    @classmethod
    def _sound_points(cls, value: Any, info: ValidationInfo) -> Any:
        """Each point has the signal's units, which stand once above them."""
        if not isinstance(value, (list, tuple)) or not all(isinstance(v, dict) for v in value):
            raise UnitError("found something else, expected a list of points")
        above = {key: info.data[key] for key in ("signal", "native") if key in info.data}
        if len(above) == 2:
            for point in value:
                try:
                    CalibrationPoint.model_validate({**above, **point})
                except ValueError as error:
                    raise UnitError(
                        f"found {str(point)[:80]}, expected a point ({_first_line(error)})"
                    ) from None
        return tuple(value)

    @property
    def si_unit(self) -> str:
        return si_unit_of(self.signal)

    @property
    def fitted_points(self) -> tuple[CalibrationPoint, ...]:
        """The points, typed."""
        above = {"signal": self.signal, "native": self.native}
        return tuple(CalibrationPoint.model_validate({**above, **point}) for point in self.points)

    @property
    def gain_ratio_uncertainty(self) -> float:
        """Standard uncertainty of the gain over the gain."""
        return self.gain_uncertainty / abs(self.gain)

    @property
    def zero_uncertainty(self) -> float:
        """Standard uncertainty of the value where the line reads zero, in the signal's unit."""
        x = -self.offset / self.gain
        u, v = self.offset_uncertainty, x * self.gain_uncertainty
        return math.sqrt(max(0.0, u * u + v * v + 2.0 * self.correlation * u * v))

    @property
    def made(self) -> str:
        """When, by whom, on what."""
        by = f" by {self.operator}" if self.operator else ""
        return f"{self.when[:10]}{by}{'' if self.source == 'rig' else f', from a {self.source}'}"

    @property
    def line_words(self) -> str:
        """Gain and offset with their expanded (95 %) uncertainty, for people."""
        k, si, native = self.coverage_factor, self.si_unit, self.native
        percent = 100.0 * k * self.gain_ratio_uncertainty
        offset, u = self.offset, k * self.offset_uncertainty
        factor, unit_text = {"Pa": (1e-3, "kPa"), "rad": (57.29578, "deg")}.get(si, (1.0, si))
        return (
            f"{factor * self.gain:.6g} {unit_text}/{native} +-{percent:.2g} %,"
            f" {factor * offset:.5g} {unit_text} at 0 {native} +-{factor * u:.2g} (95 %)"
        )

    @property
    def facts(self) -> str:
        """One line for a log."""
        return f"{self.signal}: {self.line_words}; {self.made}"


class CalibrationFile(Frozen):
    """Calibrations of one rig's readings; each signal once."""

    calibration_of: Name
    signals: Annotated[tuple[SignalCalibration, ...], Field(min_length=1, max_length=63)]

    @field_validator("signals")
    @classmethod
    def _each_once(cls, value: tuple[SignalCalibration, ...]) -> tuple[SignalCalibration, ...]:
        names = [one.signal for one in value]
        for name in names:
            if names.count(name) > 1:
                raise UnitError(f"found '{name}' twice, expected each signal once")
        return value


def _first_line(error: ValueError) -> str:
    import pydantic

    if isinstance(error, pydantic.ValidationError):
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        return f"{where}: {first.get('ctx', {}).get('error', first['msg'])}"
    return str(error)


def calibration_path(rig_path: Path) -> Path:
    """``bench.calibration.yaml`` beside ``bench.yaml``."""
    return rig_path.with_name(f"{rig_path.stem}.calibration.yaml")


def read_calibrations(path: Path, rig_name: str) -> tuple[Located, CalibrationFile]:
    """A calibration file as text and typed. Raises ConfigError where it is damaged or another
    rig's.
    """
    located = load_yaml(path)
    file = validate(located, CalibrationFile)
    if file.calibration_of != rig_name:
        raise located.error(
            ("calibration_of",), f"'{file.calibration_of}'", f"'{rig_name}', the rig that names it"
        )
    return located, file


def written_calibration(one: SignalCalibration, with_points: bool) -> dict[str, Any]:
    """A calibration as plain data with units, as it stands in a file."""
    si, native = one.si_unit, one.native

    def in_si(value: float) -> str:
        return with_unit(f"{value:.9g}", si)

    per = si if native == "1" else f"{si}/{native}"
    words = ("signal", "native", "kind", "entry", "source", "when", "operator", "serial", "method")
    data: dict[str, Any] = {key: getattr(one, key) for key in words if getattr(one, key)}
    data |= {
        "gain": f"{one.gain:.9g} {per}",
        "offset": in_si(one.offset),
        "gain_uncertainty": f"{one.gain_uncertainty:.4g} {per}",
        "offset_uncertainty": in_si(one.offset_uncertainty),
        "correlation": round(one.correlation, 9),
        "coverage_factor": round(one.coverage_factor, 6),
        "reading_uncertainty": in_si(one.reading_uncertainty),
        "range": [in_si(end) for end in one.range],
    }
    for key in ("linearity", "hysteresis", "repeatability", "zero_drift"):
        if getattr(one, key) is not None:
            data[key] = in_si(getattr(one, key))
    if with_points and one.points:
        data["points"] = list(one.points)
    return data


def write_calibrations(path: Path, file: CalibrationFile) -> None:
    """Writes the file whole. Raises OSError."""
    data = {
        "calibration_of": file.calibration_of,
        "signals": [written_calibration(one, with_points=True) for one in file.signals],
    }
    text = yaml.safe_dump(data, sort_keys=False, allow_unicode=True, width=1000)
    write_synced(path, _HEAD + text)


def self_contained(rig: Located) -> Located:
    """A rig file's text with what its calibration files say, as a log is to carry it; itself where
    it names none. Raises ConfigError.
    """
    data = rig.data
    if not isinstance(data, dict) or not data.get("calibrations") or APPLIED in data:
        return rig
    names, rig_name = data["calibrations"], data.get("rig")
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise rig.error(
            ("calibrations",), "something else", "a list of files: [bench.calibration.yaml]"
        )
    found: list[dict[str, Any]] = []
    seen: dict[str, str] = {}
    for i, name in enumerate(names):
        if not name.endswith((".yaml", ".yml")):
            raise rig.error(("calibrations", i), f"'{name}'", "a file that ends in .yaml")
        beside = named_file(rig, ("calibrations", i), rig.path.parent / name)
        located, file = read_calibrations(beside, str(rig_name))
        for j, one in enumerate(file.signals):
            if one.signal in seen:
                raise located.error(
                    ("signals", j, "signal"),
                    f"'{one.signal}', which {seen[one.signal]} has already",
                    f"each signal once in the files that {rig.path.name}:"
                    f"{rig.line(('calibrations', i))} names",
                )
            seen[one.signal] = name
            _check_fits(one, located, j, data)
            found.append(written_calibration(one, with_points=False))
    section = yaml.safe_dump({APPLIED: found}, sort_keys=False, allow_unicode=True, width=1000)
    if rig.text.lstrip().startswith("{"):  # a file in one pair of braces: nothing can be appended
        return parse_yaml(yaml.safe_dump(data, sort_keys=False) + section, rig.path)
    return parse_yaml(f"{rig.text.rstrip()}\n\n{_COMMENT}\n{section}", rig.path)


def _check_fits(one: SignalCalibration, located: Located, j: int, data: dict[str, Any]) -> None:
    """The signal is a row of the rig, at the same entry. What is typed is checked with the rig."""
    signals = data.get("signals")
    rows = [row for row in signals if isinstance(row, dict)] if isinstance(signals, list) else []
    row = next((row for row in rows if row.get("name") == one.signal), None)
    if row is None:
        raise located.error(
            ("signals", j, "signal"), f"'{one.signal}'", "a signal of the rig that names the file"
        )
    if row.get("entry") != one.entry:
        raise located.error(
            ("signals", j, "entry"),
            f"'{one.entry}'",
            f"'{row.get('entry')}', where the rig has {one.signal}: calibrate the wiring as it is",
        )


def calibration_of(rig: "Rig", signal: str) -> SignalCalibration | None:
    """What was calibrated for a signal; None where the row's own line holds."""
    return next((one for one in rig.applied_calibrations if one.signal == signal), None)

"""Pydantic field types for quantities: text with a unit in the file, an SI float in the object."""

from typing import Annotated, Any, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
)

from epa_rt.config.units import UnitError, parse_pressure, parse_quantity, readable, readable_range

STANDARD_ATMOSPHERE_PA = 101_325.0
NAME_PATTERN = r"^[a-z][a-z0-9_]*$"
Name = Annotated[str, Field(pattern=NAME_PATTERN, max_length=60)]


_FROZEN = ConfigDict(frozen=True, extra="forbid", strict=False)


class FrozenChoice(BaseModel):
    """Base of types that a key of theirs chooses between (pydantic allows no validator on that
    key).
    """

    model_config = _FROZEN


class Frozen(BaseModel):
    """Base of every file type: frozen, unknown keys refused, no true for 1 and no '3' for 3."""

    model_config = _FROZEN

    @field_validator("*", mode="before")
    @classmethod
    def _of_its_own_kind(cls, value: Any, info: ValidationInfo) -> Any:
        annotation = cls.model_fields[info.field_name].annotation
        if isinstance(value, (bool, str)) and _takes(annotation, int):
            raise UnitError(f"found {value!r}, expected a whole number")
        if not isinstance(value, bool) and annotation is bool:
            raise UnitError(f"found {value!r}, expected true or false")
        return value


def _takes(annotation: Any, kind: type) -> bool:
    return annotation is kind or (
        not isinstance(annotation, str) and any(_takes(a, kind) for a in get_args(annotation))
    )


def atmosphere_pa(info: Any) -> float:
    """Atmospheric pressure of the rig that is being read (validation context), else the standard
    one.
    """
    return (info.context or {}).get("atmosphere_pa", STANDARD_ATMOSPHERE_PA)


def bounded(
    value: float, si_unit: str, low: float | None, high: float | None, shown: object
) -> float:
    """The value, or UnitError where it lies outside [low, high]."""
    if (low is not None and value < low) or (high is not None and value > high):
        if low is not None and high is not None:
            expected = readable_range((low, high), si_unit)
        elif low is not None:
            expected = f"at least {readable(low, si_unit)}"
        else:
            expected = f"at most {readable(high or 0.0, si_unit)}"
        raise UnitError(f"found '{shown}', expected {expected}")
    return value


def quantity(si_unit: str, low: float | None = None, high: float | None = None) -> Any:
    """Field type: '20 ms' in the file, SI float in the object, bounded in SI."""

    def parse(text: object) -> float:
        return bounded(parse_quantity(text, si_unit), si_unit, low, high, text)

    return Annotated[float, BeforeValidator(parse), written(si_unit)]


def written(si_unit: str) -> WithJsonSchema:
    """JSON schema of a quantity as it stands in the file."""
    return WithJsonSchema(
        {"type": ["string", "number"], "description": f"a number with a unit, as {si_unit}"}
    )


def pressure(low_pa: float = 0.0, high_pa: float = 2e6) -> Any:
    """Field type: '460 kPa gauge' in the file, absolute Pa in the object, bounded."""

    def parse(text: object, info: Any) -> float:
        return bounded(parse_pressure(text, atmosphere_pa(info)), "Pa abs", low_pa, high_pa, text)

    schema = {
        "type": "string",
        "pattern": "(gauge|abs)\\s*$",
        "description": "a pressure, gauge or abs",
    }
    return Annotated[float, BeforeValidator(parse), WithJsonSchema(schema)]


Pressure = pressure()

Seconds = quantity("s", 0.0)
Hertz = quantity("Hz", 0.0)
Amperes = quantity("A", 0.0)
PressureDifference = quantity("Pa", 0.0)
Ratio = quantity("1")

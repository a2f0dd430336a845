"""Pydantic field types for quantities: text with a unit in the file, an SI float in the object."""

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema

from epa_rt.config.units import UnitError, parse_pressure, parse_quantity

STANDARD_ATMOSPHERE_PA = 101_325.0
NAME_PATTERN = r"^[a-z][a-z0-9_]*$"
Name = Annotated[str, Field(pattern=NAME_PATTERN, max_length=60)]


class Frozen(BaseModel):
    """Base of every file type: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


def atmosphere_pa(info: Any) -> float:
    """Atmospheric pressure of the rig that is being read (validation context), else the standard one."""
    return (info.context or {}).get("atmosphere_pa", STANDARD_ATMOSPHERE_PA)


def bounded(value: float, si_unit: str, low: float | None, high: float | None, shown: object) -> float:
    """The value, or UnitError where it lies outside [low, high]."""
    if (low is not None and value < low) or (high is not None and value > high):
        if high is None:
            expected = f"at least {low:g} {si_unit}"
        elif low is None:
            expected = f"at most {high:g} {si_unit}"
        else:
            expected = f"{low:g} to {high:g} {si_unit}"
        raise UnitError(f"found '{shown}', expected {expected}")
    return value


def quantity(si_unit: str, low: float | None = None, high: float | None = None) -> Any:
    """Field type: '20 ms' in the file, SI float in the object, bounded in SI."""

    def parse(text: object) -> float:
        return bounded(parse_quantity(text, si_unit), si_unit, low, high, text)

    schema = {"type": ["string", "number"], "description": f"a number with a unit, as {si_unit}"}
    return Annotated[float, BeforeValidator(parse), WithJsonSchema(schema)]


def _pressure(text: object, info: Any) -> float:
    return bounded(parse_pressure(text, atmosphere_pa(info)), "Pa abs", 0.0, 2e6, text)


Pressure = Annotated[
    float,
    BeforeValidator(_pressure),
    WithJsonSchema({"type": "string", "pattern": "(gauge|abs)\\s*$", "description": "a pressure, gauge or abs"}),
]

Seconds = quantity("s", 0.0)
Hertz = quantity("Hz", 0.0)
Amperes = quantity("A", 0.0)
PressureDifference = quantity("Pa", 0.0)
Ratio = quantity("1")

"""Reads the written quantities of an experiment file against a rig; every error names the line."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from epa_rt.config.rig import Rig
from epa_rt.config.source import ConfigError, Located, Location
from epa_rt.config.units import UnitError, parse_pressure, parse_quantity
from epa_rt.experiments.coordinate import Coordinate

# how a person reads it: factor from SI, unit
_SHOWN = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "deg"), "N*m": (1e3, "mNm")}


def show(value: float, si_unit: str, rate: str = "") -> str:
    """An SI value in mm, deg or mNm (and /s, /s^2) for a sentence."""
    factor, name = _SHOWN.get(si_unit, (1.0, si_unit))
    return f"{value * factor:.6g} {name}{rate}"


@dataclass(frozen=True)
class Reader:
    """One phase (``where``) in one repetition (``values``: what stands for each $name)."""

    located: Located
    rig: Rig
    where: Location
    values: Mapping[str, str]

    def error(self, keys: Location, found: str, expected: str) -> ConfigError:
        return self.located.error((*self.where, *keys), found, expected)

    def text(self, keys: Location, written: str) -> str:
        """What was written, or what its $name stands for. Raises ConfigError."""
        if not written.startswith("$"):
            return written
        if written[1:] not in self.values:
            known = ", ".join(f"${name}" for name in self.values) or "a name given under 'repeat'"
            raise self.error(keys, f"'{written}', which nothing defines", known)
        return self.values[written[1:]]

    def quantity(self, keys: Location, written: str, si_unit: str) -> float:
        """SI value of a quantity of the given dimension. Raises ConfigError."""
        try:
            return parse_quantity(self.text(keys, written), si_unit)
        except UnitError as error:
            raise self._unit_error(keys, written, error) from None

    def positive(self, keys: Location, written: str, si_unit: str) -> float:
        value = self.quantity(keys, written, si_unit)
        if not value > 0.0:
            raise self.error(keys, f"'{self.text(keys, written)}'", "a value above zero")
        return value

    def cycles(self, keys: Location, written: str) -> int:
        """Bus cycles of a duration, at least one. Raises ConfigError."""
        count = round(self.positive(keys, written, "s") / self.rig.period_s)
        if count < 1:
            raise self.error(
                keys,
                f"'{self.text(keys, written)}'",
                f"at least one cycle of {self.rig.period_s * 1e3:g} ms",
            )
        return count

    def pressure(self, keys: Location, written: str) -> float:
        """Absolute Pa. Raises ConfigError."""
        try:
            return parse_pressure(self.text(keys, written), self.rig.atmosphere_pa)
        except UnitError as error:
            raise self._unit_error(keys, written, error) from None

    def position(self, keys: Location, written: str, coordinate: Coordinate) -> float:
        """SI position of a place or a quantity, within the limits of the controlled row. Raises
        ConfigError.
        """
        text = self.text(keys, written)
        if text in coordinate.places:
            return coordinate.places[text]
        if text[:1].isalpha():
            known = ", ".join(coordinate.places) or "none"
            raise self.error(
                keys,
                f"the place '{text}'",
                f"a position with its unit, or a place of this rig: {known}",
            )
        value = self.quantity(keys, written, coordinate.si_unit)
        low, high = coordinate.limits
        if not low <= value <= high:
            raise self.error(
                keys,
                f"'{text}'",
                f"a position within the rig's limits, {show(low, coordinate.si_unit)} to"
                f" {show(high, coordinate.si_unit)}",
            )
        return value

    def speed(self, keys: Location, written: str, coordinate: Coordinate) -> float:
        """Speed in SI, above zero and at most what the rig allows. Raises ConfigError."""
        return self._limited(keys, written, coordinate.si_unit, "/s", coordinate.speed_max)

    def acceleration(self, keys: Location, written: str | None, coordinate: Coordinate) -> float:
        """Acceleration in SI, half of what the rig allows where none is written. Raises
        ConfigError.
        """
        if written is None:
            return 0.5 * coordinate.acceleration_max
        return self._limited(keys, written, coordinate.si_unit, "/s^2", coordinate.acceleration_max)

    def frequency(self, keys: Location, written: str) -> float:
        """Hz, slow enough for the period: at least 20 cycles per wave, a tenth of Nyquist. Raises
        ConfigError.
        """
        value = self.positive(keys, written, "Hz")
        highest = 0.05 / self.rig.period_s
        if value > highest:
            raise self.error(
                keys,
                f"'{self.text(keys, written)}'",
                f"at most {highest:g} Hz, a tenth of Nyquist at a period of"
                f" {self.rig.period_s * 1e3:g} ms",
            )
        return value

    def _limited(
        self, keys: Location, written: str, si_unit: str, rate: str, highest: float
    ) -> float:
        value = self.positive(keys, written, si_unit + rate)
        if value > highest:
            raise self.error(
                keys,
                f"'{self.text(keys, written)}'",
                f"at most the rig's limit, {show(highest, si_unit, rate)}",
            )
        return value

    def _unit_error(self, keys: Location, written: str, error: UnitError) -> ConfigError:
        found, expected = str(error).removeprefix("found ").split(", expected ", 1)
        return self.error(
            keys, found + (f" for {written}" if written.startswith("$") else ""), expected
        )

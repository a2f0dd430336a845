"""Reference values as an operator writes them: '49.05 N', '5.000 kg', '200 kPa abs', '30 deg'."""

import math
from dataclasses import dataclass

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import SignalRow
from epa_rt.config.units import UnitError, parse_quantity, split_quantity, unit

STANDARD_GRAVITY = 9.80665  # m/s^2
# 9.780 to 9.832 m/s^2 from equator to pole: uniform, where nobody says which
UNKNOWN_GRAVITY_U = (9.832 - 9.780) / (2.0 * math.sqrt(3.0)) / STANDARD_GRAVITY


@dataclass(frozen=True)
class Reader:
    """Reads references of one signal. ``gravity``: m/s^2, for masses. ``uncertainty``: standard,
    in the signal's unit; None: a step of the last digit written, uniform.
    """

    row: SignalRow
    atmosphere_pa: float
    gravity: float = STANDARD_GRAVITY
    uncertainty: float | None = None

    def read(self, text: str) -> tuple[float, float, bool]:
        """Value in the signal's unit (as the row reads: gauge or absolute), its standard
        uncertainty, and whether it was a mass. Raises UnitError.
        """
        text, shift = self._against(text.strip())
        number, unit_text = split_quantity(text)
        si_unit, factor, mass = self.row.si_unit, 1.0, False
        if si_unit == "N" and unit_text and unit(unit_text)[1] == unit("kg")[1]:
            factor, mass, si_unit = self.gravity, True, "kg"
        value = parse_quantity(text, si_unit) * factor
        digit = _last_digit(text) * unit(unit_text)[0] * factor
        u = self.uncertainty if self.uncertainty is not None else digit / math.sqrt(12.0)
        return value + shift, max(u, 1e-9 * abs(value), 1e-300), mass

    def _against(self, text: str) -> tuple[str, float]:
        """The text without 'gauge' or 'abs', and what is to be added. Without either: as read."""
        for word in ("gauge", "abs"):
            if text.endswith(word):
                if self.row.si_unit != "Pa":
                    raise UnitError(f"found '{text}', expected {word} behind pressures only")
                reads_gauge = self.row.reads == "gauge"
                shift = 0.0
                if word == "gauge" and not reads_gauge:
                    shift = self.atmosphere_pa
                if word == "abs" and reads_gauge:
                    shift = -self.atmosphere_pa
                return text.removesuffix(word).strip(), shift
        return text, 0.0


def reader_of(rig: Rig, signal: str, gravity: float, uncertainty: float | None) -> Reader:
    """The reader of a rig's signal."""
    return Reader(rig.row(signal), rig.atmosphere_pa, gravity, uncertainty)


def _last_digit(text: str) -> float:
    """Size of the last digit written: 0.01 of '49.05 N', 10 of '1.2e2'."""
    number = text.split()[0] if text.split() else "0"
    while number and not (number[-1].isdigit() or number[-1] == "."):
        number = number[:-1]
    mantissa, _, exponent = number.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    return float(10.0 ** ((int(exponent) if exponent else 0) - decimals))

"""The file of a study: which plant, which sine, which pressures and frequencies. Numbers carry
their unit.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.config.kinds import expect_kind
from epa_rt.config.source import Located, Location, load_yaml, named_file
from epa_rt.config.units import UnitError, parse_pressure, parse_quantity, with_unit
from epa_rt.models.plant_file import PlantFile, load_plant

MOST_POINTS = 400


class Setting:
    """A study file, read key by key; every error names file and line (ConfigError)."""

    def __init__(self, source: Located, kind: str, keys: tuple[str, ...]):
        self.source = source
        expect_kind(source, "study")
        for key in source.data:
            if key not in ("study", *keys):
                raise source.error((key,), f"'{key}'", "one of " + ", ".join(("study", *keys)))
        if source.data.get("study") != kind:
            raise source.error(("study",), repr(source.data.get("study")), f"study: {kind}")

    def quantity(
        self, key: str, unit: str, low: float, high: float, default: float | None = None
    ) -> float:
        """A number in SI inside [low, high]."""
        if key not in self.source.data and default is not None:
            return default
        value = self._value((key,), self._there(key), lambda text: parse_quantity(text, unit))
        if not low <= value <= high:
            raise self.source.error(
                (key,), str(self.source.data[key]), with_unit(f"{low:g} to {high:g}", unit)
            )
        return value

    def pressures(self, key: str, atmosphere_pa: float) -> np.ndarray:
        """Absolute pressures (Pa): {from, to, points}, or a list of pressures in which 'none' is a
        vented muscle.
        """

        def read(text: Any) -> float:
            return atmosphere_pa if text == "none" else parse_pressure(text, atmosphere_pa)

        return self._row(key, read, 1e3, 2e6, "an absolute pressure from 1 kPa to 2 MPa")

    def frequencies(self, key: str) -> np.ndarray:
        """Angular frequencies (rad/s): {from, to, points} or a list, in Hz or rad/s."""
        return self._row(key, angular, 0.1, 1e3, "a frequency from 0.1 to 1000 rad/s")

    def pressure(self, where: Location, text: Any) -> float:
        """One absolute pressure (Pa); it must say 'abs'."""
        return self._value(where, text, lambda said: parse_pressure(said, math.nan))

    def file(self, key: str) -> Path:
        """The file named under ``key``, beside this one; it is there."""
        name = self._there(key)
        if not isinstance(name, str):
            raise self.source.error((key,), repr(name), "the name of a file")
        return self._beside((key,), name)

    def plant(self, key: str) -> PlantFile:
        """The plant file named under ``key``, beside this file."""
        return load_plant(self.file(key))

    def plants(self, key: str) -> tuple[PlantFile, ...]:
        """The plant files listed under ``key``; none where it is not there."""
        names = self.source.data.get(key, [])
        for i, name in enumerate(names if isinstance(names, list) else [None]):
            if not isinstance(name, str):
                raise self.source.error((key, i), repr(name or names), "a list of plant files")
        return tuple(load_plant(self._beside((key, i), name)) for i, name in enumerate(names))

    def _beside(self, where: Location, name: str) -> Path:
        return named_file(self.source, where, self.source.path.parent / name)

    def _there(self, key: str) -> Any:
        if key not in self.source.data:
            raise self.source.error((), f"no '{key}'", f"'{key}:'")
        return self.source.data[key]

    def _row(self, key: str, read, low: float, high: float, expected: str) -> np.ndarray:
        said = self._there(key)
        if isinstance(said, list):
            values = np.array([self._value((key, i), one, read) for i, one in enumerate(said)])
        elif isinstance(said, Mapping):
            values = self._span(key, said, read)
        else:
            raise self.source.error((key,), repr(said), "{from, to, points} or a list")
        if not 1 <= len(values) <= MOST_POINTS or len(set(values)) < len(values):
            raise self.source.error(
                (key,), f"{len(values)} values", f"1 to {MOST_POINTS} different ones"
            )
        if not (np.all(values >= low) and np.all(values <= high)):
            raise self.source.error((key,), str(said), expected)
        return values

    def _span(self, key: str, said: Mapping, read) -> np.ndarray:
        for name in said:
            if name not in ("from", "to", "points"):
                raise self.source.error((key, name), f"'{name}'", "from, to, points")
        for name in ("from", "to", "points"):
            if name not in said:
                raise self.source.error((key,), f"no '{name}'", "from, to, points")
        count = said["points"]
        if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= MOST_POINTS:
            raise self.source.error(
                (key, "points"), repr(count), f"a whole number from 2 to {MOST_POINTS}"
            )
        ends = [self._value((key, name), said[name], read) for name in ("from", "to")]
        return np.linspace(*ends, count).round(9)

    def _value(self, where: Location, text: Any, read) -> float:
        try:
            return float(read(text))
        except UnitError as error:
            found, _, expected = str(error).removeprefix("found ").partition(", expected ")
            raise self.source.error(where, found, expected) from None


def angular(text: Any) -> float:
    """rad/s of a frequency in Hz or rad/s. Raises UnitError."""
    try:
        return parse_quantity(text, "rad/s")
    except UnitError as error:
        try:
            return 2.0 * math.pi * parse_quantity(text, "Hz")
        except UnitError:
            raise UnitError(f"{error} or Hz") from None


def load_setting(path: Path, kind: str, keys: tuple[str, ...]) -> Setting:
    """Raises ConfigError."""
    return Setting(load_yaml(path), kind, keys)

"""Columns that grow row by row; whole numbers stay exact, as stamps in ns of today must."""

import math
from array import array
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from epa_rt.logs.importers.address import NoSuchPlace, number_of, steps_of, value_at
from epa_rt.logs.importers.table import ImportRefused, may_be_missing, missing_hint, shown

_LARGEST_WHOLE = 10**300  # what a double can hold


class Column:
    """Numbers of one column: int64 as long as all of them are whole, float64 from then on."""

    def __init__(self) -> None:
        self._values: array[Any] = array("q")

    def append(self, value: int | float) -> None:
        if self._values.typecode == "q":
            if type(value) is int and -(2**63) <= value < 2**63:
                self._values.append(value)
                return
            self._values = array("d", self._values)
        self._values.append(value)

    def values(self) -> np.ndarray:
        """(N,) int64 or float64."""
        kind = np.int64 if self._values.typecode == "q" else np.float64
        return np.frombuffer(self._values, kind) if len(self._values) else np.empty(0)


class FieldColumns:
    """The wanted fields of messages or JSON lines, by address."""

    def __init__(self, wanted: Sequence[str | int], missing: Sequence[str]) -> None:
        """Raises ImportRefused where a column is a number or no address."""
        self._missing = missing
        self._columns: dict[str, tuple[tuple, Column]] = {}
        for address in wanted:
            if isinstance(address, int):
                raise ImportRefused(
                    f"column {address}: found a number, expected the name of a field"
                )
            try:
                self._columns[address] = (steps_of(address), Column())
            except NoSuchPlace as error:
                raise ImportRefused(
                    f"column {shown(address)}: found {error}, expected one such as 'a.b[2]' or"
                    " 'position[knee]'"
                ) from None

    def add(self, place: Callable[[], str], content: Any, given: Mapping[str, int]) -> None:
        """A row. ``given``: fields that stand beside the message, such as log_time.

        Raises ImportRefused for a field that is missing or no number.
        """
        for address, (steps, column) in self._columns.items():
            if address in given:
                column.append(given[address])
                continue
            try:
                value = value_at(content, address, steps)
            except NoSuchPlace as error:
                raise ImportRefused(
                    f"{place()}: field {shown(address)}: found {error}, expected a list with it"
                    " (by number they count from 0)"
                ) from None
            column.append(self._number(place, address, value))

    def _number(self, place: Callable[[], str], address: str, value: Any) -> int | float:
        number, word = number_of(value), ""
        if isinstance(number, float) and not math.isfinite(number):
            word = "nan" if math.isnan(number) else ""
        elif number is not None and abs(number) < _LARGEST_WHOLE:
            return number
        elif value is None:
            word = "null"
        if word and may_be_missing(word, self._missing):
            return math.nan
        found = "nothing" if value is None else shown(str(value))
        raise ImportRefused(
            f"{place()}: field {shown(address)}: found {found}, expected a"
            f" number{missing_hint(word)}"
        )

    def arrays(self) -> dict[str | int, np.ndarray]:
        """(N,) each."""
        return {address: column.values() for address, (_, column) in self._columns.items()}

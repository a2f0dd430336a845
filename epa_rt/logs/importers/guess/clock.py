"""Which column is the clock of a table, in which unit, and how even its steps are."""

from dataclasses import dataclass, replace

import numpy as np

from epa_rt.config.units import unit
from epa_rt.logs.importers.grid import grid_of
from epa_rt.logs.importers.guess.seen import Seen
from epa_rt.logs.importers.guess.words import words_of
from epa_rt.logs.importers.mapping import Clock
from epa_rt.logs.importers.table import ImportRefused, Table

_UNITS = ("s", "ms", "us", "ns")
_SLOWEST_HZ, _FASTEST_HZ = 1.0, 5000.0
"""Rates at which rigs are recorded; a unit that leads outside of them is none."""
_FIRST_EPOCH_S, _LAST_EPOCH_S = 9.5e8, 4.2e9  # dates from 2000 to 2103
_GAP_PERIODS = 5.0
_LONGEST_NICE = 3e-3  # relative: a period this near to a round one is the round one
_NICE_MS = (0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 2.5, 4.0, 5.0, 8.0, 10.0, 20.0, 25.0, 40.0, 50.0, 100.0)


@dataclass(frozen=True)
class ClockGuess:
    """``column`` None where only a ``rate_hz`` is known; ``gaps``: (last row before, gap in s);
    ``unsure``: in words.
    """

    column: str | int | None
    unit: str
    period_s: float
    resample: bool
    gaps: tuple[tuple[int, float], ...]
    unsure: tuple[str, ...]
    why: str
    back_at: int | None = None

    @property
    def factor(self) -> float:
        return unit(self.unit)[0]


def clock_of(seen: Seen) -> ClockGuess:
    """The clock of a table; a rate of 1 Hz where nothing in it counts time."""
    named: list[tuple[int, str | int]] = []  # rank and column; the lower the likelier
    for column, values in seen.columns.items():
        part = words_of(seen.name(column)).part
        if part not in ("clock", "counter") and not _is_even(values):
            continue
        if _goes_on(values):
            rank = {"clock": 0, "counter": 2}.get(part, 1)
            named.append((-1 if column == "header.stamp" else rank, column))
    back = _that_goes_back(seen)
    if back is not None and not any(rank <= 0 for rank, _ in named):
        return back
    if not named:
        return _by_scalar(seen)
    rank, column = min(named, key=lambda one: one[0])
    found = _judged(seen, column)
    if rank == 2 or rank == 1 and _counts_rows(seen.columns[column]):
        return _counter(seen, column)
    others = [seen.name(c) for r, c in named if r == rank == 0 and c != column]
    if others:
        doubt = f"{', '.join(map(repr, others[:3]))} may be the clock as well"
        found = replace(found, unsure=(*found.unsure, doubt))
    if rank == 1 and (len(named) > 1 or column != next(iter(seen.columns))):
        found = replace(
            found, unsure=(*found.unsure, f"{seen.name(column)!r} is taken, for it grows evenly")
        )
    return found


def _goes_on(values: np.ndarray) -> bool:
    return len(values) > 2 and not np.isnan(values).any() and bool(np.all(np.diff(values) > 0))


def _is_even(values: np.ndarray) -> bool:
    """Grows by nearly the same step on most rows."""
    if not _goes_on(values):
        return False
    steps = np.diff(values).astype(float)
    middle = float(np.median(steps))
    return bool(np.mean(np.abs(steps - middle) < 0.2 * middle) > 0.8)


def _counts_rows(values: np.ndarray) -> bool:
    return bool(np.all(np.diff(values) == 1)) and values[0] in (0, 1)


def _that_goes_back(seen: Seen) -> ClockGuess | None:
    """A column that is called a clock, but goes back or stands still somewhere."""
    for column, values in seen.columns.items():
        if words_of(seen.name(column)).part != "clock" or np.isnan(values).any() or len(values) < 3:
            continue
        steps = np.diff(values).astype(float)
        if np.mean(steps > 0) > 0.5 and not np.all(steps > 0):
            row = int(np.argmax(steps <= 0)) + 1
            found = _judged(replace(seen, columns={column: values[:row]}), column)
            word = "stands still" if steps[row - 1] == 0 else "goes back"
            return replace(
                found,
                back_at=row,
                unsure=(
                    *found.unsure,
                    f"time {word} at row {row} of {len(values)}: the file cannot be read before it"
                    " is split there, or its stamps are mended",
                ),
            )
    return None


def _by_scalar(seen: Seen) -> ClockGuess:
    for name, value in seen.scalars.items():
        low = name.lower().rpartition(".")[2]
        if (
            low in ("fs", "rate", "freq", "sample_rate", "samplerate", "hz", "rate_hz")
            and value > 0
        ):
            return ClockGuess(None, "s", 1.0 / value, False, (), (), f"the scalar {name}")
        if low in ("dt", "ts", "period", "dt_s") and 0 < value < 100:
            return ClockGuess(None, "s", value, False, (), (), f"the scalar {name}")
    return ClockGuess(
        None, "s", 1.0, False, (), ("no column counts time: FILL IN the rate",), "nothing"
    )


def _counter(seen: Seen, column: str | int) -> ClockGuess:
    found = _by_scalar(seen)
    if not found.unsure:
        return found
    return replace(
        found,
        unsure=(f"{seen.name(column)!r} counts rows and no column counts time: FILL IN the rate",),
    )


def _judged(seen: Seen, column: str | int) -> ClockGuess:
    values = seen.columns[column]
    if len(values) < 3:
        return ClockGuess(column, "s", 1.0, False, (), ("too few rows",), "its name")
    steps = np.diff(values).astype(float)
    step = float(np.median(steps))
    text, why, unsure = _unit(seen, column, float(values[0]), step)
    factor = unit(text)[0]
    t = (values - values[0]).astype(float) * factor
    period_s, resample = _period(column, t, step * factor)
    gaps = tuple(
        (int(row), float(t[row + 1] - t[row]))
        for row in np.flatnonzero(np.diff(t) > _GAP_PERIODS * period_s)
    )
    return ClockGuess(column, text, period_s, resample, gaps, unsure, why)


def _unit(
    seen: Seen, column: str | int, first: float, step: float
) -> tuple[str, str, tuple[str, ...]]:
    """Unit of the stamps, why, and what is unsure about it."""
    if column in ("header.stamp", "log_time", "publish_time"):
        return "ns", "stamps of messages", ()
    epochs = [u for u in _UNITS if _FIRST_EPOCH_S < first * unit(u)[0] < _LAST_EPOCH_S]
    if len(epochs) == 1:
        return epochs[0], "its stamps are dates", ()
    fits = [u for u in _UNITS if _SLOWEST_HZ <= 1.0 / (step * unit(u)[0]) <= _FASTEST_HZ]
    words = words_of(seen.name(column))
    said = words_of(f"x [{seen.units[column]}]").unit if column in seen.units else words.unit
    if said is None and words.tokens and words.tokens[-1] in ("millis", "micros", "nanos"):
        said = words_of(f"x_{words.tokens[-1]}").unit
    if said is not None and said.quantity == "time":
        unsure: tuple[str, ...] = ()
        if fits and said.text not in fits:
            unsure = (
                f"its name says {said.text}, which gives a rate of"
                f" {1.0 / (step * unit(said.text)[0]):.4g} Hz; {fits[0]} would give"
                f" {1.0 / (step * unit(fits[0])[0]):.4g} Hz",
            )
        return said.text, "its name", unsure
    if len(fits) == 1:
        return fits[0], "a step that gives a rate of recordings in this unit alone", ()
    text = min(
        fits or ["s"], key=lambda u: abs(np.log10(1.0 / (step * unit(u)[0])) - np.log10(200.0))
    )
    rates = " or ".join(f"{1.0 / (step * unit(u)[0]):.4g} Hz in {u}" for u in fits or ["s"])
    return text, "the likelier rate", (f"its unit: steps of {step:.6g} give {rates}",)


def _period(column: str | int, t: np.ndarray, step_s: float) -> tuple[float, bool]:
    """Period of the grid, and whether rows have to be put onto it."""
    table = Table("", {column: t}, lambda row: "")
    mean_s = float(t[-1] / (len(t) - 1))
    for period_s in dict.fromkeys((_nice(step_s), step_s, _nice(mean_s), mean_s)):
        try:
            clock = Clock(column=column, unit="s", period=f"{period_s:.12g} s")
            grid = grid_of(table, clock)
        except (ImportRefused, ValueError):
            continue
        if len(grid.cycle) and not grid.resampled:
            return period_s, False
    return _nice(step_s), True


def _nice(period_s: float) -> float:
    """A round period that is near, else the period itself to six digits."""
    for nice_ms in (*_NICE_MS, *(10.0 * ms for ms in _NICE_MS)):
        if abs(period_s * 1e3 / nice_ms - 1.0) < _LONGEST_NICE:
            return nice_ms * 1e-3
    return float(f"{period_s:.6g}")

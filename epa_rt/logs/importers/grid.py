"""Stamps to the log's regular grid of cycles: taken as they are where they lie on it, else put
there and said so.
"""

from dataclasses import dataclass

import numpy as np

from epa_rt.config.units import unit
from epa_rt.logs.importers.mapping import Clock
from epa_rt.logs.importers.table import ImportRefused, Table

MOST_CYCLES = 50_000_000
_GAP_PERIODS = 3.0
_TYPICAL_PERIODS = 1.5  # between most rows: more is no lost row but another period
# rows that a refusal hangs its grid on: the row named is where stamps leave it, not the first of
# them all
_FEW = 50


@dataclass(frozen=True)
class Grid:
    """``cycle`` (M,) from 0 with holes where rows are lost, ``t_s`` (M,) stamps since the first
    row, and what was done, in words.
    """

    period_s: float
    cycle: np.ndarray
    t_s: np.ndarray
    resampled: bool
    says: tuple[str, ...]


def stamps_s(table: Table, clock: Clock) -> np.ndarray:
    """Stamps in s, not yet from zero. Raises ImportRefused where time stands still or goes back."""
    if clock.column is None:
        return np.arange(table.rows) / clock.rate
    raw = table.columns[clock.column] * unit(clock.unit)[0]
    bad = np.flatnonzero(~(np.diff(raw) > 0.0))
    if np.isnan(raw).any():
        raise ImportRefused(
            f"{table.place(int(np.isnan(raw).argmax()))}: found no stamp, expected one on every row"
        )
    if len(bad):
        row = int(bad[0]) + 1
        back_s = raw[row - 1] - raw[row]
        what = (
            "the same stamp as on the row before"
            if back_s == 0.0
            else f"a stamp {back_s:g} s before that of the row before"
        )
        raise ImportRefused(f"{table.place(row)}: found {what}, expected time to go on")
    return raw


def grid_of(table: Table, clock: Clock) -> Grid:
    """The grid that the main table's stamps lie on, or are put on. Raises ImportRefused where they
    do not fit.
    """
    t = stamps_s(table, clock)
    t = t - t[0]
    if len(t) < 2:
        raise ImportRefused(f"{table.place(0)}: found one row, expected two at least")
    if clock.column is None:
        return Grid(1.0 / clock.rate, np.arange(len(t)), t, False, ())
    mean_s = float(
        t[-1] / (len(t) - 1)
        # a tenth off at either end shifts the mean step by more than a tenth over the log, but
        # hardly the line through all rows
    )
    periods_s = (
        (clock.period,)
        if clock.period
        else (mean_s, float(np.polyfit(np.arange(len(t)) / len(t), t, 1)[0] / len(t)))
    )
    period_s = periods_s[0]
    if t[-1] / period_s > MOST_CYCLES:
        raise ImportRefused(
            f"{table.place(len(t) - 1)}: found a stamp {t[-1] / period_s:.3g} periods after the"
            f" first, expected at most {MOST_CYCLES}"
        )
    typical_s = float(np.median(np.diff(t)))
    if typical_s > _TYPICAL_PERIODS * period_s and clock.resample is None:
        raise ImportRefused(
            f"{table.place(1)}: found rows {typical_s:.6g} s apart as a rule, expected the period"
            f" of {period_s:.6g} s that the mapping gives (is the clock's unit right?)"
        )
    for even_s in periods_s:
        cycle, _, wrong = _on(t, even_s, clock)
        if not wrong.any():
            return Grid(even_s, cycle, t, False, _lost_words(cycle, even_s))
    if clock.resample is None:
        raise ImportRefused(_leaves(table, t, period_s, clock))
    return _resampled(table, t, period_s, clock)


def _on(
    t: np.ndarray, period_s: float, clock: Clock, rows: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Every row's cycle (M,) from 0 on the even grid that lies in the midst of the stamps (of the
    first ``rows``), s off it, and whether that or a cycle taken twice is wrong.

    No single stamp is the grid's origin: one that came early would put all others off.
    """
    turn = np.exp(2j * np.pi / period_s * t[:rows])
    phase_s = np.angle(turn.mean()) / (2.0 * np.pi) * period_s
    phase_s += np.median((t[:rows] - phase_s + 0.5 * period_s) % period_s) - 0.5 * period_s
    cycle = np.rint((t - phase_s) / period_s).astype(np.int64)
    off_s = np.abs(t - phase_s - cycle * period_s)
    return (
        cycle - cycle[0],
        off_s,
        (off_s > _jitter_s(period_s, clock)) | (np.diff(cycle, prepend=cycle[0] - 1) <= 0),
    )


def _jitter_s(period_s: float, clock: Clock) -> float:
    return 0.1 * period_s if clock.jitter is None else clock.jitter


def _leaves(table: Table, t: np.ndarray, period_s: float, clock: Clock) -> str:
    """The refusal, with the row where the stamps leave the grid of the first rows; the first that
    is off the grid of all where none does.
    """
    _, off_s, wrong = _on(t, period_s, clock, _FEW)
    if not wrong.any():
        _, off_s, wrong = _on(t, period_s, clock)
    row = int(np.argmax(wrong))
    typical_s = float(np.median(np.diff(t)))
    dense = (
        f"; rows are {typical_s:.6g} s apart as a rule: is the clock's unit right?"
        if _TYPICAL_PERIODS * typical_s < period_s
        else ""
    )
    jitter_s = _jitter_s(period_s, clock)
    what = (
        f"found a stamp {off_s[row] * 1e3:.6g} ms off a grid of {period_s * 1e3:.6g} ms, expected"
        f" at most {jitter_s * 1e3:.6g} ms"
        if off_s[row] > jitter_s
        else f"found a stamp {(t[row] - t[row - 1]) * 1e3:.6g} ms after that of the row before, in"
        f" the same cycle of {period_s * 1e3:.6g} ms, expected one row a cycle"
    )
    return (
        f"{table.place(row)}: {what} (give another period or jitter, or 'resample: linear', under"
        f" clock{dense})"
    )


@dataclass(frozen=True)
class Beside:
    """A table against the grid: its stamps ``t_s`` (N,) since the main table's first row, whether
    they are the grid's own, the cycles (M,) that lie outside of its time and in its gaps, and what
    was found, in words.
    """

    t_s: np.ndarray
    as_is: bool
    outside: np.ndarray
    in_gap: np.ndarray
    says: tuple[str, ...] = ()


def beside(grid: Grid, table: Table, clock: Clock, main: np.ndarray) -> Beside:
    """Where any table has rows on the grid. ``main``: raw stamps of the main table. Raises
    ImportRefused as ``stamps_s``.
    """
    t, none = stamps_s(table, clock) - main[0], np.zeros(len(grid.t_s), bool)
    if not grid.resampled and len(t) == len(grid.t_s) and np.array_equal(t, grid.t_s):
        return Beside(t, True, none, none)
    slack_s = 0.5 * grid.period_s
    outside = (grid.t_s < t[0] - slack_s) | (grid.t_s > t[-1] + slack_s)
    if outside.all():
        raise ImportRefused(
            f"{table.place(0)}: found rows from {t[0]:.6g} s to {t[-1]:.6g} s by the clock of the"
            f" first file's, which go from 0 s to {grid.t_s[-1]:.6g} s, expected some at the same"
            " time (is it one recording, and the clocks' origin and unit the same?)"
        )
    if len(t) < 2:
        return Beside(t, False, outside, none)
    typical_s = float(
        np.median(np.diff(t))
    )  # a table may be slower than the grid: its usual step is no gap
    max_gap_s = (
        _GAP_PERIODS * max(typical_s, grid.period_s)
        if clock.max_gap is None
        else max(clock.max_gap, _TYPICAL_PERIODS * typical_s)
    )
    after, on_row = _around(t, grid.t_s, slack_s)
    in_gap = ~outside & ~on_row & (t[after] - t[after - 1] > max_gap_s)
    rows = np.unique(after[in_gap])
    if not len(rows):
        return Beside(t, False, outside, none)
    row = int(rows[np.argmax(t[rows] - t[rows - 1])])
    says = (
        f"{table.place(row)}: found {t[row] - t[row - 1]:.4g} s without a row; {int(in_gap.sum())}"
        f" cycles lie in {len(rows)} such gap{'s' * (len(rows) != 1)}, where its columns have no"
        " value (valves, enables and words hold theirs)"
    )
    return Beside(t, False, outside, in_gap, (says,))


def put(grid: Grid, found: Beside, values: np.ndarray, hold: bool) -> np.ndarray:
    """A column of any table on the grid; NaN outside of its table's time and in its gaps, through
    which a column with ``hold`` keeps its value.
    """
    if found.as_is:
        return values
    if hold:
        held = values[np.clip(np.searchsorted(found.t_s, grid.t_s, side="right") - 1, 0, None)]
        return np.where(found.outside, np.nan, held)
    return np.where(
        found.outside | found.in_gap, np.nan, np.interp(grid.t_s, found.t_s, values)
    )  # NaN in values spreads to its neighbours, as it should


def _around(t: np.ndarray, grid_s: np.ndarray, slack_s: float) -> tuple[np.ndarray, np.ndarray]:
    """The row (M,) at or after each cycle, from 1 on, and (M,) bool: whether a row lies within
    ``slack_s`` of it.
    """
    after = np.clip(np.searchsorted(t, grid_s, side="left"), 1, len(t) - 1)
    return after, np.minimum(np.abs(grid_s - t[after - 1]), np.abs(grid_s - t[after])) <= slack_s


def _resampled(table: Table, t: np.ndarray, period_s: float, clock: Clock) -> Grid:
    cycle = np.arange(int(t[-1] / period_s + 1e-9) + 1)
    if len(cycle) < 2:
        raise ImportRefused(
            f"{table.place(len(t) - 1)}: found {len(t)} rows within {t[-1]:.6g} s, expected two"
            f" periods of {period_s:.6g} s at least (is the clock's unit right?)"
        )
    grid_s = cycle * period_s
    max_gap_s = _GAP_PERIODS * period_s if clock.max_gap is None else clock.max_gap
    after, on_row = _around(t, grid_s, 0.5 * period_s)
    kept = (t[after] - t[after - 1] <= max_gap_s) | on_row
    moved_s = np.minimum(np.abs(grid_s - t[after - 1]), np.abs(grid_s - t[after]))[kept].max()
    says = (
        (
            f"{len(t)} rows were put onto {int(kept.sum())} cycles of {period_s * 1e3:.6g} ms by"
            f" linear interpolation; a row lies up to {moved_s * 1e3:.3g} ms beside its cycle"
        ),
    )
    return Grid(
        period_s, cycle[kept], grid_s[kept], True, says + _lost_words(cycle[kept], period_s)
    )


def _lost_words(cycle: np.ndarray, period_s: float) -> tuple[str, ...]:
    steps = np.diff(cycle)
    lost = int((steps - 1).sum())
    if not lost:
        return ()
    gaps = int((steps > 1).sum())
    return (
        (
            f"{lost} cycles in {gaps} gap{'s' * (gaps != 1)} have no row, the longest of"
            f" {(steps.max() - 1) * period_s:.4g} s; they are left out"
        ),
    )

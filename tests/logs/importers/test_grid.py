"""The grid lies in the midst of the stamps: none of them alone, early or late, is its origin."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.logs.importers.grid import beside, grid_of, stamps_s
from epa_rt.logs.importers.mapping import Clock
from epa_rt.logs.importers.table import ImportRefused, Table

PERIOD_S = 0.01
STATED = Clock(column="t", unit="s", period="10 ms")
OWN = Clock(column="t", unit="s")


def table(t_s) -> Table:
    return Table("log.csv", {"t": np.asarray(t_s)}, lambda row: f"log.csv:{row + 2}")


def jittered(off, begin_s=0.0):
    return begin_s + PERIOD_S * (np.arange(len(off)) + np.asarray(off))


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-0.09, 0.09), min_size=20, max_size=60), st.floats(-100.0, 1e5))
def test_stamps_that_jitter_by_less_than_a_tenth_are_taken_as_they_are(off, begin_s):
    """Of a full spread on both sides the midst is within what is allowed, wherever the first of
    them lies.
    """
    off = np.concatenate([off, -np.asarray(off)])  # as often early as late
    t = jittered(off, begin_s)
    grid = grid_of(table(t), STATED)
    assert np.array_equal(grid.cycle, np.arange(len(off))) and not grid.resampled
    assert np.array_equal(grid.t_s, t - t[0])


@pytest.mark.parametrize("clock", [STATED, OWN], ids=["stated period", "mean step"])
@pytest.mark.parametrize("ends", [(-0.09, 0.09), (0.09, -0.09), (0.09, 0.09), (-0.09, -0.09)])
def test_neither_the_first_nor_the_last_stamp_tilts_or_moves_the_grid(clock, ends):
    off = np.random.default_rng(3).uniform(-0.09, 0.09, 4000)
    off[0], off[-1] = ends
    grid = grid_of(table(jittered(off, 1e4)), clock)
    assert np.array_equal(grid.cycle, np.arange(4000)) and grid.period_s == pytest.approx(
        PERIOD_S, rel=1e-4
    )


@settings(max_examples=200, deadline=None)
@given(
    st.integers(5, 195),
    st.sampled_from([-0.25, 0.25]),
    st.floats(0.0, 0.02),
    st.sampled_from([STATED, OWN]),
)
def test_a_step_of_a_quarter_of_the_period_is_refused(at, step, jitter, clock):
    off = np.random.default_rng(at).uniform(-jitter, jitter, 200)
    off[at:] += step
    with pytest.raises(ImportRefused, match="off a grid of"):
        grid_of(table(jittered(off)), clock)


def test_two_files_whose_clocks_never_meet_are_no_one_recording():
    t = PERIOD_S * np.arange(200)
    grid = grid_of(table(t), STATED)
    assert beside(grid, table(t + 0.5), STATED, t).outside.sum() == 50
    with pytest.raises(
        ImportRefused,
        match=(
            r"log.csv:2: found rows from 10 s to 11.99 s by the clock of the first file's, which go"
            r" from 0 s to 1.99 s"
        ),
    ):
        beside(grid, table(t + 10.0), STATED, t)


def test_a_clock_in_a_unit_of_its_own_leaves_no_log_of_one_row():
    t = 1e-3 * PERIOD_S * np.arange(200)
    with pytest.raises(
        ImportRefused,
        match=(
            "found 200 rows within 0.00199 s, expected two periods of 0.01 s at least .is the"
            " clock's unit right"
        ),
    ):
        grid_of(table(t), Clock(column="t", unit="s", period="10 ms", resample="linear"))
    with pytest.raises(
        ImportRefused, match="rows are 1e-05 s apart as a rule: is the clock's unit right"
    ):
        grid_of(table(t), STATED)


@pytest.mark.parametrize("unit", ["ms", "us"])
def test_rows_of_one_cycle_are_said_to_be_that_and_not_off_the_grid(unit):
    """Seconds that were taken for milliseconds."""
    t = np.round(PERIOD_S * np.arange(200), 3)
    with pytest.raises(ImportRefused) as refused:
        grid_of(table(t), Clock(column="t", unit=unit, period="10 ms"))
    said, step_ms = str(refused.value), 0.01 if unit == "ms" else 1e-5
    assert said.startswith(
        f"log.csv:3: found a stamp {step_ms:g} ms after that of the row before, in the same cycle"
        " of 10 ms, expected one row a cycle"
    )
    assert "off a grid" not in said and "is the clock's unit right?" in said


@pytest.mark.parametrize("at", [60, 100, 140, 300])
def test_the_row_that_is_named_is_the_one_where_the_stamps_step(at):
    off = np.zeros(400)
    off[at:] = 0.25
    with pytest.raises(
        ImportRefused,
        match=f"log.csv:{at + 2}: found a stamp 2.5 ms off a grid of 10 ms, expected at most 1 ms",
    ):
        grid_of(table(jittered(off)), STATED)


def test_a_clock_that_drifts_is_refused_where_it_leaves_the_grid():
    with pytest.raises(
        ImportRefused, match="off a grid of 10 ms, expected at most 1 ms"
    ) as refused:
        grid_of(table(jittered(np.linspace(0.0, 0.3, 1001))), STATED)
    row = int(str(refused.value).split(":")[1])
    assert 300 < row < 450


def test_a_second_table_lies_beside_the_first_by_their_stamps():
    """Both count from the main table's first row, wherever the grid's midst is."""
    off = np.r_[0.08, np.random.default_rng(0).uniform(-0.08, 0.08, 199)]
    main = table(jittered(off, 50.0))
    grid, raw = grid_of(main, STATED), stamps_s(main, STATED)
    assert beside(grid, main, STATED, raw).as_is
    late = beside(grid, table(jittered(np.zeros(200), 50.5)), STATED, raw)
    assert late.t_s[0] == pytest.approx(0.5 - 0.0008) and late.outside.sum() == 50

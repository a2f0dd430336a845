"""Pictures with fewer points keep what matters."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.report.charts import array
from epa_rt.report.downsample import envelope, envelope_indices, path_stretches


@given(st.integers(1, 60_000), st.data(), st.booleans(), st.integers(8, 4000))
def test_a_spike_of_one_sample_survives(n: int, data: st.DataObject, up: bool, most: int) -> None:
    at = data.draw(st.integers(0, n - 1))
    values = np.sin(np.arange(n) / 7.0)
    values[at] = 50.0 if up else -50.0
    times, drawn = envelope(np.arange(n), values, most)
    assert at in times and drawn[np.flatnonzero(times == at)[0]] == values[at]


@given(st.integers(1, 60_000), st.integers(8, 4000), st.integers(0, 2**32 - 1))
def test_never_more_points_than_asked_and_always_in_order(n: int, most: int, seed: int) -> None:
    values = np.random.default_rng(seed).normal(size=n)
    values[values > 2.0] = np.nan
    chosen = envelope_indices(values, most)
    assert (
        len(chosen) <= most
        and np.all(np.diff(chosen) > 0)
        and chosen[0] == 0
        and chosen[-1] == n - 1
    )


@given(st.integers(5000, 50_000), st.data())
def test_a_gap_of_one_sample_survives(n: int, data: st.DataObject) -> None:
    at = data.draw(st.integers(0, n - 1))
    values = np.zeros(n)
    values[at] = np.nan
    assert at in envelope_indices(values, 1000)


@given(st.integers(8, 300))
def test_few_points_are_all_drawn(n: int) -> None:
    assert envelope_indices(np.arange(float(n)), 300).tolist() == list(range(n))


def test_nothing_but_gaps_is_drawn_as_gaps() -> None:
    assert np.isnan(envelope(np.arange(9000.0), np.full(9000, np.nan))[1]).all()


def test_a_long_path_is_drawn_in_stretches_set_apart() -> None:
    x = np.linspace(0.0, 1.0, 100_000)
    xs, ys = path_stretches(x, 2 * x, 2000, 8)
    assert len(xs) <= 4000 + 7 and np.isnan(xs).sum() == np.isnan(ys).sum() == 7
    assert xs[0] == 0.0 and xs[-1] == 1.0


def test_numbers_reach_the_page_as_they_are() -> None:
    import base64

    written = array(np.array([1.5, np.nan, -2.25]))
    assert written["dtype"] == "f4"
    assert np.array_equal(
        np.frombuffer(base64.b64decode(written["bdata"]), "<f4"),
        np.array([1.5, np.nan, -2.25], "<f4"),
        equal_nan=True,
    )

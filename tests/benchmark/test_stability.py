"""Stability: when an answer stays, and changes that keep what was recorded."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.benchmark.stability import (
    NONE,
    REFUSED,
    UNKNOWN,
    Answer,
    answer_from,
    figures,
    halves,
    in_other_units,
    joined,
    moved_guesses,
    noise_of,
    noisy,
    stays,
)
from epa_rt.gap.subject import Plain
from epa_rt.logs.importers.gather import Gathered, Trial
from epa_rt.logs.importers.grid import Grid
from epa_rt.models.effect import Knob

PLACE = "joint_position_rad"


def log(values, *cuts, period_s=0.01):
    """A log of one channel, its trials cut at these rows."""
    rows, edges = len(values), [0, *cuts, len(values)]
    trials = tuple(
        Trial(f"trial {i}", a, b, True)
        for i, (a, b) in enumerate(zip(edges, edges[1:], strict=False), 1)
    )
    grid = Grid(period_s, np.arange(rows), np.arange(rows) * period_s, False, ())
    return Gathered(grid, {PLACE: np.asarray(values, float)}, {}, {}, trials, ())


def answer(first, **shares):
    sets = [(tuple(names.split("__")), share) for names, share in shares.items()]
    return Answer(first, tuple(sorted(sets, key=lambda one: -one[1])))


@pytest.mark.parametrize(
    ("before", "after", "same"),
    [
        (answer("friction", friction=0.99), answer("friction", friction=0.6, load=0.4), True),
        (answer("friction", friction=0.99), answer("load", load=0.9, friction=0.1), True),
        (answer("friction", friction__load=0.99), answer("load", load=0.99), True),
        (answer("friction", friction=0.99), answer("load", load=0.96, friction=0.04), False),
        (answer(UNKNOWN, not_in_catalogue=0.7, load=0.3), answer("load", load=1.0), True),
        (answer(NONE, none=1.0), answer(UNKNOWN, not_in_catalogue=1.0), False),
        (answer(NONE, none=1.0), Answer(REFUSED), False),
    ],
)
def test_an_answer_stays_within_what_either_calls_uncertain(before, after, same):
    assert stays(before, after) == stays(after, before) == same


def test_plain_data_reads_back_the_same():
    one = answer("friction", friction__load=0.7, none=0.3)
    assert answer_from(json.loads(json.dumps(one.as_json()))) == one


def test_shares_are_counted_by_kind_and_turned_answers_listed():
    there, gone = answer("friction", friction=1.0), answer(NONE, none=1.0)
    found = figures(
        [
            ("arm", "order", "reversed", there, there),
            ("arm", "guess", "lag up", there, gone),
            ("arm", "guess", "lag down", there, Answer(REFUSED, says="channels exchanged")),
        ]
    )
    assert found["all"]["asked"] == 3 and found["all"]["stay"] == 1
    assert found["by_kind"]["guess"]["refused"] == 1
    assert [one["change"] for one in found["turned"]] == ["lag up", "lag down"]


@given(st.integers(4, 60), st.data())
def test_a_log_cut_in_two_and_joined_again_is_the_same(rows, data):
    cut = data.draw(st.integers(1, rows - 1))
    whole = log(np.arange(rows), cut)
    first, second = halves(whole, [PLACE])
    again = joined([first, second])
    assert len(first.grid.cycle) == cut and second.grid.cycle[0] == 0
    np.testing.assert_array_equal(again.measured[PLACE], whole.measured[PLACE])
    np.testing.assert_array_equal(again.grid.cycle, whole.grid.cycle)
    assert [(t.start, t.stop) for t in again.trials] == [(t.start, t.stop) for t in whole.trials]


def test_a_log_of_one_trial_is_cut_where_it_rests():
    moves = np.concatenate([np.arange(100.0), np.full(60, 100.0), 100.0 + np.arange(100.0)])
    first, _ = halves(log(moves), [PLACE])
    assert 100 <= len(first.grid.cycle) <= 160


def test_noise_added_anew_has_the_size_that_was_there():
    t = np.arange(4000) * 0.01
    values = np.sin(t) + 1e-3 * np.random.default_rng(3).standard_normal(len(t))
    assert noise_of(values) == pytest.approx(1e-3, rel=0.1)
    again = noisy(log(values), PLACE, 1).measured[PLACE]
    assert np.std(again - values) == pytest.approx(1e-3, rel=0.15)
    steps = np.round(np.sin(0.02 * t) / 0.01) * 0.01
    assert noise_of(steps) == pytest.approx(0.01 / np.sqrt(12.0), rel=1e-6)


def test_other_units_say_the_same():
    text, units = in_other_units(log([0.0, np.pi, np.nan], 2), [PLACE])
    assert units == {PLACE: "deg"}
    assert [row.split(",") for row in text.splitlines()] == [
        ["t", PLACE, "trial"],
        ["0", "0", "1"],
        ["10", "180", "1"],
        ["20", "", "2"],
    ]


class Spring(Plain):
    """Residual: reading less gain times command, less a zero that hardly counts."""

    nominal = (
        Knob("joint.gain", "1", 2.0, 0.0, 10.0, 0.4, None),
        Knob("joint.lag", "s", 0.1, 0.0, 10.0, 0.2, None),
        Knob("sensor.zero", "rad", 0.0, -1.0, 1.0, 1e-3, None),
    )

    def touched(self, key):
        return ("joint",)

    def prepare(self, recording):
        return recording

    def residual(self, prepared, values, link):
        gain, lag, zero = (values.get(k.key, k.value) for k in self.nominal)
        return 0.1 + (gain - 2.0) * prepared + 0.5 * (lag - 0.1) + zero


def test_the_guesses_that_matter_most_are_moved_by_two_spreads():
    moved = moved_guesses(Spring(), [np.ones(10)])
    assert moved == [
        ("joint.gain", pytest.approx(2.8)),
        ("joint.gain", pytest.approx(1.2)),
        ("joint.lag", pytest.approx(0.5)),
        ("joint.lag", pytest.approx(0.02)),  # a fifth: two of its spreads of twice its value off
    ]

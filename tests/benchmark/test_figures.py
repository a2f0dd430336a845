"""How the benchmark counts."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.benchmark.counted import pooled, wilson
from epa_rt.benchmark.figures import figures, wrong
from epa_rt.benchmark.oracle import (
    LIMIT,
    Bench,
    clear_of_stops,
    distance,
    explained,
    left,
    noise_of,
    strength_for,
)
from epa_rt.benchmark.shown import closing_line, table


def truth(
    kind="single", families=("leak",), multiple=10.0, separable=True, name="laminar_leak", **more
):
    effect = {
        "name": name,
        "answers": list(families),
        "families": list(families),
        "blocks": ["gas"],
        "multiple": multiple,
        "fields": {"gas.leak_per_s": 1e-3},
    }
    return {
        "kind": kind,
        "effects": [] if kind == "none" else [effect],
        "separable": separable,
        **more,
    }


def said(verdict, name=None, family=None, confidence=1.0, block="gas", **more):
    effects = (
        [{"name": name, "family": family or name, "block": block, "confidence": confidence, **more}]
        if name
        else []
    )
    return {"verdict": verdict, "effects": effects, "location": [{"block": block, "channel": "p"}]}


def value(cases, key):
    return next(f for f in figures(cases) if f.key == key)


def test_wilson_is_the_textbooks():
    assert wilson(8, 10) == pytest.approx((0.4902, 0.9433), abs=1e-4)
    assert wilson(0, 20)[0] == 0.0
    assert wilson(20, 20)[1] == pytest.approx(1.0)


@settings(deadline=None, database=None, derandomize=True)
@given(st.integers(1, 200), st.data())
def test_wilson_holds_the_share(of, data):
    right = data.draw(st.integers(0, of))
    low, high = wilson(right, of)
    assert low - 1e-9 <= right / of <= high + 1e-9


def test_first_effect_counts_by_family_and_only_where_the_data_allow():
    cases = [
        (truth(), said("explained", "valve_seat_leak", "leak")),
        (truth(), said("explained", "creep")),
        (truth(multiple=1.5), said("no_gap")),
        (truth(separable=False), said("explained", "creep")),
    ]
    found = value(cases, "first")
    assert (found.right, found.of) == (1, 2)


def test_a_withheld_effect_needs_verdict_and_block():
    cases = [
        (truth("withheld"), said("not_in_catalogue")),
        (truth("withheld"), said("not_in_catalogue", block="muscle")),
        (truth("withheld"), said("explained", "creep")),
        (truth("withheld"), said("explained", "creep", confidence=0.4)),
    ]
    assert (value(cases, "withheld").right, value(cases, "withheld").of) == (1, 4)
    assert value(cases, "wrong_sure").right == 1
    apart = [*cases, (truth("withheld", separable=False), said("explained", "creep"))]
    assert (value(apart, "wrong_sure").right, value(apart, "wrong_sure_apart").right) == (2, 1)


@pytest.mark.parametrize(
    "case, answer, missed",
    [
        (truth(), said("explained", "valve_seat_leak", "leak"), False),
        (truth(), said("explained", "creep"), True),
        (truth(), said("no_gap"), True),
        (truth(multiple=1.5), said("no_gap"), False),
        (truth("withheld"), said("not_in_catalogue"), False),
        (truth("withheld"), said("explained", "creep"), True),
        (truth("withheld"), said("not_in_catalogue", block="muscle"), True),
        (truth("pair"), said("explained", "leak"), False),
        (truth("none"), said("no_gap"), False),
    ],
)
def test_what_a_diagnosis_missed_is_what_its_case_was_made_for(case, answer, missed):
    assert wrong(case, answer) == missed


def test_intervals_count_only_where_the_law_is_the_same():
    number = {"name": "gas.leak_per_s", "low": 5e-4, "high": 2e-3}
    cases = [
        (truth("same_law"), said("explained", "leak", parameters=[number])),
        (truth(), said("explained", "leak", parameters=[number])),
        (truth("same_law"), said("explained", "leak", parameters=[{**number, "high": 9e-4}])),
    ]
    found = value(cases, "intervals")
    assert (found.right, found.of) == (1, 2)


def test_a_pair_needs_both_and_none_needs_silence():
    pair = {**truth("pair"), "effects": truth()["effects"] + truth(families=("creep",))["effects"]}
    both = {
        "verdict": "explained",
        "effects": said("explained", "leak")["effects"] + said("explained", "creep")["effects"],
        "location": [],
    }
    cases = [
        (pair, both),
        (pair, said("explained", "leak")),
        (truth("none"), said("no_gap")),
        (truth("none"), said("partly_explained", "leak")),
    ]
    assert (value(cases, "pair").right, value(cases, "pair").of) == (1, 2)
    assert (value(cases, "none").right, value(cases, "none").of) == (1, 2)
    assert "none 50 % of 2" in closing_line(figures(cases))
    assert table(figures(cases)).count("\n") == len(figures(cases)) + 1


def test_oracle_sees_what_nominal_parameters_cannot_hide():
    rng = np.random.default_rng(1)
    n = 4000
    nominal = rng.standard_normal((n, 3))
    bench = Bench(np.zeros((n, 1)), np.ones(1), nominal * 10.0)
    own, rival = rng.standard_normal(n), rng.standard_normal(n)
    strong = 20.0 * own / np.linalg.norm(own)
    assert distance(bench, strong[:, None]) == pytest.approx(20.0, rel=0.02)
    assert distance(bench, nominal[:, :1]) < 0.2
    assert left(strong, bench.nominal, [own]) < 0.1
    assert left(strong, bench.nominal, [rival]) > 19.0
    assert explained(strong, bench.nominal, [own])[1][-1] == pytest.approx(
        20.0 / np.linalg.norm(own), rel=1e-3
    )
    strength, reached = strength_for(4 * LIMIT, lambda s: 3.0 * s, 1.0, 100.0)
    assert reached == pytest.approx(4 * LIMIT, rel=0.25)
    assert strength == pytest.approx(4 * LIMIT / 3.0, rel=0.25)
    assert strength_for(1e6, lambda s: 3.0 * s, 1.0, 5.0)[0] == 5.0
    assert (
        strength_for(100.0, lambda s: 30.0 * s if s < 2.0 else 3000.0 * s, 1.0, 4.0)[0] == 1.0
    )  # the nearest of all tried, not the last


def test_rows_at_an_end_stop_and_until_the_swing_is_over_do_not_count():
    place = np.concatenate(
        [np.full(50, -0.28), np.full(900, 0.1), np.full(50, -0.26)]
    )  # rad, 100 Hz
    rows = clear_of_stops(place, -0.28, 0.5, 0.03)
    assert np.flatnonzero(rows)[[0, -1]].tolist() == [350, 949]
    assert rows[350:950].all()
    bench = Bench(np.zeros((1000, 2)), np.ones(2), np.zeros((1200, 1)), rows)
    there = np.where(rows, 0.0, 1.0)[:, None] * np.ones(2)
    assert distance(bench, there) == 0.0
    assert distance(bench, 1.0 - there) == pytest.approx(np.sqrt(1200.0))


def test_steps_that_do_not_average_out_raise_the_noise():
    rng = np.random.default_rng(2)
    clean = np.zeros((20000, 1))
    white, slow = (
        rng.standard_normal((20000, 1)),
        np.repeat(rng.standard_normal((200, 1)), 100, axis=0),
    )
    assert noise_of(slow, clean)[0] > 5.0 * noise_of(white, clean)[0]


def test_what_was_closed_is_the_whole_gap_against_the_refitted_plant():
    row = {
        "channel": "all channels",
        "log": "all",
        "mode": "teacher_forced",
        "baseline": "refitted",
        "closed_share": 0.9,
    }
    others = [
        {**row, "baseline": "plant_file", "closed_share": 1.0},
        {**row, "mode": "free_run", "closed_share": 0.1},
        {**row, "channel": "p", "closed_share": 0.2},
    ]
    cases = [
        (truth(), said("explained", "leak") | {"shrinkage": [*others, row]}),
        (truth(), {"error": "died"}),
        (truth(), said("explained", "leak")),
    ]
    assert (value(cases, "closed").value, value(cases, "closed").of) == (pytest.approx(0.45), 2)


def test_an_error_is_wrong_in_every_figure():
    died = {"error": "died", "wall_seconds": 3600.0}
    cases = [(truth("none"), died), (truth("withheld"), died), (truth(), died)]
    assert [
        (value(cases, key).right, value(cases, key).of)
        for key in ("none", "wrong_sure", "wrong_sure_apart", "withheld", "first", "block", "gate")
    ] == [(1, 1), (1, 1), (1, 1), (0, 1), (0, 1), (0, 2), (0, 2)]
    assert value(cases, "seconds").value == 3600.0


@pytest.mark.parametrize("verdict", ["no_gap", "not_excited"])
def test_an_answer_that_sees_no_gap_has_said_no_block(verdict):
    assert (
        value([(truth(), said(verdict))], "block").right,
        value([(truth(), said("not_in_catalogue"))], "block").right,
    ) == (0, 1)


def test_a_gate_that_ended_in_an_error_is_missed():
    gates = [{"passed": True, "points": 1.0}, {"error": "died"}, {"passed": False, "points": None}]
    assert (
        value([(truth(), said("explained", "leak") | {"gate": g}) for g in gates], "gate").right,
        value([(truth(), said("explained", "leak") | {"gate": g}) for g in gates], "gate").of,
    ) == (1, 2)


def test_a_next_experiment_must_leave_nothing_but_the_truth():
    apart = said("explained", "leak", "leak") | {"not_separable_from": []}
    alike = said("explained", "leak", "leak", not_separable_from=["creep"])
    cases = [
        (truth("not_separable"), said("not_separable", "leak") | {"after_next": after})
        for after in (apart, alike, {"error": "none"})
    ]
    assert (value(cases, "next").right, value(cases, "next").of) == (1, 3)


def test_sets_pooled_are_counted_as_one():
    one = [
        (truth(), said("explained", "leak")),
        (truth(), said("no_gap")),
        (truth("pair"), said("no_gap")),
    ]
    other = [(truth(), said("explained", "leak"))]
    assert [f for f in pooled([figures(one), figures(other)]) if f.key == "first"] == [
        f for f in figures([*one, *other]) if f.key == "first"
    ]
    assert next(f for f in pooled([figures(one), figures(other)]) if f.key == "pair").of == 1
    assert not {"closed", "seconds", "none"} & {
        f.key for f in pooled([figures(one), figures(other)])
    }

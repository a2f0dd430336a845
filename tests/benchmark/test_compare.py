"""Two diagnosers on the same cases: scores of probabilities, and who is ahead."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.benchmark.compare import compared, of_truth, reliability, scored, sign_test
from epa_rt.benchmark.figures import family_of
from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.blind.compare import compare


def truth(kind="single", *names, multiple=20.0):
    effects = [
        {"families": [family_of(n)], "answers": [n], "multiple": multiple, "blocks": ["muscle"]}
        for n in names
    ]
    return {"kind": kind, "effects": effects, "separable": True}


def posterior(unknown=0.0, **sets):
    models = [
        {"effects": [] if names == "none" else names.split("__"), "probability": share}
        for names, share in sets.items()
    ]
    return {"verdict": "explained", "posterior": {"models": models, "unknown": unknown}}


def rules(verdict, **names):
    effects = [
        {"name": n, "family": family_of(n), "confidence": c, "block": "muscle"}
        for n, c in names.items()
    ]
    return {"verdict": verdict, "effects": effects}


@pytest.mark.parametrize(
    ("of", "said", "share"),
    [
        (truth("none"), posterior(none=0.7, creep=0.3), 0.7),
        (truth("withheld", "creep"), posterior(unknown=0.6, none=0.4), 0.6),
        (truth("single", "creep"), posterior(creep=0.8, creep__threshold_pressure=0.1), 0.85),
        (
            truth("pair", "creep", "threshold_pressure"),
            posterior(creep=0.5, creep__threshold_pressure=0.5),
            0.5,
        ),
        (truth("single", "creep", multiple=1.0), posterior(creep=0.5, none=0.4), 0.9),
        (truth("single", "creep"), rules("explained", creep=0.8), 0.8),
        (truth("none"), rules("explained", creep=0.8), 0.1),
        (truth("none"), rules("no_gap"), 0.95),
        (truth("withheld", "creep"), rules("not_in_catalogue"), 0.95),
    ],
)
def test_the_truth_has_the_share_of_all_sets_that_hold_it(of, said, share):
    assert of_truth(of, said) == pytest.approx(share)


def test_a_family_that_has_been_renamed_since_is_the_same():
    old = truth("single", "motor_stribeck")
    old["effects"][0]["families"] = ["a family of before"]
    assert of_truth(old, posterior(motor_stribeck=0.8, creep=0.2)) == pytest.approx(0.8)
    said = rules("explained", motor_coulomb=0.7)
    assert of_truth(old, said) == 0.0
    said["effects"][0]["family"] = "a family of before"
    assert of_truth(old, said) == pytest.approx(0.7)


def test_who_gives_the_truth_more_is_ahead():
    cases = [truth("single", "creep")] * 6
    first = scored([(one, rules("explained", creep=0.9)) for one in cases])
    second = scored([(one, rules("explained", creep=0.5)) for one in cases])
    found = compared(first, second)
    assert (found.ahead, found.alike, found.behind) == (6, 0, 0)
    assert found.chance == pytest.approx(2.0 / 2**6)
    assert first.log_score > second.log_score and first.brier < second.brier
    assert compared(first, first).alike == 6


@given(st.integers(0, 40), st.integers(0, 40))
def test_the_sign_test_is_a_chance_and_has_no_side(ahead, behind):
    assert 0.0 < sign_test(ahead, behind) <= 1.0
    assert sign_test(ahead, behind) == sign_test(behind, ahead)


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.booleans()), max_size=60))
def test_every_name_is_in_one_bin(names):
    rows = reliability(names)
    assert sum(row["names"] for row in rows) == len(names)
    assert all(row["low"] <= row["right"] <= row["high"] for row in rows)


def test_two_files_of_one_set_become_a_table_and_others_are_refused(tmp_path):
    def written(name, of, said):
        path = tmp_path / name
        cases = [{"truth": truth("single", "creep"), "said": said}]
        path.write_text(json.dumps({"truth_sha256": of, "cases": cases}))
        return path

    one = written("a.json", "x", rules("explained", creep=0.9))
    two = written("b.json", "x", rules("not_in_catalogue"))
    said = compare([one, two])
    assert "first in 1 cases" in said and "| log score | -0.105 |" in said
    with pytest.raises(VerbError, match=r"c\.json: found another set"):
        compare([one, written("c.json", "y", rules("no_gap"))])
    (tmp_path / "d.json").write_text("{}")
    with pytest.raises(VerbError, match=r"d\.json: found no cases"):
        compare([one, tmp_path / "d.json"])

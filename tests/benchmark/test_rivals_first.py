"""epa gap blind rivals --first N: the first cases alone, and our own row counted on those alone."""

import json

import pytest

from epa_rt.benchmark import score
from epa_rt.benchmark.seal import HASH, NOT_HIDDEN, seal
from epa_rt.cli.gap.blind import rivals
from epa_rt.cli.main import main

LEAK = {
    "name": "laminar_leak",
    "answers": ["leak"],
    "families": ["leak"],
    "blocks": ["gas"],
    "multiple": 9.0,
    "rivals": {},
    "fields": {},
}
NOTHING = {"verdict": "no_gap", "effects": [], "location": []}
TRUTH = [
    {
        "case": f"case_00{i}",
        "kind": "single" if effects else "none",
        "effects": effects,
        "separable": True,
        "excited": True,
    }
    for i, effects in enumerate(([], [LEAK], []))
]


@pytest.fixture
def blind(tmp_path, monkeypatch):
    """Three cases, what our diagnosis said of each (it missed the leak), and the cases that the
    rival is asked for.
    """
    cases, asked = tmp_path / "cases", []
    for case in TRUTH:
        (cases / case["case"]).mkdir(parents=True)
        (cases / case["case"] / "case.json").write_text("{}")
    seal({"seed": 1, "cases": TRUTH}, tmp_path / "cases.sealed", cases)
    (tmp_path / "ours.json").write_text(
        json.dumps(
            {
                "truth_sha256": (cases / HASH).read_text().strip(),
                "cases": [{"truth": case, "said": NOTHING} for case in TRUTH],
            }
        )
    )

    def answered(folder, out, hidden, diagnoser, running):
        asked.append((folder.name, diagnoser))
        out.write_text(json.dumps(NOTHING))

    monkeypatch.setattr(score, "diagnose_one", answered)
    monkeypatch.setattr(
        "epa_rt.cli.gap.blind.check_cases", lambda cases: None
    )  # their files are empty
    return cases, asked


def rows(cases, *more: str) -> list[dict]:
    out = cases.parent / "rivals.json"
    arguments = [
        "gap",
        "blind",
        "rivals",
        str(cases),
        "--json",
        str(out),
        "--only",
        "rmse",
        "--beside",
        str(cases.parent / "ours.json"),
        "--jobs",
        "1",
        *more,
    ]
    assert main(arguments) == 0
    return json.loads(out.read_text())


def test_only_the_first_cases_are_asked_and_counted_for_both(blind, capsys):
    cases, asked = blind
    ours, rival = rows(cases, "--first", "1")
    assert asked == [("case_000", "epa_rt.benchmark.rivals:rmse")]
    assert (ours["rival"], rival["rival"]) == ("epa gap diagnose", "rmse")
    assert ours["none"] == rival["none"] == 0.0 and ours["first"] is rival["first"] is None, (
        "the leak lies beyond the first case"
    )
    kept = json.loads((cases.parent / "rivals_rmse.json").read_text())
    assert [one["truth"]["case"] for one in kept["cases"]] == ["case_000"]
    assert "| rmse | - |" in capsys.readouterr().out


def test_more_of_them_later_ask_only_what_is_new_and_all_without_the_option(blind):
    cases, asked = blind
    rows(cases, "--first", "1")
    ours, rival = rows(cases, "--first", "2")
    assert [name for name, _ in asked] == ["case_000", "case_001"] and ours["first"] == rival[
        "first"
    ] == 0.0
    rows(cases)
    assert [name for name, _ in asked] == ["case_000", "case_001", "case_002"]


def test_a_rival_without_its_library_is_refused_and_not_counted_as_wrong(
    blind, monkeypatch, capsys
):
    monkeypatch.setattr(rivals, "find_spec", lambda name: None)
    assert (
        main(
            [
                "gap",
                "blind",
                "rivals",
                str(blind[0]),
                "--json",
                str(blind[0].parent / "rivals.json"),
                "--only",
                "sparse",
                "rmse",
            ]
        )
        == 2
    )
    error = capsys.readouterr().err
    assert (
        "found no pysindy, expected the libraries of the rivals" in error
        and error.count("\n") == 1
        and not blind[1]
    )


def test_a_rival_that_ends_in_an_error_everywhere_has_no_figures(blind, monkeypatch, capsys):
    monkeypatch.setattr(
        score,
        "diagnose_one",
        lambda folder, out, *_: out.write_text(json.dumps({"error": "ImportError: broken"})),
    )
    assert (
        main(
            [
                "gap",
                "blind",
                "rivals",
                str(blind[0]),
                "--json",
                str(blind[0].parent / "rivals.json"),
                "--only",
                "rmse",
                "--jobs",
                "1",
            ]
        )
        == 4
    )
    error = capsys.readouterr().err
    assert (
        "rmse ended in an error in all 3 cases (ImportError: broken)" in error
        and not (blind[0].parent / "rivals.json").exists()
    )


@pytest.mark.parametrize("count", ["0", "-1", "many"])
def test_no_count_is_refused(blind, count, capsys):
    with pytest.raises(SystemExit) as stopped:
        rows(blind[0], "--first", count)
    assert (
        stopped.value.code == 2 and "expected a whole number, 1 or more" in capsys.readouterr().err
    )
    assert not blind[1]


@pytest.mark.parametrize(
    "changed, words",
    [
        (
            {"truth_sha256": 64 * "0"},
            "found the set 0000000000000000, expected what score wrote for",
        ),
        ({"truth_sha256": None}, "found no truth_sha256"),
        (None, "found no cases in it"),
    ],
)
def test_what_score_wrote_for_another_set_is_no_row(blind, changed, words, capsys):
    ours = blind[0].parent / "ours.json"
    kept = json.loads(ours.read_text())
    ours.write_text("[" if changed is None else json.dumps({**kept, **changed}))
    assert (
        main(
            [
                "gap",
                "blind",
                "rivals",
                str(blind[0]),
                "--json",
                str(blind[0].parent / "rivals.json"),
                "--only",
                "rmse",
                "--beside",
                str(ours),
            ]
        )
        == 2
    )
    error = capsys.readouterr().err.strip()
    assert words in error and "\n" not in error and not blind[1]


def test_that_nothing_could_be_hidden_is_said(blind, monkeypatch, capsys):
    monkeypatch.setattr(score, "can_hide", lambda: False)
    rows(blind[0])
    assert NOT_HIDDEN in capsys.readouterr().out


def test_neither_our_own_row_nor_a_rivals_json_can_be_read_by_the_next_rival(blind, monkeypatch):
    seen = {}

    def answered(folder, out, hidden, diagnoser, running):
        seen.setdefault(diagnoser.partition(":")[2], {path.name for path in hidden})
        out.write_text(json.dumps(NOTHING))

    monkeypatch.setattr(score, "can_hide", lambda: True)
    monkeypatch.setattr(score, "diagnose_one", answered)
    elsewhere = blind[0].parent / "elsewhere"
    elsewhere.mkdir()
    ours = (blind[0].parent / "ours.json").rename(elsewhere / "ours.json")
    out = blind[0].parent / "rivals.json"
    assert (
        main(
            [
                "gap",
                "blind",
                "rivals",
                str(blind[0]),
                "--json",
                str(out),
                "--only",
                "rmse",
                "least_squares",
                "--beside",
                str(ours),
            ]
        )
        == 0
    )
    assert seen == {
        "rmse": {"cases.sealed", "ours.json"},
        "least_squares": {"cases.sealed", "ours.json", "rivals_rmse.json", "rivals_rmse.html"},
    }

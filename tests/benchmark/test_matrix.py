"""Leave one out: what counts as refused in the right place, and that the picture shows every
case.
"""

import json

import pytest

from epa_rt.benchmark import matrix as room
from epa_rt.benchmark.kept import take
from epa_rt.benchmark.seal import NOT_HIDDEN, SealError, seal
from epa_rt.cli.main import main


def case(name, effect, verdict, block, named=()):
    truth = {
        "case": name,
        "effects": [{"name": effect, "families": [effect], "blocks": ["gas"], "multiple": 20.0}],
    }
    effects = [
        {"name": one, "family": one, "block": block, "confidence": confidence}
        for one, confidence in named
    ]
    return truth, {"verdict": verdict, "effects": effects, "location": [{"block": block}]}


def test_refused_counts_with_the_right_block_alone_and_every_case_is_drawn(tmp_path, monkeypatch):
    cases = [
        case("case_000", "leak", "not_in_catalogue", "gas"),
        case("case_001", "leak", "not_in_catalogue", "muscle"),
        case("case_002", "heat", "explained", "gas", [("heat", 0.4), ("leak", 0.9)]),
        case("case_003", "droop", "explained", "gas", [("leak", 0.5)]),
    ]
    (tmp_path / "truth.sha256").write_text("")
    take(tmp_path / "answers", tmp_path, "")
    for truth, said in cases:
        (tmp_path / "answers" / f"{truth['case']}.json").write_text(
            json.dumps(said), encoding="utf-8"
        )
    drawn = {}
    monkeypatch.setattr(room, "diagnose_all", lambda *_: None)
    monkeypatch.setattr(room, "can_hide", lambda: False)
    monkeypatch.setattr(room, "opened", lambda *_: {"cases": [truth for truth, _ in cases]})
    monkeypatch.setattr(
        room, "draw", lambda table, path, title, right: drawn.update(table=table, right=right)
    )
    text = room.matrix(tmp_path, tmp_path, "", 1)
    assert NOT_HIDDEN in text and text.endswith(
        "1 of 4 said to be not in the catalogue, in the right block; 1 given a wrong name with"
        " confidence"
    )
    assert drawn["table"] == {
        "leak": {"not in the catalogue": 1, "not in the catalogue, but another block": 1},
        "heat": {"heat": 1},
        "droop": {"leak": 1},
    }
    assert drawn["right"]("leak", "not in the catalogue") and not drawn["right"](
        "leak", "not in the catalogue, but another block"
    )


@pytest.mark.parametrize(
    "more, words",
    [
        (["--seed", "8"], "found cases of --seed 7 --of stand_in, expected those of --seed 8"),
        (["--seed", "7", "--of", "catalogue"], "expected those of --seed 7 --of catalogue"),
    ],
)
def test_a_folder_of_other_cases_is_not_shown_for_those_that_are_asked_for(
    tmp_path, monkeypatch, capsys, more, words
):
    (tmp_path / "set").mkdir()
    seal(
        {"seed": 7, "cases": [{"case": "case_000", "same_law": False, "effects": []}]},
        tmp_path / "set.sealed",
        tmp_path / "set",
    )
    monkeypatch.setattr(room, "matrix", lambda *_: pytest.fail("old cases were diagnosed"))
    assert main(["gap", "blind", "matrix", *more, "-o", str(tmp_path / "set")]) == 2
    error = capsys.readouterr().err.strip()
    assert words in error and "\n" not in error


def test_answers_of_another_making_of_the_folder_are_refused(tmp_path):
    (tmp_path / "truth.sha256").write_text("1")
    take(tmp_path / "answers", tmp_path, "one")
    (tmp_path / "truth.sha256").write_text("2")
    with pytest.raises(
        SealError, match="found answers by one to the set 1, expected answers by one to the set 2"
    ):
        room.matrix(tmp_path, tmp_path, "one", 1)

"""Leave one out: what counts as refused in the right place, and that the picture shows every case."""

import json

from epa_rt.gap.blind import matrix as room


def case(name, effect, verdict, block, named=()):
    truth = {"case": name, "effects": [{"name": effect, "families": [effect], "blocks": ["gas"], "multiple": 20.0}]}
    effects = [{"name": one, "family": one, "block": block, "confidence": confidence} for one, confidence in named]
    return truth, {"verdict": verdict, "effects": effects, "location": [{"block": block}]}


def test_refused_counts_with_the_right_block_alone_and_every_case_is_drawn(tmp_path, monkeypatch):
    cases = [case("case_000", "leak", "not_in_catalogue", "gas"), case("case_001", "leak", "not_in_catalogue", "muscle"),
             case("case_002", "heat", "explained", "gas", [("leak", 0.9)]), case("case_003", "droop", "explained", "gas", [("leak", 0.5)])]
    (tmp_path / "answers").mkdir()
    for truth, said in cases:
        (tmp_path / "answers" / f"{truth['case']}.json").write_text(json.dumps(said), encoding="utf-8")
    drawn = {}
    monkeypatch.setattr(room, "diagnose_all", lambda *_: None)
    monkeypatch.setattr(room, "can_hide", lambda: False)
    monkeypatch.setattr(room, "opened", lambda *_: {"cases": [truth for truth, _ in cases]})
    monkeypatch.setattr(room, "draw", lambda table, path, title, right: drawn.update(table=table, right=right))
    text = room.matrix(tmp_path, tmp_path, "", 1)
    assert text.endswith("1 of 4 said to be not in the catalogue, in the right block; 1 given a wrong name with confidence")
    assert drawn["table"] == {"leak": {"not in the catalogue": 1, "not in the catalogue, but another block": 1}, "heat": {"leak": 1}, "droop": {"leak": 1}}
    assert drawn["right"]("leak", "not in the catalogue") and not drawn["right"]("leak", "not in the catalogue, but another block")

"""The seal, the processes that must not see through it, and the score on top."""

import json
import os
import shutil
from pathlib import Path

import pytest

from epa_rt.gap.blind.score import score
from epa_rt.gap.blind.seal import HASH, KEY, TRUTH, SealError, can_hide, opened, seal

HERE = Path(__file__).parent
EFFECT = {"name": "laminar_leak", "answers": ["leak"], "families": ["leak"], "blocks": ["gas"], "multiple": 9.0, "rivals": {}, "fields": {"leak_per_s": 1.2345e-3}}


def case(name: str, kind: str, effects: list) -> dict:
    return {"case": name, "kind": kind, "effects": effects, "separable": True, "excited": True}


@pytest.fixture
def cases(tmp_path, monkeypatch):
    """Two folders with the files that a worker is told of, and their sealed truth."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), str(HERE.parents[2])]))
    folder = tmp_path / "cases"
    for name in ("case_000", "case_001"):
        (folder / name).mkdir(parents=True)
        for file in ("rig.yaml", "plant.yaml", "a.mcap", "b.mcap"):
            (folder / name / file).write_text("")
        told = {"rig": "rig.yaml", "plant": "plant.yaml", "logs": ["a.mcap"], "holdout": ["b.mcap"], "leave_out": ["creep"]}
        (folder / name / "case.json").write_text(json.dumps(told))
    seal({"seed": 3, "cases": [case("case_000", "none", []), case("case_001", "single", [EFFECT])]}, tmp_path / "cases.sealed", folder)
    return folder


def scored(cases: Path, diagnoser: str) -> tuple[str, dict]:
    out = cases.parent / f"{diagnoser}.json"
    text = score(cases, cases.with_name("cases.sealed"), out, out.with_suffix(".html"), f"blind_fakes:{diagnoser}", 2)
    return text, json.loads(out.read_text())


def test_what_was_sealed_comes_out_again_and_nothing_of_it_stands_in_the_file(cases):
    sealed = cases.with_name("cases.sealed")
    assert opened(sealed, cases)["cases"][1]["effects"][0]["name"] == "laminar_leak"
    hidden = (sealed / TRUTH).read_bytes()
    for word in (b"laminar", b"leak", b"seed", b"case_001", b"0.0012345"):
        assert word not in hidden
    assert (sealed / KEY).stat().st_mode & 0o077 == 0
    assert len((cases / HASH).read_text().strip()) == 64


@pytest.mark.parametrize("file", [TRUTH, KEY])
def test_a_changed_seal_is_refused(cases, file):
    path = cases.with_name("cases.sealed") / file
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    with pytest.raises(SealError, match="this key did not seal"):
        opened(path.parent, cases)


def test_a_truth_of_other_logs_is_refused(cases):
    (cases / HASH).write_text("0" * 64)
    with pytest.raises(SealError, match="another hash"):
        opened(cases.with_name("cases.sealed"), cases)


def test_a_diagnoser_that_cheats_finds_an_empty_folder(cases):
    if not can_hide():
        pytest.skip("no mount namespace can be made here: the truth lies under its file mode and its cipher only")
    _, found = scored(cases, "cheater")
    for one in found["cases"]:
        assert one["said"]["listed"] == []
        assert one["said"]["got"] == {TRUTH: "FileNotFoundError", KEY: "FileNotFoundError"}
    assert found["hidden_from_the_diagnosis"]


def test_score_goes_on_where_it_was_interrupted_and_counts(cases):
    out = cases.parent / "careful.answers"
    out.mkdir()
    (out / "case_000.json").write_text(json.dumps({"verdict": "explained", "effects": [{"name": "creep", "family": "creep", "confidence": 1.0}], "kept": True}))
    text, found = scored(cases, "careful")
    assert found["cases"][0]["said"]["kept"]
    assert found["cases"][1]["said"]["left_out"] == ["creep"]
    values = {f["key"]: f for f in found["figures"]}
    assert values["none"]["value"] == 1.0
    assert values["first"]["value"] == 0.0
    assert text.splitlines()[-1].startswith("first 0 % of 1")
    assert (cases.parent / "careful.html").stat().st_size > 1000


def test_a_case_that_was_taken_away_is_missed(cases):
    shutil.rmtree(cases / "case_001")
    with pytest.raises(SealError, match="found no case_001"):
        scored(cases, "careful")


def test_a_diagnosis_that_dies_counts_as_wrong(cases):
    _, found = scored(cases, "broken")
    assert all("found nothing to say" in one["said"]["error"] for one in found["cases"])
    values = {f["key"]: f["value"] for f in found["figures"]}
    assert values["errors"] == 1.0
    assert values["first"] == 0.0

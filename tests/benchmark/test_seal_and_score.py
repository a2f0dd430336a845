"""The seal, the processes that must not see through it, and the score on top."""

import json
import os
import shutil
from pathlib import Path

import pytest

from epa_rt.benchmark.kept import OF, ORACLE, take
from epa_rt.benchmark.score import score
from epa_rt.benchmark.seal import HASH, KEY, TRUTH, SealError, can_hide, opened, seal
from epa_rt.cli.gap.blind import DIAGNOSER
from epa_rt.cli.main import main

HERE = Path(__file__).parent
EFFECT = {
    "name": "laminar_leak",
    "answers": ["leak"],
    "families": ["leak"],
    "blocks": ["gas"],
    "multiple": 9.0,
    "rivals": {},
    "fields": {"leak_per_s": 1.2345e-3},
}


def case(name: str, kind: str, effects: list) -> dict:
    return {"case": name, "kind": kind, "effects": effects, "separable": True, "excited": True}


@pytest.fixture
def cases(tmp_path, monkeypatch):
    """Two folders with the files that a worker is told of, and their sealed truth."""
    monkeypatch.setattr(
        "epa_rt.cli.gap.blind.check_cases", lambda cases: None
    )  # their files are empty
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), str(HERE.parents[1])]))
    folder = tmp_path / "cases"
    for name in ("case_000", "case_001"):
        (folder / name).mkdir(parents=True)
        for file in ("rig.yaml", "plant.yaml", "a.mcap", "b.mcap"):
            (folder / name / file).write_text("")
        told = {
            "rig": "rig.yaml",
            "plant": "plant.yaml",
            "logs": ["a.mcap"],
            "holdout": ["b.mcap"],
            "leave_out": ["creep"],
        }
        (folder / name / "case.json").write_text(json.dumps(told))
    seal(
        {"seed": 3, "cases": [case("case_000", "none", []), case("case_001", "single", [EFFECT])]},
        tmp_path / "cases.sealed",
        folder,
    )
    return folder


def scored(cases: Path, diagnoser: str) -> tuple[str, dict]:
    out = cases.parent / f"{diagnoser}.json"
    text = score(
        cases,
        cases.with_name("cases.sealed"),
        out,
        out.with_suffix(".html"),
        f"blind_fakes:{diagnoser}",
        2,
    )
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
        pytest.skip(
            "no mount namespace can be made here: the truth lies under its file mode and its cipher"
            " only"
        )
    _, found = scored(cases, "cheater")
    for one in found["cases"]:
        assert one["said"]["listed"] == []
        assert one["said"]["got"] == {TRUTH: "FileNotFoundError", KEY: "FileNotFoundError"}
    assert found["hidden_from_the_diagnosis"]


def test_what_score_and_oracle_have_written_is_empty_for_a_diagnosis(cases):
    """The JSON of a first score says what is true of every case, and so do its picture and an
    oracle's answers; another diagnosis' answers do not.
    """
    if not can_hide():
        pytest.skip("no mount namespace can be made here: what was written can be read")
    scored(cases, "careful")
    take(cases.parent / "o.answers", cases, ORACLE)
    (cases.parent / "o.answers" / "case_001.json").write_text("laminar_leak")
    (cases.parent / "nosy.html").write_text("laminar_leak")
    _, found = scored(cases, "nosy")
    for one in found["cases"]:
        got = one["said"]["got"]
        assert {
            name: text
            for name, text in got.items()
            if not name.startswith(("careful.answers/", "nosy.answers/"))
        } == {"careful.json": "", "careful.html": "", "nosy.html": ""}
        assert "careful.answers/case_000.json" in got and not [
            text for text in got.values() if "laminar_leak" in text
        ]


def test_score_goes_on_where_it_was_interrupted_and_counts(cases):
    out = cases.parent / "careful.answers"
    take(out, cases, "blind_fakes:careful")
    (out / "case_000.json").write_text(
        json.dumps(
            {
                "verdict": "explained",
                "effects": [{"name": "creep", "family": "creep", "confidence": 1.0}],
                "kept": True,
            }
        )
    )
    text, found = scored(cases, "careful")
    assert found["cases"][0]["said"]["kept"]
    assert found["cases"][1]["said"]["left_out"] == ["creep"]
    values = {f["key"]: f for f in found["figures"]}
    assert values["none"]["value"] == 1.0
    assert values["first"]["value"] == 0.0
    assert text.splitlines()[-1].startswith("first 0 % of 1")
    assert (cases.parent / "careful.html").stat().st_size > 1000


def test_answers_of_another_set_or_of_another_hand_are_not_taken_for_these(cases):
    answers = cases.parent / "careful.answers"
    scored(cases, "careful")
    said = {path.name: path.read_bytes() for path in answers.iterdir()}
    seal(
        {"seed": 4, "cases": [case("case_000", "single", [EFFECT]), case("case_001", "none", [])]},
        cases.with_name("cases.sealed"),
        cases,
    )
    with pytest.raises(
        SealError, match="found answers by blind_fakes:careful to the set .* delete the folder"
    ):
        scored(cases, "careful")
    (answers / OF).unlink()
    with pytest.raises(SealError, match="found answers and no of.json .* delete it"):
        scored(cases, "careful")
    (answers / OF).write_text("{")
    with pytest.raises(SealError, match="found answers by nobody knows whom"):
        scored(cases, "careful")
    assert {path.name: path.read_bytes() for path in answers.iterdir() if path.name != OF} == {
        name: text for name, text in said.items() if name != OF
    }


def test_neither_another_diagnosers_answers_nor_an_oracles_are_taken(cases):
    for by in ("blind_fakes:broken", ORACLE):
        folder = cases.parent / "careful.answers"
        shutil.rmtree(folder, ignore_errors=True)
        take(folder, cases, by)
        with pytest.raises(
            SealError, match=f"found answers by {by} .* expected answers by blind_fakes:careful"
        ):
            scored(cases, "careful")


def test_an_oracle_does_not_take_a_diagnosis_answers_for_its_own_nor_its_own_or_another_sets_for_a_diagnosis(  # noqa: E501
    cases, capsys
):
    folder, out = cases.parent / "j.answers", str(cases.parent / "j.json")
    take(folder, cases, DIAGNOSER)
    (folder / "case_001.json").write_text(
        json.dumps({"verdict": "no_gap", "effects": [], "location": []})
    )
    ask = ["gap", "blind", "oracle", str(cases)]
    assert main([*ask, "--json", out]) == 2
    assert "expected answers by oracle" in capsys.readouterr().err
    for owner, words in (
        (
            {"by": ORACLE, "truth_sha256": (cases / HASH).read_text().strip()},
            "found answers by oracle",
        ),
        ({"by": DIAGNOSER, "truth_sha256": 64 * "0"}, "to the set 0000000000000000, expected"),
        (None, "found no of.json"),
    ):
        (folder / OF).unlink() if owner is None else (folder / OF).write_text(json.dumps(owner))
        assert main([*ask, "--json", str(cases.parent / "o.json"), "--answers", str(folder)]) == 2
        error = capsys.readouterr().err.strip()
        assert words in error and "\n" not in error
    assert not (cases.parent / "o.answers").exists()


@pytest.mark.parametrize("place", [".", "../cases", "case_000/.."])
def test_a_folder_may_be_called_by_where_one_stands(cases, place, monkeypatch):
    monkeypatch.chdir(cases)
    assert (
        main(
            [
                "gap",
                "blind",
                "score",
                place,
                "--json",
                "../out.json",
                "--diagnoser",
                "blind_fakes:careful",
            ]
        )
        == 0
    )
    assert (
        json.loads((cases.parent / "out.json").read_text())["truth_sha256"]
        == (cases / HASH).read_text().strip()
    )


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


def test_a_diagnosis_whose_process_dies_counts_its_seconds(cases):
    _, found = scored(cases, "gone")
    assert all(
        "exit code 7" in one["said"]["error"] and one["said"]["wall_seconds"] > 0.0
        for one in found["cases"]
    )
    assert next(f["of"] for f in found["figures"] if f["key"] == "seconds") == 2

"""The proposed experiment is run on the hidden rig and counted; the oracle is told the law and
finds it.
"""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from epa_rt.benchmark.kept import ORACLE, take
from epa_rt.benchmark.score import score
from epa_rt.benchmark.seal import seal
from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.blind import oracle
from epa_rt.cli.gap.blind.next import add_next
from epa_rt.cli.gap.blind.oracle import judge, oracle_all
from epa_rt.cli.gap.blind.oracle_next import laws_instead, oracle_next
from epa_rt.cli.gap.blind.told import fitting_of
from epa_rt.models.plant_file import load_plant
from sim_backend.stand_in.truth import readings, true_plant

HERE = Path(__file__).parent


def sealed_case(short_case, tmp_path) -> tuple[Path, Path]:
    folder, truth = short_case
    cases = tmp_path / "cases"
    shutil.copytree(folder, cases / "case_000")
    seal({"seed": 1, "cases": [truth]}, tmp_path / "cases.sealed", cases)
    return cases, tmp_path / "cases.sealed"


def scored(cases: Path, sealed: Path, diagnoser: str) -> dict:
    out = cases.parent / "score.json"

    def again(judged, answers, hidden):
        add_next(cases, judged, answers, f"blind_fakes:{diagnoser}", hidden)

    score(cases, sealed, out, out.with_suffix(".html"), f"blind_fakes:{diagnoser}", 1, again)
    return json.loads(out.read_text())


@pytest.fixture(scope="module")
def judged(short_case, tmp_path_factory):
    """Folder of a case whose proposed experiment has been recorded and diagnosed, with its seal."""
    folder = tmp_path_factory.mktemp("judged")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), str(HERE.parents[1])]))
        cases, sealed = sealed_case(short_case, folder)
        scored(cases, sealed, "doubting")
    assert (folder / "score.answers" / "case_000_next.json").exists()
    return folder


def test_an_experiment_that_tells_apart_counts_as_separated(judged):
    found = json.loads((judged / "score.json").read_text())
    after = found["cases"][0]["said"]["after_next"]
    assert (
        after["samples"] > 1000
    )  # the second diagnosis has read a log that the first one did not have
    assert {path.name for path in (judged / "cases" / "case_000" / "next").iterdir()} == {
        "next.yaml",
        "next.mcap",
        "case.json",
    }
    figure = next(f for f in found["figures"] if f["key"] == "next")
    assert (figure["right"], figure["of"]) == (1, 1)


def test_an_answer_without_an_experiment_is_not_separated(short_case, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), str(HERE.parents[1])]))
    cases, sealed = sealed_case(short_case, tmp_path)
    figure = next(f for f in scored(cases, sealed, "helpless")["figures"] if f["key"] == "next")
    assert (figure["right"], figure["of"]) == (0, 1)


def test_the_oracle_prefers_the_true_law_and_finds_its_strength(short_case):
    folder, truth = short_case
    said = judge(folder, truth)
    chi = dict(said["chi"])
    assert chi["force_zero"] < chi["end_cones"]
    assert chi["nothing"] > chi["force_zero"] + 25.0
    assert abs(said["fitted"]["force_zero.force_offset_n"] - 8.0) < 1.0
    assert [e["name"] for e in said["effects"]] == ["force_offset"]


def test_the_oracle_fits_what_a_diagnosis_named_instead(short_case):
    """A wrong name is a rival with the catalogue's own law, from the numbers that the diagnosis
    gave it.
    """
    folder, truth = short_case
    number = {
        "name": "sensors.force_crosstalk_n_pa",
        "value": 1e-5,
        "unit": "N/Pa",
        "low": 0.0,
        "high": 2e-5,
        "neutral": 0.0,
    }
    told = {
        "verdict": "explained",
        "fitted": {"muscle.viscous_n_s_m": 12.5},
        "effects": [
            {
                "name": "force_crosstalk",
                "family": "force crosstalk",
                "block": "sensors",
                "parameters": [number],
            }
        ],
    }
    lone = {**truth, "effects": [{**truth["effects"][0], "rivals": {}}]}
    answer = judge(folder, lone, told)
    chi = dict(answer["chi"])
    assert set(chi) == {"nothing", "force_zero", "force_crosstalk"} and answer["instead"] == [
        "force_crosstalk"
    ]
    assert chi["force_zero"] < chi["force_crosstalk"] <= chi["nothing"]


def test_an_oracles_answer_without_the_name_that_was_given_instead_is_made_again(
    short_case, tmp_path, monkeypatch
):
    folder, truth = short_case
    out, asked = tmp_path / "case_000.json", []
    monkeypatch.setattr(
        oracle,
        "judge",
        lambda folder, truth, told: (
            asked.append(told) or {"instead": oracle._instead_names(truth, told)}
        ),
    )
    wrongly = {
        "verdict": "explained",
        "effects": [
            {
                "name": "force_crosstalk",
                "family": "force crosstalk",
                "block": "sensors",
                "parameters": [],
            }
        ],
    }
    rightly = {
        "verdict": "explained",
        "effects": [
            {"name": "force_offset", "family": "force offset", "block": "sensors", "parameters": []}
        ],
    }
    for told in ({}, {}, wrongly, wrongly, rightly, {}):
        oracle._one(folder, truth, out, told)
    assert asked == [{}, wrongly, rightly]
    assert json.loads(out.read_text())["instead"] == []


def test_the_oracle_can_be_asked_about_what_was_missed_alone(short_case, tmp_path):
    cases, sealed = sealed_case(short_case, tmp_path)
    said = tmp_path / "said"
    take(said, cases, "somebody")
    found = {
        "verdict": "explained",
        "effects": [{"name": "force_offset", "family": "force zero", "block": "sensors"}],
        "location": [{"block": "sensors"}],
    }
    (said / "case_000.json").write_text(json.dumps(found))
    text = oracle_all(cases, sealed, tmp_path / "oracle.json", 1, said, missed=True)
    assert not list(tmp_path.glob("oracle.answers/case_*")) and "oracle" in text


def test_the_oracles_answers_are_counted_as_a_diagnosis_is(short_case, tmp_path):
    cases, sealed = sealed_case(short_case, tmp_path)
    answers = tmp_path / "oracle.answers"
    take(answers, cases, ORACLE)
    kept = {
        "verdict": "explained",
        "effects": [{"name": "force_offset", "family": "force offset", "block": "sensors"}],
        "location": [],
        "wall_seconds": 1.0,
    }
    (answers / "case_000.json").write_text(json.dumps(kept))
    text = oracle_all(cases, sealed, tmp_path / "oracle.json", 1)
    assert "first 100 % of 1" in text.splitlines()[-1]


def test_the_hidden_rig_run_again_over_a_logs_commands_reads_what_the_log_says(short_case):
    """Commands, their age and every channel's scale: what is left is the sensors' noise alone."""
    folder, truth = short_case
    fitting = fitting_of(folder, truth)
    plant = true_plant(load_plant(folder / "plant.yaml").params, truth)
    off = (fitting.measured - readings(plant, fitting.commands)) / fitting.noise
    assert np.sqrt(np.mean(off**2, axis=0)) == pytest.approx(
        np.full(off.shape[1], 0.1), abs=0.2
    )  # noise counts five times: INDEPENDENT_HZ


def judged_next(judged, tmp_path) -> tuple[Path, Path]:
    """Cases and seal of a copy."""
    shutil.copytree(judged, tmp_path, dirs_exist_ok=True)
    return tmp_path / "cases", tmp_path / "cases.sealed"


def test_the_oracle_says_whether_the_proposed_experiment_tells(judged, tmp_path):
    """Told the law, over the logs and the new one, with the name that stood beside the truth as a
    rival.
    """
    cases, sealed = judged_next(judged, tmp_path)
    text = oracle_next(cases, sealed, tmp_path / "oracle.json", 1, tmp_path / "score.answers")
    found = json.loads((tmp_path / "oracle.json").read_text())
    told = found["cases"][0]["oracle"]
    chi = dict(told["chi"])
    assert told["tells"] and told["rivals"] == ["end_fittings"] and not told["unasked"]
    assert chi["force_zero"] < min(c for name, c in chi.items() if name != "force_zero") - 25.0
    assert len(chi) > 2
    assert [(f["key"], f["right"], f["of"]) for f in found["figures"]] == [
        ("next_named", 1, 1),
        ("next_oracle", 1, 1),
        ("next_apart", 1, 1),
    ]
    assert "next_apart 100 % of 1" in text.splitlines()[-1]


@pytest.mark.slow
def test_an_experiment_that_tells_counts_against_a_second_diagnosis_that_died(
    short_case, tmp_path, monkeypatch
):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), str(HERE.parents[1])]))
    cases, sealed = sealed_case(short_case, tmp_path)
    assert (
        "one log too many"
        in scored(cases, sealed, "dying")["cases"][0]["said"]["after_next"]["error"]
    )
    oracle_next(cases, sealed, tmp_path / "oracle.json", 1, tmp_path / "score.answers")
    figures = json.loads((tmp_path / "oracle.json").read_text())["figures"]
    assert [(f["key"], f["right"], f["of"]) for f in figures] == [
        ("next_named", 0, 1),
        ("next_oracle", 1, 1),
        ("next_apart", 0, 1),
    ]


def test_a_proposed_experiment_of_what_nothing_can_name_is_not_judged(
    short_case, tmp_path, monkeypatch
):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(HERE), str(HERE.parents[1])]))
    folder, truth = short_case
    cases, sealed = sealed_case((folder, {**truth, "kind": "withheld"}), tmp_path)
    scored(cases, sealed, "doubting")
    assert (tmp_path / "score.answers" / "case_000_next.json").exists()
    oracle_next(cases, sealed, tmp_path / "oracle.json", 1, tmp_path / "score.answers")
    assert json.loads((tmp_path / "oracle.json").read_text())["cases"] == []


def test_an_experiment_that_was_not_proposed_tells_nothing(judged, tmp_path):
    cases, sealed = judged_next(judged, tmp_path)
    (tmp_path / "score.answers" / "case_000_next.json").rename(
        tmp_path / "score.answers" / "case_007_next.json"
    )
    oracle_next(cases, sealed, tmp_path / "oracle.json", 1, tmp_path / "score.answers")
    figures = json.loads((tmp_path / "oracle.json").read_text())["figures"]
    assert [(f["key"], f["right"], f["of"]) for f in figures] == [
        ("next_named", 0, 1),
        ("next_oracle", 0, 1),
        ("next_apart", None, 0),
    ]


@pytest.mark.parametrize(
    ("out", "said", "expected"),
    [
        ("oracle.json", "empty", "those that score --next has kept"),
        ("score.json", "score.answers", "this oracle's own"),
        ("oracle.json", "torn", "found no whole JSON"),
    ],
)
def test_answers_without_next_experiments_are_refused(judged, tmp_path, out, said, expected):
    cases, sealed = judged_next(judged, tmp_path)
    (tmp_path / "empty").mkdir()
    shutil.copytree(tmp_path / "score.answers", tmp_path / "torn")
    (tmp_path / "torn" / "case_000_next.json").write_text('{"verdict": "expl')
    before = (tmp_path / "score.json").read_bytes()
    with pytest.raises(VerbError, match=expected):
        oracle_next(cases, sealed, tmp_path / out, 1, tmp_path / said)
    assert (tmp_path / "score.json").read_bytes() == before


def effect(name: str, fields: dict, answers: tuple[str, ...] = ()) -> dict:
    return {"name": name, "fields": fields, "answers": list(answers), "families": [], "rivals": {}}


def test_every_name_is_asked_by_a_law_of_the_rig_or_said_to_have_none():
    knee = {"rig": "knee", "same_law": False, "effects": [effect("tilt", {"tilt_rad": 0.02})]}
    laws, unasked = laws_instead(
        knee, ["knee_spring", "braid_dahl", "braid_lugre", "muscle1_gauge_offset", "frame_mode"]
    )
    names = [law.effects for law in laws]
    assert (
        ("knee_ligament",) in names
        and ("muscle1_gauge_offset",) in names
        and len(names) == len(set(names))
    )
    assert ("swinging_frame",) not in names and not unasked
    assert next(law for law in laws if law.effects == ("muscle1_gauge_offset",)).same_law


def test_of_a_pair_each_law_alone_is_a_rival_too_and_a_name_without_a_law_is_said():
    pair = {
        "rig": "knee",
        "same_law": False,
        "effects": [effect("tilt", {"tilt_rad": 0.02}), effect("slow_gauge", {})],
    }
    laws, unasked = laws_instead(pair, ["knee_spring", "muscle1_gauge_offset"])
    assert {
        ("tilt",),
        ("slow_gauge",),
        ("tilt", "knee_ligament"),
        ("slow_gauge", "knee_ligament"),
    } == {law.effects for law in laws}
    assert unasked == ["muscle1_gauge_offset"]

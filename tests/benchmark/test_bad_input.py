"""epa gap blind refuses bad input in one sentence, before any case is recorded or diagnosed."""

import json
import os
import shutil

import pytest

from epa_rt.benchmark.seal import seal
from epa_rt.cli.gap.blind.cases import check_cases
from epa_rt.cli.gap.blind.places import alone, check_sealed
from epa_rt.cli.main import main

MAKE = ["make", "--seed", "1", "--cases", "1"]


@pytest.mark.parametrize(
    "arguments, words",
    [
        ([*MAKE, "-o", "{folder}/file"], "found a file, expected a folder"),
        (["matrix", "--seed", "1", "-o", "{folder}/file"], "found a file, expected a folder"),
        (
            [*MAKE, "-o", "{folder}/new", "--config", "{folder}/nothing"],
            "found no folder rigs in it",
        ),
        ([*MAKE, "-o", "{folder}"], "found a folder with files"),
        (["matrix", "--seed", "1", "-o", "{folder}"], "found a folder with files"),
        (
            [*MAKE, "-o", "{folder}/new", "--kinds", "gremlin"],
            "found gremlin, expected some of single",
        ),
        (
            [*MAKE, "--each", "20", "-o", "{folder}/new"],
            "found --cases beside it, expected it alone",
        ),
        (
            ["make", "--seed", "1", "--each", "20", "--kinds", "single", "-o", "{folder}/new"],
            "found --kinds beside it, expected it alone",
        ),
        (
            ["score", "{folder}/nothing", "--json", "{folder}/out.json"],
            "found no such folder, expected the cases",
        ),
        (["score", "{folder}", "--json", "{folder}/out.json"], "expected the sealed truth"),
        (["oracle", "{folder}", "--json", "{folder}/out.json"], "expected the sealed truth"),
        (
            ["oracle", "{folder}", "--json", "{folder}/out.json", "--missed"],
            "expected the folder of answers",
        ),
        (
            ["oracle", "{folder}", "--json", "{folder}/out.json", "--answers", "{folder}/nothing"],
            "found no such folder, expected the answers",
        ),
        (["rivals", "{folder}", "--json", "{folder}/out.json"], "expected the sealed truth"),
        (
            ["score", "{folder}", "--json", "{folder}/file/out.json"],
            "in which nothing can be written",
        ),
        (["score", "{folder}", "--json", "{folder}/out.txt"], "expected .json"),
        (["pool", "{folder}/nothing"], "cannot be read"),
        (["pool", "{folder}/file"], "found no figures in it"),
        (["pool", "{folder}/file", "{folder}/../{name}/file"], "expected every set once"),
    ],
)
def test_one_sentence_and_exit_2(arguments, words, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert (
        main(
            [
                "gap",
                "blind",
                *(one.format(folder=tmp_path, name=tmp_path.name) for one in arguments),
            ]
        )
        == 2
    )
    error = capsys.readouterr().err.strip()
    assert words in error and error.count("\n") == 0
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("part", [MAKE, ["matrix", "--seed", "1"]])
def test_a_folder_that_another_one_is_at_work_in_is_refused(part, tmp_path, capsys, monkeypatch):
    out, words = tmp_path / "cases", ["gap", "blind", *part, "-o", str(tmp_path / "cases")]
    with alone(out):
        assert main(words) == 2
        error = capsys.readouterr().err.strip()
        assert "another epa gap blind is at work in" in error and error.count("\n") == 0
    made = []
    monkeypatch.setattr("epa_rt.cli.gap.blind.make.record_all", lambda *_, **__: made.append(1))
    monkeypatch.setattr("epa_rt.benchmark.matrix.matrix", lambda *_: "")
    assert main(words) == 0 and made and not [*out.iterdir()]


@pytest.mark.parametrize(
    "spoil, words",
    [
        (
            lambda d: (d / "cases.sealed/truth.key").unlink(),
            "truth.key: found no such file, expected the key",
        ),
        (lambda d: (d / "cases/truth.sha256").unlink(), "truth.sha256: cannot be read"),
        (
            lambda d: (d / "cases/truth.sha256").write_text("deadbeef"),
            "truth.sha256: found 'deadbeef', expected the hash of the sealed truth, 64 hex digits",
        ),
        (lambda d: (d / "cases/case_000/case.json").unlink(), "case_000/case.json: cannot be read"),
        (
            lambda d: (d / "cases/case_000/case.json").write_text("{"),
            "case_000/case.json: found no JSON",
        ),
        (
            lambda d: (d / "cases/case_000/case.json").write_text("{}"),
            "case_000/case.json: rig: found None, expected a name",
        ),
        (
            lambda d: (d / "cases/case_000/logs/log_a.mcap").unlink(),
            "log_a.mcap: found no such file or directory, expected a log",
        ),
        (
            lambda d: os.truncate(d / "cases/case_000/logs/log_a.mcap", 40_000),
            "log_a.mcap: found that no footer: the file was cut at byte 40000",
        ),
        (lambda d: (d / "cases/case_000/plant.yaml").write_text("plant: {"), "plant.yaml:1: "),
        (lambda d: shutil.rmtree(d / "cases/case_000"), "found no folder case_000"),
    ],
)
def test_a_case_that_is_not_as_it_was_made_is_said_before_any_diagnosis_and_the_truth_stays_sealed(
    spoil, words, short_case, tmp_path, capsys, monkeypatch
):
    folder, truth = short_case
    shutil.copytree(folder, tmp_path / "cases/case_000")
    seal({"seed": 1, "cases": [truth]}, tmp_path / "cases.sealed", tmp_path / "cases")
    check_sealed(tmp_path / "cases", tmp_path / "cases.sealed")
    check_cases(tmp_path / "cases")
    spoil(tmp_path)
    monkeypatch.setattr(
        "epa_rt.benchmark.score.opened", lambda *_: pytest.fail("the truth was opened")
    )
    assert (
        main(
            ["gap", "blind", "score", str(tmp_path / "cases"), "--json", str(tmp_path / "out.json")]
        )
        == 2
    )
    error = capsys.readouterr().err.strip()
    assert words in error and error.count("\n") == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cases", "cases.sealed"]


def test_one_set_scored_twice_is_not_pooled_as_two(tmp_path, capsys):
    figure = {"key": "first", "says": "", "bar": "", "value": 1.0, "right": 1, "of": 1}
    for name, found in (
        ("a", {"truth_sha256": "1"}),
        ("b", {"truth_sha256": "1"}),
        ("old", {}),
        ("older", {}),
    ):
        (tmp_path / f"{name}.json").write_text(json.dumps({**found, "figures": [figure]}))
    assert (
        main(["gap", "blind", "pool", *(str(tmp_path / f"{name}.json") for name in ("a", "b"))])
        == 2
    )
    assert "b.json: found the same set as in" in capsys.readouterr().err
    assert (
        main(
            [
                "gap",
                "blind",
                "pool",
                *(str(tmp_path / f"{name}.json") for name in ("a", "old", "older")),
            ]
        )
        == 0
    )
    assert "3/3" in capsys.readouterr().out


@pytest.mark.parametrize(
    "flag, text", [("--cases", "0"), ("--cases", "-3"), ("--cases", "many"), ("--jobs", "0")]
)
def test_counts_are_one_or_more(flag, text, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["gap", "blind", *MAKE, flag, text, "-o", str(tmp_path / "new")])
    assert (
        ended.value.code == 2
        and f"found {text}, expected a whole number, 1 or more" in capsys.readouterr().err
    )


@pytest.mark.parametrize("text", ["0", "-3", "strong", "nan", "1000"])
def test_a_strength_is_a_number_of_detection_limits(text, tmp_path, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["gap", "blind", *MAKE, f"--each={text}", "-o", str(tmp_path / "new")])
    assert (
        ended.value.code == 2
        and f"found {text}, expected a number of detection limits, 0.5 to 200"
        in capsys.readouterr().err
    )

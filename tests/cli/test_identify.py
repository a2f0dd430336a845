"""epa identify from the outside: a run, its identification, the identified plant run again; bad
input in one sentence.
"""

import dataclasses
import json

import numpy as np
import pytest

from epa_rt.cli.main import main
from epa_rt.gap.rig.read import read_recording
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT, epa_here

RIG = RIGS / "bench.yaml"
pytestmark = pytest.mark.xdist_group("epa identify")  # its fixtures cost more than its tests


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("identify")


@pytest.fixture(scope="module")
def log(folder):
    """A muscle with braid friction and a bladder spring that the plant file does not know."""
    real = folder / "real.yaml"
    real.write_text(
        (ROOT / "config/plants/bench.yaml").read_text(encoding="utf-8")
        + "\neffects:\n  braid_maxwell_slip: {slip: 0.06}\n  bladder_spring: {bladder_stiffness:"
        " 300 N/m}\n",
        encoding="utf-8",
    )
    done = epa_here(
        "run",
        EXPERIMENTS / "identification_short.yaml",
        "--rig",
        RIG,
        "--plant",
        real,
        "-o",
        folder / "run.mcap",
        "--quiet",
    )
    assert done.returncode == 0, done.stderr
    return folder / "run.mcap"


@pytest.fixture(scope="module")
def identified(folder, log):
    done = epa_here(
        "identify",
        log,
        "--rig",
        RIG,
        "--json",
        folder / "a.json",
        "--html",
        folder / "a.html",
        "-o",
        folder / "physical.yaml",
    )
    assert done.returncode == 0, done.stderr
    return done, json.loads((folder / "a.json").read_text(encoding="utf-8"))


def test_it_says_what_it_found(identified):
    done, answer = identified
    scores = {score["name"]: score for score in answer["models"]}
    assert (
        scores["physical, held"]["r2"]
        > 0.999
        > scores["polynomial"]["r2"]
        > scores["static, geometry"]["r2"]
    )
    assert scores["physical, held"]["coefficients"]["muscle0.slip_ratio"] == pytest.approx(
        0.06, rel=0.15
    )
    assert (
        "physical, held" in done.stdout
        and "normalised: P = gauge pressure / 750 kPa" in done.stdout
        and "fit: polynomial" in done.stderr
    )
    assert {way["name"] for way in answer["terms"]} >= {
        "paper: drop the smallest coefficient",
        "forward: add the most R2",
    }


def test_the_page_needs_no_network_and_draws_every_picture(identified, folder):
    text = (folder / "a.html").read_text(encoding="utf-8")
    assert text.count('class="chart"') == 10 and "scatter3d" in text
    assert "http://" not in text.split("<main>")[1].split("</main>")[0] and "<link" not in text


@pytest.mark.parametrize(("model", "least"), [("physical", 0.995), ("polynomial", 0.95)])
def test_the_identified_plant_runs_and_pulls_like_the_muscle(
    identified, log, folder, model, least, capsys
):
    plant = folder / f"{model}.yaml"
    if model != "physical":  # which is the best here, and is written already
        assert (
            main(
                [
                    "identify",
                    str(log),
                    "--rig",
                    str(RIG),
                    "-o",
                    str(plant),
                    "--model",
                    model,
                    "--quiet",
                    "--no-terms",
                    "--no-physical",
                ]
            )
            == 0
        )
    done = epa_here(
        "run",
        EXPERIMENTS / "identification_short.yaml",
        "--rig",
        RIG,
        "--plant",
        plant,
        "-o",
        folder / f"{model}.mcap",
        "--quiet",
    )
    assert done.returncode == 0, done.stderr
    real, again = read_recording(log), read_recording(folder / f"{model}.mcap")
    for one, other in zip(
        (s for s in real.spans if s.trial), (s for s in again.spans if s.trial), strict=True
    ):
        n = min(one.stop - one.start, other.stop - other.start)
        force, made = (
            r.columns["muscle_force_n"][s.start : s.start + n]
            for r, s in ((real, one), (again, other))
        )
        assert 1.0 - np.mean((force - made) ** 2) / np.var(force) > least


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["--rig", str(RIGS / "knee.yaml")],
            "found a log of the rig 'bench', expected one of 'knee'",
        ),
        (["--json", "a.txt"], "found the ending '.txt', expected .json"),
        (["--model", "physical", "--no-physical"], "expected one of them"),
        (
            ["--rig", str(RIG), "-o", str(ROOT / "config/rigs/../plants/bench.yaml")],
            "bench.yaml: found a plant file that epa identify did not write, expected a name",
        ),
        (["-o", str(RIG)], "found a rig file that epa identify did not write"),
        ([str(RIG)], f"{RIG}: found a rig file among the logs, expected --rig {RIG}"),
    ],
    ids=("rig", "ending", "model", "own plant", "rig file", "rig as a log"),
)
def test_bad_input_is_one_sentence(log, capsys, arguments, words):
    assert main(["identify", str(log), *arguments, "--quiet"]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("rest0: 12 cm", "rest0: 30 cm", "expected all shorter than the braid"),
        ("braid_length: 20.78 cm", "braid_length: 14 cm", "expected all shorter than the braid"),
        (
            "braid_length: 20.78 cm",
            "braid_length: 30 cm",
            "expected some beyond the no-load length",
        ),
        ("kind_code: 0", "kind_code: 1\n  load0: 1", "whose load moves the muscle as well"),
    ],
    ids=("length", "short braid", "long braid", "moving load"),
)
def test_a_plant_file_that_cannot_be_this_rig_is_one_sentence(
    log, capsys, tmp_path, old, new, words
):
    text = (ROOT / "config/plants/bench.yaml").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "p.yaml").write_text(text.replace(old, new), encoding="utf-8")
    assert (
        main(
            [
                "identify",
                str(log),
                "--rig",
                str(RIG),
                "--plant",
                str(tmp_path / "p.yaml"),
                "--quiet",
            ]
        )
        == 2
    )
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1


def test_no_log_is_one_sentence(tmp_path, capsys):
    other = tmp_path / "x.mcap"
    other.write_bytes(b"nothing")
    assert (
        main(["identify", str(other), "--quiet"]) == 2
        and main(["identify", str(tmp_path / "none.mcap"), "--quiet"]) == 2
    )
    assert capsys.readouterr().err.count("\n") == 2


def test_logs_of_two_rigs_are_refused(log, monkeypatch, capsys, tmp_path):
    import epa_rt.cli.gap.inputs

    real = epa_rt.cli.gap.inputs.read([log], None)[0]
    monkeypatch.setattr(
        epa_rt.cli.gap.inputs,
        "read",
        lambda logs, rig: (real, dataclasses.replace(real, rig="knee")),
    )
    assert main(["identify", str(log), str(tmp_path / "other.mcap"), "--quiet"]) == 2
    assert "found logs of the rigs bench, knee, expected those of one" in capsys.readouterr().err


def test_a_log_without_its_files_asks_for_the_rig(log, monkeypatch, capsys):
    """A log of a real rig carries no plant file, and one that was imported perhaps no rig file."""
    import epa_rt.cli.gap.inputs

    real = epa_rt.cli.gap.inputs.read([log], None)[0]
    for left, words in (("rig.yaml", "no plant file in the log"), ("", "no rig file of ours")):
        files = {name: text for name, text in real.attachments.items() if name == left}
        bare = dataclasses.replace(real, attachments=files)
        monkeypatch.setattr(epa_rt.cli.gap.inputs, "read", lambda *_, bare=bare: (bare,))
        assert main(["identify", str(log), "--quiet"]) == 2
        said = capsys.readouterr().err
        assert f"{log}: found {words}" in said and "expected --rig RIG" in said


def test_a_log_twice_is_refused(log, capsys):
    assert main(["identify", str(log), str(log), "--quiet"]) == 2
    assert "expected every log once" in capsys.readouterr().err


def test_without_a_rig_file_the_log_carries_its_own(log, capsys):
    assert main(["identify", str(log), "--quiet", "--no-terms", "--no-physical"]) == 0
    assert "polynomial" in capsys.readouterr().out

"""epa study from the outside: a small serial study, its rule run on the mass rig, bad input in one
sentence.
"""

import json

import pytest

from epa_rt.cli.main import main
from tests.cli.shell import RIGS, ROOT

STUDY = """study: serial
plant: {plants}/mass.yaml
beside: [{plants}/serial_eq8.yaml]
mean: 15 mm
amplitude: 10 mm
pressure: [500 kPa abs, 700 kPa abs, 900 kPa abs]
frequency: [15 rad/s, 20 rad/s, 80 rad/s]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("study")


@pytest.fixture(scope="module")
def study(folder):
    path = folder / "study.yaml"
    path.write_text(STUDY.format(plants=ROOT / "config/plants"), encoding="utf-8")
    assert (
        main(
            [
                "study",
                "serial",
                str(path),
                "--store",
                str(folder / "store"),
                "--jobs",
                "1",
                "--json",
                str(folder / "a.json"),
                "--html",
                str(folder / "a.html"),
                "-o",
                str(folder / "rule.yaml"),
                "--quiet",
            ]
        )
        == 0
    )
    return path


def test_it_writes_figures_claims_and_a_page(study, folder):
    answer = json.loads((folder / "a.json").read_text(encoding="utf-8"))
    assert len(answer["maps"]["stroke_m"]) == 3 and len(answer["maps"]["stroke_m"][0]) == 3
    assert all(
        value is None for row in answer["beside"]["serial_eq8"]["stroke_m"] for value in row
    )  # ran away
    assert any(
        "eq. (8)" in claim["where"] and claim["holds"] is False for claim in answer["claims"]
    )
    page = (folder / "a.html").read_text(encoding="utf-8")
    assert page.count('class="chart"') >= 7 and "runs away at all 9 points" in page


def test_results_are_kept(study, folder, capsys):
    before = sorted((path.name, path.stat().st_size) for path in (folder / "store").iterdir())
    assert (
        main(
            [
                "study",
                "serial",
                str(study),
                "--store",
                str(folder / "store"),
                "--jobs",
                "1",
                "--quiet",
            ]
        )
        == 0
    )
    assert (
        sorted((path.name, path.stat().st_size) for path in (folder / "store").iterdir()) == before
    )


def test_the_rule_becomes_an_experiment_that_runs(study, folder):
    assert (
        main(
            [
                "study",
                "rule",
                str(folder / "rule.yaml"),
                "--frequency",
                "20 rad/s",
                "--seconds",
                "3",
                "-o",
                str(folder / "best.yaml"),
            ]
        )
        == 0
    )
    assert (
        main(
            [
                "run",
                str(folder / "best.yaml"),
                "--rig",
                str(RIGS / "mass.yaml"),
                "-o",
                str(folder / "best.mcap"),
                "--quiet",
            ]
        )
        == 0
    )


@pytest.mark.parametrize(
    ("frequency", "said"),
    [("200 rad/s", "where the rule holds"), ("20 kPa", "found"), ("fast", "found")],
)
def test_a_frequency_that_no_rule_covers(study, folder, capsys, frequency, said):
    assert (
        main(
            [
                "study",
                "rule",
                str(folder / "rule.yaml"),
                "--frequency",
                frequency,
                "-o",
                str(folder / "no.yaml"),
            ]
        )
        == 2
    )
    told = capsys.readouterr().err
    assert said in told and told.count("\n") == 1


def test_no_file_of_another_hand_is_written_over(study, folder, capsys):
    """Not even before any work, and the same name twice is no such file."""
    mass = folder / "mass.yaml"
    mass.write_text("rig: mass\n", encoding="utf-8")
    for words in (("serial", study), ("rule", folder / "rule.yaml", "--frequency", "20 rad/s")):
        assert main(["study", *map(str, words), "-o", str(mass)]) == 2
        said = capsys.readouterr().err
        assert f"{mass}: found a rig file that epa study {words[0]} did not write" in said
    asked = ["study", "rule", str(folder / "rule.yaml"), "--frequency", "20 rad/s", "-o"]
    assert main([*asked, str(folder / "twice.yaml")]) == main([*asked, str(folder / "twice.yaml")])
    assert main([*asked, str(folder / "rule.yaml")]) == 2


@pytest.mark.parametrize("bad", [["--json", "a.txt"], ["--html", "a.json"], ["-o", "a.json"]])
def test_a_wrong_ending_is_refused_before_any_work(study, bad, capsys):
    assert main(["study", "serial", str(study), *bad]) == 2
    assert "expected" in capsys.readouterr().err


def test_a_study_that_is_not_there(capsys):
    assert main(["study", "serial", "none.yaml"]) == 2
    assert "none.yaml:1: found no such file" in capsys.readouterr().err


KNEE = """study: knee
rig: {rigs}/knee.yaml
spam: [225 kPa abs]
ppam: [145 kPa abs, 170 kPa abs]
peak_to_peak: 10 deg
from: 1 Hz
to: 2 Hz
seconds: 8 s
catalogue_spam: [225 kPa abs]
catalogue_ppam: [145 kPa abs, 170 kPa abs]
catalogue_frequency: [1 Hz, 2 Hz]
"""


def test_a_small_knee_study_through_the_loop(folder, capsys):
    path = folder / "knee.yaml"
    path.write_text(KNEE.format(rigs=RIGS), encoding="utf-8")
    arguments = [
        "study",
        "knee",
        str(path),
        "--store",
        str(folder / "store"),
        "--jobs",
        "1",
        "--json",
        str(folder / "k.json"),
        "--html",
        str(folder / "k.html"),
        "--quiet",
    ]
    assert main(arguments) == 0
    answer = json.loads((folder / "k.json").read_text(encoding="utf-8"))
    energy = {one["ppam_pa"]: sum(one["energy_a2_s"]) for one in answer["conditions"]}
    assert energy[170e3] < energy[145e3] < energy[None]
    assert answer["claims"][0]["holds"] is True
    assert (folder / "k.html").read_text(encoding="utf-8").count('class="chart"') >= 5
    first = capsys.readouterr().out
    assert main(arguments) == 0  # from the store
    assert capsys.readouterr().out == first


@pytest.mark.parametrize(
    ("old", "new", "code", "said"),
    [
        ("10 deg", "40 deg", 2, "expected at most the rig's limit"),
        ("[225 kPa abs]", "[none]", 3, "tripped: following error"),
    ],
    ids=("asked", "tripped"),
)
def test_a_condition_that_does_not_complete_is_one_sentence(folder, capsys, old, new, code, said):
    path = folder / "far.yaml"
    path.write_text(KNEE.format(rigs=RIGS).replace(old, new), encoding="utf-8")
    assert (
        main(
            ["study", "knee", str(path), "--store", str(folder / "store"), "--jobs", "1", "--quiet"]
        )
        == code
    )
    told = capsys.readouterr().err
    assert said in told and "/tmp" not in told and told.count("\n") == 1


def test_arrangements(folder, capsys):
    path = folder / "arrangements.yaml"
    path.write_text(
        f"study: arrangements\nplant: {ROOT}/config/plants/serial.yaml\nmean: 0 mm\namplitude: 10"
        " mm\npressure: [300 kPa abs, 800 kPa abs]\nfrequency: [40 rad/s]\n",
        encoding="utf-8",
    )
    assert (
        main(
            [
                "study",
                "arrangements",
                str(path),
                "--store",
                str(folder / "store"),
                "--jobs",
                "1",
                "--html",
                str(folder / "w.html"),
                "--json",
                str(folder / "w.json"),
                "--quiet",
            ]
        )
        == 0
    )
    told = capsys.readouterr().out
    assert "antagonistic" in told and "least mean of I²" in told
    assert set(json.loads((folder / "w.json").read_text(encoding="utf-8"))["least"]) == {
        "serial",
        "parallel",
        "both",
        "antagonistic",
    }

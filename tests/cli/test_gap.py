"""epa gap from the outside: a run with an effect, its diagnosis, its patch; bad input in one
sentence.
"""

import dataclasses
import json

import jsonschema
import pytest

from epa_rt.cli.main import main
from epa_rt.config.rig import load_rig
from tests.cli.shell import EXPERIMENTS, RIGS, ROOT, epa_here

RIG = RIGS / "bench.yaml"
pytestmark = pytest.mark.xdist_group(
    "epa gap"
)  # one process makes and diagnoses the runs, not each


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("gap")


@pytest.fixture(scope="module")
def experiment(folder):
    """The short identification at one pressure, for 3 s: what a diagnosis takes goes with rows."""
    text = (EXPERIMENTS / "identification_short.yaml").read_text(encoding="utf-8")
    for old, new in (
        ("p0: [460 kPa gauge, 640 kPa gauge]", "p0: [640 kPa gauge]"),
        ("for: 5 s", "for: 3 s"),
    ):
        assert old in text
        text = text.replace(old, new)
    path = folder / "one_pressure.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def logs(folder, experiment):
    """Two runs of a bench whose braid rubs, which its plant file does not know."""
    plant = (ROOT / "config/plants/bench.yaml").read_text(encoding="utf-8")
    real = folder / "real.yaml"
    real.write_text(plant + "\neffects:\n  braid_maxwell_slip: {slip: 0.06}\n", encoding="utf-8")
    paths = [folder / f"run{seed}.mcap" for seed in (1, 2)]
    for seed, path in enumerate(paths, 1):
        done = epa_here(
            "run", experiment, "--rig", RIG, "--plant", real, "--seed", seed, "-o", path, "--quiet"
        )
        assert done.returncode == 0, done.stderr
    return paths


@pytest.fixture(scope="module")
def log(logs):
    return logs[0]


@pytest.fixture(scope="module")
def diagnosed(folder, logs):
    """The whole command once: what it printed, and what it wrote."""
    done = epa_here(
        "gap",
        "diagnose",
        "--rig",
        RIG,
        logs[0],
        "--holdout",
        logs[1],
        "--json",
        folder / "gap.json",
        "--html",
        folder / "gap.html",
        "-o",
        folder / "patched.yaml",
        "--picture",
        folder / "gap.svg",
        "--no-plan",
    )
    assert done.returncode == 0, done.stderr
    return done, json.loads((folder / "gap.json").read_text(encoding="utf-8"))


def test_the_diagnosis_names_the_place_and_the_kind_of_effect(diagnosed):
    done, answer = diagnosed
    assert answer["location"][0]["block"] == "muscle" and answer["effects"][0]["family"].startswith(
        "braid friction"
    )
    first = answer["effects"][0]
    assert "braid_maxwell_slip" in (
        first["name"],
        *first["not_separable_from"],
        *first["in_more_numbers"],
    ), "the rig's own law is said, if only as one that says the same"
    assert (
        answer["verdict"].upper().replace("_", " ") in done.stdout and "all channels" in done.stdout
    )
    assert "each effect alone" in done.stderr, "progress is shown"


def test_what_it_wrote_fits_the_schema_and_says_what_it_read(diagnosed, log, logs):
    from epa_rt.gap.report.as_json import schema

    _, answer = diagnosed
    jsonschema.validate(answer, schema())
    assert (
        answer["inputs"]["rig"] == str(RIG)
        and answer["inputs"]["logs"] == [str(log)]
        and answer["inputs"]["holdout"] == [str(logs[1])]
    )
    assert answer["seconds"] > 0.0 and answer["found_first"] == []


def test_the_gate_comes_as_near_as_was_predicted(diagnosed):
    gate = diagnosed[1]["gate"]
    assert gate["passed"] and gate["achieved_share"] == pytest.approx(
        gate["predicted_share"], abs=0.05
    )
    assert gate["achieved_share"] > 0.95


def test_page_and_picture_are_there_and_whole(diagnosed, folder):
    assert "Where the gap lies" in (folder / "gap.html").read_text(encoding="utf-8")
    assert (folder / "gap.svg").read_text(encoding="utf-8").startswith("<svg") and "the rig" in (
        folder / "gap.svg"
    ).read_text(encoding="utf-8")


def test_patch_writes_the_same_plant_file_from_the_json(diagnosed, folder, capsys):
    from epa_rt.models.plant_file import load_plant

    assert (
        main(
            [
                "gap",
                "patch",
                str(folder / "gap.json"),
                "--rig",
                str(RIG),
                "-o",
                str(folder / "again.yaml"),
            ]
        )
        == 0
    )
    assert diagnosed[1]["effects"][0]["name"] in capsys.readouterr().out
    first, again = load_plant(folder / "patched.yaml"), load_plant(folder / "again.yaml")
    assert first.params.tobytes() == again.params.tobytes() and first.effects == again.effects != ()


def test_patch_does_not_write_over_the_plant_that_was_diagnosed(diagnosed, folder, capsys):
    plant = folder / "own.yaml"
    plant.write_text(
        (ROOT / "config/plants/bench.yaml").read_text(encoding="utf-8"), encoding="utf-8"
    )
    assert (
        main(
            [
                "gap",
                "patch",
                str(folder / "gap.json"),
                "--rig",
                str(RIG),
                "--plant",
                str(plant),
                "-o",
                str(plant),
            ]
        )
        == 2
    )
    assert "expected another name" in capsys.readouterr().err


def test_localise_says_where_without_a_cause(log, folder, capsys):
    assert (
        main(
            [
                "gap",
                "localise",
                "--rig",
                str(RIG),
                str(log),
                "--json",
                str(folder / "where.json"),
                "--html",
                str(folder / "where.html"),
                "--quiet",
            ]
        )
        == 0
    )
    found, shown = (
        json.loads((folder / "where.json").read_text(encoding="utf-8")),
        capsys.readouterr().out,
    )
    assert found["location"][0]["block"] == "muscle" and "muscle force" in shown
    assert found["origins"][0]["place"] == "muscle" and "It may come from a muscle's force" in shown
    assert (
        "Where the gap lies" in (folder / "where.html").read_text(encoding="utf-8")
        and "where.html" in shown
    )


def test_localise_of_the_plant_file_as_it_stands_asks_no_places(log, folder, capsys):
    assert (
        main(
            [
                "gap",
                "localise",
                "--rig",
                str(RIG),
                str(log),
                "--as-is",
                "--json",
                str(folder / "as_is.json"),
                "--quiet",
            ]
        )
        == 0
    )
    assert (
        json.loads((folder / "as_is.json").read_text(encoding="utf-8"))["origins"] == []
        and "It may come" not in capsys.readouterr().out
    )


def test_plan_has_nothing_to_tell_apart_without_rivals(diagnosed, folder, log, capsys):
    answer = json.loads((folder / "gap.json").read_text(encoding="utf-8"))
    for effect in answer["effects"]:
        effect["not_separable_from"] = []
    alone = folder / "alone.json"
    alone.write_text(json.dumps(answer), encoding="utf-8")
    assert main(["gap", "plan", str(alone), "--rig", str(RIG), str(log), "--quiet"]) == 0
    said = capsys.readouterr()
    assert "nothing to tell apart" in said.err and not said.out, (
        "nothing that is no experiment goes where the file would"
    )


def test_plan_prints_the_file_alone_and_what_it_says_of_it_beside(
    diagnosed, folder, log, capsys, monkeypatch
):
    from epa_rt.cli.gap import plan
    from epa_rt.experiments.experiment import load_experiment
    from epa_rt.gap.diagnosis import NextExperiment

    answer = json.loads((folder / "gap.json").read_text(encoding="utf-8"))
    answer["effects"][0]["not_separable_from"] = ["leak"]
    both, file = (
        folder / "open.json",
        (EXPERIMENTS / "identification_short.yaml").read_text(encoding="utf-8"),
    )
    both.write_text(json.dumps(answer), encoding="utf-8")
    monkeypatch.setattr(
        plan,
        "planned",
        lambda *_, **__: NextExperiment(
            "short", {}, ("leak",), 30.0, file, "five apart, which decides"
        ),
    )
    asked = ["gap", "plan", str(both), "--rig", str(RIG), str(log), "--quiet"]
    assert main(asked) == 0
    said = capsys.readouterr()
    assert said.err == "short: five apart, which decides\n"
    (folder / "next.yaml").write_text(said.out, encoding="utf-8")
    assert load_experiment(folder / "next.yaml", load_rig(RIG)).trials
    assert main([*asked, "-o", str(folder / "other.yaml")]) == 0
    assert (
        capsys.readouterr().out == f"{folder / 'other.yaml'}: five apart, which decides\n"
        and (folder / "other.yaml").read_text(encoding="utf-8") == file
    )


def test_plan_refuses_a_name_that_the_rig_has_not(diagnosed, folder, log, capsys):
    answer = json.loads((folder / "gap.json").read_text(encoding="utf-8"))
    answer["effects"][0]["not_separable_from"] = ["witchcraft"]
    other = folder / "other.json"
    other.write_text(json.dumps(answer), encoding="utf-8")
    assert main(["gap", "plan", str(other), "--rig", str(RIG), str(log), "--quiet"]) == 2
    assert (
        "other.json: found the effect witchcraft, expected one of the catalogue"
        in capsys.readouterr().err
    )


def test_plan_says_where_no_experiment_of_the_menu_can_be_run(
    diagnosed, folder, log, capsys, monkeypatch
):
    answer = json.loads((folder / "gap.json").read_text(encoding="utf-8"))
    answer["effects"][0]["not_separable_from"] = ["leak"]
    other = folder / "both.json"
    other.write_text(json.dumps(answer), encoding="utf-8")
    monkeypatch.setattr("epa_rt.gap.rig.menu.bench_menu", lambda rig: [])
    assert main(["gap", "plan", str(other), "--rig", str(RIG), str(log), "--quiet"]) == 2
    assert "found no experiment of the menu" in capsys.readouterr().err


def test_the_catalogue_lists_every_effect_with_its_knobs(capsys):
    from epa_rt.models.catalogue import CATALOGUE

    assert main(["gap", "catalogue", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)
    assert [row["name"] for row in rows] == [effect.name for effect in CATALOGUE] and len(
        rows
    ) >= 35
    assert all(
        {"key", "unit", "neutral", "low", "high", "typical", "scale", "low_scale"} == set(knob)
        for row in rows
        for knob in row["knobs"]
    )
    assert all(
        row["family"] and row["block"] and row["equation"] and row["source"] and row["knobs"]
        for row in rows
    )
    assert main(["gap", "catalogue"]) == 0
    text = capsys.readouterr().out
    assert f"{len(rows)} effects" in text and all(row["name"] in text for row in rows)


def test_the_catalogue_of_other_rigs_says_their_equations_and_in_what_its_bounds_count(capsys):
    assert main(["gap", "catalogue", "--kind", "carriage"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "0 to 5 x typical_force" in text and "F = M a + B v" in text
    assert main(["gap", "catalogue", "--kind", "boat"]) == 2
    assert (
        "--kind: found 'boat', expected one of carriage, chamber, piston, servo, shaft"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["diagnose", "{log}", "--leave-out", "gremlin"], "found 'gremlin', expected an effect"),
        (
            ["diagnose", "{log}", "--html", "page.txt"],
            "found the ending '.txt', expected .html or .htm",
        ),
        (["diagnose", "{log}", "{log}"], "expected every log once"),
        (["diagnose", "nothing.mcap"], "nothing.mcap"),
        (["diagnose", "{rig}"], "found a rig file among the logs, expected --rig"),
        (["diagnose", "{log}", "--plant", "{rig}"], "bench.yaml:"),
        (["localise", "{log}", "--json", "where.txt"], "expected .json"),
        (["patch", "{rig}", "-o", "x.yaml"], "found no JSON"),
        (["plan", "{log}", "{log}"], "expected a diagnosis"),
    ],
)
def test_bad_input_is_one_sentence_with_exit_2(arguments, words, log, capsys):
    filled = [one.format(log=log, rig=RIG) for one in arguments]
    assert main(["gap", filled[0], "--rig", str(RIG), *filled[1:]]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1


def test_a_log_of_another_rig_is_said_before_anything_is_fitted(log, capsys):
    assert main(["gap", "diagnose", "--rig", str(RIGS / "knee.yaml"), str(log)]) == 2
    found = capsys.readouterr()
    assert (
        "recorded on the rig 'bench', expected 'knee'" in found.err
        and found.err.count("\n") == 1
        and not found.out
    )


@pytest.mark.parametrize("task", ["localise", "diagnose"])
def test_a_log_is_never_written_over_and_that_is_said_before_any_work(
    task, log, capsys, monkeypatch
):
    def opened(*_):
        pytest.fail("the logs were read first")

    monkeypatch.setattr(f"epa_rt.cli.gap.{task}.opened", opened)
    before = log.read_bytes()
    renamed = log.with_suffix(".json")
    renamed.write_bytes(before)
    assert main(["gap", task, "--rig", str(RIG), str(log), "--json", str(renamed), "--quiet"]) == 2
    assert "no log is overwritten" in capsys.readouterr().err and renamed.read_bytes() == before


def test_an_interruption_after_the_diagnosis_keeps_what_was_written(
    diagnosed, folder, log, monkeypatch, capsys
):
    from epa_rt.cli.gap import diagnose

    answer = dataclasses.replace(_answer(folder), gate=None)
    monkeypatch.setattr(diagnose, "_diagnosed", lambda *_: answer)

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(diagnose, "gated", interrupted)
    out = folder / "interrupted.json"
    assert (
        main(
            [
                "gap",
                "diagnose",
                "--rig",
                str(RIG),
                str(log),
                "--json",
                str(out),
                "--no-plan",
                "--quiet",
            ]
        )
        == 130
    )
    written = json.loads(out.read_text(encoding="utf-8"))
    assert written["effects"] and written["gate"] is None
    found = capsys.readouterr()
    assert "what was found until then stands" in found.err and "all channels" in found.out


def test_what_is_wrong_with_the_logs_is_said_before_any_effect(
    diagnosed, folder, log, monkeypatch, capsys
):
    from epa_rt.cli.gap import diagnose

    given = diagnose.opened
    monkeypatch.setattr(
        diagnose,
        "opened",
        lambda *a: dataclasses.replace(given(*a), found=("run: 12 of 29000 cycles are missing",)),
    )
    monkeypatch.setattr(diagnose, "_diagnosed", lambda *_: _answer(folder))
    assert (
        main(["gap", "diagnose", "--rig", str(RIG), str(log), "--no-plan", "--no-gate", "--quiet"])
        == 0
    )
    text = capsys.readouterr().out
    assert text.index("cycles are missing") < text.index("Confidence")


def test_a_cut_log_is_said_to_be_cut_before_any_effect(diagnosed, folder, log, monkeypatch, capsys):
    """The log is truly cut and read as it is; only the long work after it is not done again."""
    from epa_rt.cli.gap import diagnose

    cut = folder / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: int(0.9 * log.stat().st_size)])
    monkeypatch.setattr(diagnose, "_diagnosed", lambda *_: _answer(folder))
    assert (
        main(["gap", "diagnose", "--rig", str(RIG), str(cut), "--no-plan", "--no-gate", "--quiet"])
        == 0
    )
    text = " ".join(capsys.readouterr().out.split())
    assert 0 <= text.index("the file was cut at byte") < text.index("Confidence")


def test_a_repeat_against_a_repeat_is_no_gap(folder, experiment):
    """One rig, one experiment, run twice: the second run holds nothing that the first did not."""
    runs = [folder / f"repeat{seed}.mcap" for seed in (11, 12)]
    for seed, path in zip((11, 12), runs, strict=True):
        assert (
            epa_here(
                "run", experiment, "--rig", RIG, "--seed", seed, "-o", path, "--quiet"
            ).returncode
            == 0
        )
    out = folder / "repeat.json"
    done = epa_here(
        "gap",
        "diagnose",
        "--rig",
        RIG,
        runs[0],
        "--holdout",
        runs[1],
        "--json",
        out,
        "--quiet",
        "--no-plan",
        "--no-gate",
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(out.read_text(encoding="utf-8"))
    assert answer["verdict"] == "no_gap" and not answer["effects"]
    whole = [entry for entry in answer["shrinkage"] if entry["channel"] == "all channels"]
    assert {entry["mode"] for entry in whole} == {"teacher_forced", "free_run"}
    assert all(0.8 < entry["before"] / entry["floor"] < 1.25 for entry in whole), whole


def _answer(folder):
    from epa_rt.gap.answer.patch import load_diagnosis

    return load_diagnosis(folder / "gap.json")

"""epa gap refuses what does not belong together before any fit, and loses no answer to a file that
cannot be written.
"""

import argparse
import shutil
from dataclasses import replace

import numpy as np
import pytest

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.fits import check_trials
from epa_rt.cli.gap.inputs import opened
from epa_rt.cli.main import main
from epa_rt.gap.diagnosis import Diagnosis
from tests.cli.shell import RIGS, ROOT
from tests.gap.foreign.made import one_trial, with_output
from tests.gap.recorded import log_of

RIG = RIGS / "bench.yaml"
PLANTS = ROOT / "config/plants"
pytestmark = pytest.mark.xdist_group("epa gap")


@pytest.fixture(scope="module")
def log():
    return log_of("bench", "identification_short")


@pytest.fixture
def answered(monkeypatch):
    """A diagnosis that is there at once."""
    from epa_rt.cli.gap import diagnose

    answer = Diagnosis("no_gap", "Nothing is left beyond the noise floor.")
    monkeypatch.setattr(diagnose, "_diagnosed", lambda *_: answer)


def refused(capsys, *arguments):
    assert main(["gap", *map(str, arguments), "--quiet"]) == 2
    found = capsys.readouterr()
    assert found.err.count("\n") == 1 and not found.out, found
    return found.err


@pytest.mark.parametrize(
    "plant, words",
    [("knee", "knee.yaml:30: load.kind_code: found a joint"), ("mass", "found a mass on a line")],
)
@pytest.mark.parametrize("task", ["diagnose", "localise"])
def test_a_plant_of_another_rig(task, plant, words, log, capsys):
    said = refused(capsys, task, "--rig", RIG, "--plant", PLANTS / f"{plant}.yaml", log)
    assert (
        words in said
        and "expected a muscle held by the load cell (kind_code 0), which the rig 'bench' has"
        in said
    )


def test_a_copy_of_a_log_is_no_holdout(log, tmp_path, capsys):
    shutil.copy(log, tmp_path / "copy.mcap")
    assert "copy: found every one of its" in refused(
        capsys, "diagnose", "--rig", RIG, log, "--holdout", tmp_path / "copy.mcap"
    )


def test_a_log_of_ours_with_a_rig_of_others(log, capsys):
    said = refused(capsys, "localise", "--rig", ROOT / "config/rigs_foreign/emps.yaml", log)
    assert "found a log of the rig 'bench', expected 'emps'" in said


@pytest.mark.parametrize("found", [(), ("no footer: the file was cut at byte 98877",)])
def test_a_log_without_a_trial_says_so_and_what_is_wrong_with_it(found):
    made = one_trial("made", "cart", 0.01, {"place_m": np.zeros(9)})
    check_trials([made])
    spans = tuple(replace(span, trial=False) for span in made.spans)
    for one in (spans, ()):
        with pytest.raises(VerbError, match="^cut.mcap: found no trial.*, expected one") as error:
            check_trials([made, replace(made, path="cut.mcap", spans=one, found=found)])
        assert all(f"({sentence})" in str(error.value) for sentence in found)


def test_a_column_that_the_rig_of_others_names_and_the_log_lacks(tmp_path, capsys):
    (tmp_path / "m.yaml").write_text(
        "mapping: emps\nrig: emps\nformat: {kind: csv}\nclock: {rate: 100 Hz}\nmeasured:"
        " {carriage_position_m: {column: x, unit: m}}\n"
    )
    (tmp_path / "a.csv").write_text("x\n" + "\n".join(str(k % 7) for k in range(300)) + "\n")
    assert (
        main(
            [
                "import",
                str(tmp_path / "m.yaml"),
                str(tmp_path / "a.csv"),
                "-o",
                str(tmp_path / "a.mcap"),
            ]
        )
        == 0
    )
    capsys.readouterr()
    said = refused(
        capsys, "localise", "--rig", ROOT / "config/rigs_foreign/emps.yaml", tmp_path / "a.mcap"
    )
    assert "a.mcap: found no column motor_force_n, expected what " in said
    assert "most like it are " in said and "carriage_position_m" in said


def imported_carriage(tmp_path, scale: str, rows: int = -1, rate: str = "500 Hz"):
    """A carriage's log whose force the mapping reads with a scale; its first ``rows`` alone."""
    made = with_output("carriage", {})
    table = list(
        zip(*(made.columns[name] for name in ("carriage_position_m", "motor_force_n")), strict=True)
    )
    (tmp_path / "a.csv").write_text(
        "x,f\n" + "".join(f"{x:.9g},{f:.9g}\n" for x, f in table[:rows])
    )
    (tmp_path / "m.yaml").write_text(
        f"mapping: emps\nrig: emps\nformat: {{kind: csv}}\nclock: {{rate: {rate}}}\nmeasured:\n "
        " carriage_position_m: {column: x, unit: m}\n  motor_force_n: {column: f, unit: N,"
        f" scale: {scale}}}\n"
    )
    assert (
        main(
            [
                "import",
                str(tmp_path / "m.yaml"),
                str(tmp_path / "a.csv"),
                "-o",
                str(tmp_path / "a.mcap"),
            ]
        )
        == 0
    )
    return tmp_path / "a.mcap"


def test_no_log_of_several_has_the_name_of_all_of_them(tmp_path, capsys):
    """Its rows would take the place of those over all logs."""
    log = imported_carriage(tmp_path, "1")
    shutil.copy(log, tmp_path / "all.mcap")
    capsys.readouterr()
    for logs in ((log, "--holdout", tmp_path / "all.mcap"), (tmp_path / "all.mcap", log)):
        said = refused(capsys, "diagnose", "--rig", ROOT / "config/rigs_foreign/emps.yaml", *logs)
        assert (
            f"{tmp_path / 'all.mcap'}: found a log named 'all' among others, expected another name"
            in said
        )
    assert (
        opened(
            argparse.Namespace(
                rig=ROOT / "config/rigs_foreign/emps.yaml", plant=None, logs=[tmp_path / "all.mcap"]
            )
        )
        .recordings[0]
        .name
        == "all"
    )


def test_a_wrong_unit_on_a_rig_of_others(tmp_path, capsys):
    log = imported_carriage(tmp_path, "1000")
    capsys.readouterr()
    said = refused(capsys, "localise", "--rig", ROOT / "config/rigs_foreign/emps.yaml", log)
    assert (
        "motor_force_n: found" in said
        and "they look too large, a unit or a scale of the import may be wrong" in said
    )


@pytest.mark.parametrize("rate", ["250 Hz", "80 Hz"])
def test_a_log_at_a_rate_that_is_no_multiple_of_the_rigs(rate, tmp_path, capsys):
    """Its trials would be looked for where they are not."""
    log = imported_carriage(tmp_path, "1", rate=rate)
    capsys.readouterr()
    assert f"a.mcap: found {rate}, expected a multiple of 100 Hz, the rate of " in refused(
        capsys, "localise", "--rig", ROOT / "config/rigs_foreign/emps.yaml", log
    )


@pytest.mark.parametrize("severity", ["refuse", "exclude"])
def test_what_is_wrong_with_a_column_that_the_rig_does_not_use_is_a_note(severity):
    from types import SimpleNamespace

    from epa_rt.cli.gap.inputs import _of_used
    from epa_rt.gap.finding import Finding

    subject = SimpleNamespace(rig=SimpleNamespace(channels={"position": "x_m"}))
    found = [
        Finding(severity, "units", "a", channel, "a: x") for channel in ("x_m", "jaw_torque_nm", "")
    ]
    assert [one.severity for one in _of_used(found, subject)] == [
        severity,
        "note" if severity == "refuse" else severity,
        severity,
    ]


def test_the_believed_plant_file_of_a_rig_of_others_is_not_written_over(tmp_path, capsys):
    for folder in ("rigs_foreign", "plants_foreign"):
        (tmp_path / folder).mkdir()
        shutil.copy(ROOT / f"config/{folder}/emps.yaml", tmp_path / folder)
    rig, plant, before = (
        tmp_path / "rigs_foreign/emps.yaml",
        tmp_path / "plants_foreign/emps.yaml",
        (tmp_path / "plants_foreign/emps.yaml").read_bytes(),
    )
    log = imported_carriage(tmp_path, "1")
    capsys.readouterr()
    assert "found a file that is read here" in refused(
        capsys, "diagnose", "--rig", rig, log, "-o", plant
    )
    (tmp_path / "gap.json").write_text("{}")
    assert (
        main(["gap", "patch", str(tmp_path / "gap.json"), "--rig", str(rig), "-o", str(plant)]) == 2
    )
    assert (
        "the plant file that was diagnosed" in capsys.readouterr().err
        and plant.read_bytes() == before
    )


def test_the_plant_file_that_a_rig_names_is_not_written_over_where_another_one_is_given(
    tmp_path, log, capsys
):
    for folder, name in (("rigs", "bench"), ("plants", "bench"), ("plants", "bench_paper")):
        (tmp_path / folder).mkdir(exist_ok=True)
        shutil.copy(ROOT / f"config/{folder}/{name}.yaml", tmp_path / folder)
    rig, own, other = (
        tmp_path / "rigs/bench.yaml",
        tmp_path / "plants/bench.yaml",
        tmp_path / "plants/bench_paper.yaml",
    )
    before = own.read_bytes()
    (tmp_path / "gap.json").write_text("{}")
    for arguments in (("diagnose", log, "-o", own), ("patch", tmp_path / "gap.json", "-o", own)):
        assert main(["gap", *map(str, arguments), "--rig", str(rig), "--plant", str(other)]) == 2
        assert (
            "found a file that is read here" in capsys.readouterr().err
            and own.read_bytes() == before
        )


@pytest.mark.parametrize(
    ("trials", "chosen"),
    [({"a": 1, "b": 3}, "b"), ({"a": 2, "b": 3}, "a"), ({"a": 1, "b": 1}, "b")],
)
def test_the_gate_runs_a_log_of_which_something_was_set_aside(trials, chosen):
    from types import SimpleNamespace

    from epa_rt.cli.gap.diagnose import _shortest
    from epa_rt.gap.recording import Recording, Span

    logs = [
        Recording(
            name,
            "",
            "rig",
            "",
            "",
            0.01,
            np.arange(300 * count),
            {"x_m": np.zeros(300 * count)},
            tuple(Span(f"trial {k}", 300 * k, 300 * (k + 1), True) for k in range(count)),
        )
        for name, count in trials.items()
    ]
    assert _shortest(SimpleNamespace(holdout=(), recordings=tuple(logs))).name == chosen
    assert _shortest(SimpleNamespace(holdout=tuple(logs), recordings=())).name == "a"


def test_the_gate_judges_those_trials_alone_that_were_set_aside():
    from types import SimpleNamespace

    from epa_rt.cli.gap.diagnose import _aside
    from tests.gap.damper import Damper, recorded

    log, other = recorded({}, "a"), recorded({}, "b")
    assert [
        span.trial
        for span in _aside(
            SimpleNamespace(subject=Damper(), holdout=(), recordings=(log,)), log
        ).spans
    ] == [False, False, True]
    assert (
        _aside(SimpleNamespace(subject=Damper(), holdout=(other,), recordings=(log,)), other)
        is None
    )


def test_a_turned_sign_on_a_rig_of_others_is_said_first(tmp_path, capsys):
    log = imported_carriage(tmp_path, "-1")
    capsys.readouterr()
    assert (
        main(
            [
                "gap",
                "localise",
                "--rig",
                str(ROOT / "config/rigs_foreign/emps.yaml"),
                str(log),
                "--quiet",
            ]
        )
        == 0
    )
    assert (
        "motor_force_n: found a correlation of -1.00 with what the plant file makes of the other"
        " channels" in capsys.readouterr().out
    )


def test_an_unknown_effect_to_leave_out_is_pointed_at_its_own_catalogue(tmp_path, capsys):
    log = imported_carriage(tmp_path, "1")
    capsys.readouterr()
    said = refused(
        capsys,
        "diagnose",
        "--rig",
        ROOT / "config/rigs_foreign/emps.yaml",
        log,
        "--leave-out",
        "colomb",
    )
    assert (
        "found 'colomb', expected an effect of this rig's catalogue (coulomb" in said
        and "epa gap catalogue --kind carriage)" in said
    )


def test_a_log_too_short_for_the_filters_of_a_rig_of_others(tmp_path, capsys):
    log = imported_carriage(tmp_path, "1", rows=14)
    capsys.readouterr()
    assert "found 14 rows, expected" in refused(
        capsys, "localise", "--rig", ROOT / "config/rigs_foreign/emps.yaml", log
    )


def test_a_column_that_its_kind_can_do_without_may_lack():
    """The servo's kind has channels that no log of the SO-101 has."""
    from types import SimpleNamespace

    from epa_rt.cli.gap.fits import check_columns
    from epa_rt.gap.rig.subjects import open_subject

    subject = open_subject(ROOT / "config/rigs_foreign/so101_elbow.yaml")
    needed = [
        subject.rig.channels[channel.role]
        for channel in subject.rig.component.channels
        if channel.required
    ]
    assert 0 < len(needed) < len(subject.rig.channels)
    check_columns(
        subject,
        RIG,
        [
            SimpleNamespace(
                rig=subject.name, path="a.mcap", period_s=0.02, columns=dict.fromkeys(needed)
            )
        ],
    )


def test_a_folder_that_takes_no_file_is_said_before_the_work(log, tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert "in which nothing can be written" in refused(
        capsys, "diagnose", "--rig", RIG, log, "--json", tmp_path / "file/deep/gap.json"
    )


@pytest.mark.parametrize("which", ["rig", "plant"])
def test_no_input_is_written_over(which, log, tmp_path, capsys):
    shutil.copy(PLANTS / "bench.yaml", tmp_path / "plant.yaml")
    shutil.copy(RIG, tmp_path / "rig.yaml")
    before = (tmp_path / f"{which}.yaml").read_bytes()
    said = refused(
        capsys,
        "diagnose",
        "--rig",
        tmp_path / "rig.yaml",
        "--plant",
        tmp_path / "plant.yaml",
        log,
        "-o",
        tmp_path / f"{which}.yaml",
    )
    assert (
        "found a file that is read here" in said
        and (tmp_path / f"{which}.yaml").read_bytes() == before
    )


def test_an_answer_is_shown_although_its_file_cannot_be_written(
    log, tmp_path, capsys, monkeypatch, answered
):
    from epa_rt.cli.exits import VerbError
    from epa_rt.cli.gap import diagnose

    def full(*_):
        raise VerbError("gap.json: cannot be written (No space left on device)", 4)

    monkeypatch.setattr(diagnose, "write_answer", full)
    assert (
        main(
            [
                "gap",
                "diagnose",
                "--rig",
                str(RIG),
                str(log),
                "--json",
                str(tmp_path / "gap.json"),
                "--quiet",
            ]
        )
        == 4
    )
    found = capsys.readouterr()
    assert "Nothing is left beyond the noise floor." in found.out and "No space left" in found.err


def test_a_patch_of_before_is_not_said_to_be_written(log, tmp_path, capsys, answered):
    (tmp_path / "old.yaml").write_text("# by 'epa gap patch'\nplant: old\n")
    assert (
        main(
            [
                "gap",
                "diagnose",
                "--rig",
                str(RIG),
                str(log),
                "-o",
                str(tmp_path / "old.yaml"),
                "--quiet",
            ]
        )
        == 0
    )
    said = " ".join(capsys.readouterr().out.split())
    assert "not written, no effect is named; the file of that name is older" in said


@pytest.mark.parametrize("task", ["diagnose", "localise"])
def test_logs_on_which_no_block_can_be_judged_are_not_called_free_of_a_gap(
    task, log, capsys, monkeypatch
):
    from epa_rt.gap.rig import read
    from tests.gap.recorded import rows_left

    whole = read.read_recording
    monkeypatch.setattr(
        read,
        "read_recording",
        lambda path: rows_left(one := whole(path), one.cycle < one.cycle[0] + 50),
    )
    assert (
        "found no stretch of these logs on which a block of the rig bench can be judged"
        in refused(capsys, task, "--rig", RIG, log)
    )

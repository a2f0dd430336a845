from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import epa_rt as epa
from epa_rt.logs.reader import LogReader
from tests.cli.shell import RIGS, ROOT
from tests.runs.conftest import SHORT


def test_importing_loads_nothing_and_names_are_there():
    code = (
        "import sys, epa_rt as epa; before = set(sys.modules); names = dir(epa);"
        "assert not before & {'numpy', 'scipy', 'pandas', 'epa_rt.api'}, before;"
        "assert {'open', 'simulate', 'diagnose', 'identify', 'compare', 'ls'} <= set(names);"
        "assert not hasattr(epa, 'nothing')"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_a_log_gives_what_the_reader_reads(logs):
    log = epa.open(logs["first"])
    with LogReader(logs["first"]) as reader:
        columns, events = reader.columns("/measured"), reader.events()
        t_ns = reader.columns("/cycle", ["t_ns"])["t_ns"]
    for name, values in columns.items():
        assert np.array_equal(np.asarray(log[name]), values, equal_nan=True)
    assert np.array_equal(log.t_s, (t_ns - t_ns[0]) / 1e9)
    force = log["muscle_force_n"]
    assert force.unit == "N" and len(force) == len(force.t_s) == len(log.t_s)
    assert log.events == events and log.outcome == "completed" and log.missing == []
    assert log.rig.name == "bench" and log.experiment.name == "short"
    assert log.record.operator == "Ada" and log.period_s == 0.001
    assert set(log.signals) >= {"cmd_motor_speed_m_s", "est_muscle_pressure_pa"}


def test_a_trial_is_a_stretch_of_the_log(logs):
    log = epa.open(logs["first"])
    trial = log.trial(1)
    assert log.trials == (trial,) and trial.number == 1
    assert trial.duration_s == pytest.approx(4.0)
    begin = np.searchsorted(log.t_s, trial.t_s[0])
    part = slice(begin, begin + len(trial.t_s))
    assert np.array_equal(trial["muscle_force_n"].values, log["muscle_force_n"].values[part])
    table = log.to_pandas("muscle_*")
    assert table.attrs["units"]["muscle_pressure_pa"] == "Pa"
    inside = table[table.trial == 1].reset_index(drop=True)
    assert inside.equals(trial.to_pandas("muscle_*"))
    assert [phase.name for phase in log.phases] == ["go_to_no_load", "fill", "trial", "vent"]


def test_a_cut_log_gives_what_is_left_of_it(logs, tmp_path):
    data = logs["first"].read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: len(data) // 2])
    log = epa.open(path)
    assert log.missing and 0 < len(log.t_s) < 11_000
    assert len(log.to_pandas()) == len(log.t_s)
    assert epa.ls(tmp_path)[0].outcome == "damaged"
    with pytest.raises(epa.EpaError, match="found nothing there"):
        epa.ls(tmp_path / "nowhere")


def test_what_cannot_be_used_is_a_sentence(logs, tmp_path):
    log = epa.open(logs["first"])
    text = tmp_path / "text.mcap"
    text.write_text("no log")
    bench = RIGS / "bench.yaml"
    for use, words in (
        (lambda: epa.open(text), "expected an MCAP log"),
        (lambda: log.trial(2), "found no trial 2, expected 1 to 1"),
        (lambda: log.to_pandas("knee*"), "found no signal 'knee*'"),
        (lambda: epa.compare(log, text), "expected an MCAP log"),
        (lambda: epa.simulate(bench, bench, out=tmp_path / "x"), "bench.yaml:"),
        (lambda: epa.identify(log.path, holdout="some"), "holdout: found 'some'"),
        (lambda: epa.identify(log.path, log.path), "twice"),
        (lambda: epa.diagnose(text, rig=bench), "expected an MCAP log"),
        (lambda: epa.diagnose(log.path, rig=bench, leave_out=["friend"]), "found 'friend'"),
    ):
        with pytest.raises(epa.EpaError) as refused:
            use()
        assert words in str(refused.value)
    with pytest.raises(KeyError, match="muscle_force_n"):
        log["knee"]
    assert not (tmp_path / "x").exists()


def test_a_simulation_is_the_run_of_the_verb(logs, tmp_path):
    experiment = tmp_path / "short.yaml"
    experiment.write_text(SHORT)
    log = epa.simulate(experiment, RIGS / "bench.yaml", out=tmp_path / "a.mcap", notes=["mine"])
    assert log.record.notes == ("mine",)
    assert epa.compare(logs["first"], log).identical
    with pytest.raises(epa.EpaError, match="expected a name that is free"):
        epa.simulate(experiment, RIGS / "bench.yaml", out=tmp_path / "a.mcap")


def test_identify_is_a_verb_although_a_room_has_its_name(logs):
    import epa_rt.identify.data  # sets the attribute to the room

    assert epa_rt.identify.data.IdentifyError
    found = epa.identify(logs["first"], physical=False, terms=False, holdout="none")
    assert max(score.r2 for score in found.answer.scores) > 0.9
    assert found.as_json()["models"] and "<html" in found.page()[:200]


def test_a_diagnosis_is_the_answer_behind_its_page(logs):
    """With two effects left in the catalogue, so that it is short."""
    from epa_rt.cli.gap.inputs import open_rig

    bench = RIGS / "bench.yaml"
    effects = [effect.name for effect in open_rig(bench, None)[0].catalogue]
    stages = []
    found = epa.diagnose(
        logs["leaking"],
        rig=bench,
        leave_out=[name for name in effects if name not in ("leak", "creep")],
        gate=False,
        progress=lambda stage, share: stages.append(stage),
    )
    assert found.as_json()["verdict"] == found.answer.verdict and stages
    assert "<html" in found.page()[:200]
    if found.answer.effects:
        assert "leak" in found.patched_plant()
    else:
        with pytest.raises(epa.EpaError, match="no effect that is named"):
            found.patched_plant()

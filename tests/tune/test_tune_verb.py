"""epa tune as an operator meets it: an excitation of its own, its answer, and logs that say
nothing.
"""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from epa_rt.cli.inputs import load_inputs
from epa_rt.cli.main import main
from epa_rt.config.rig import load_rig
from epa_rt.gap.rig.read import read_recording
from epa_rt.logs.reader import LogReader
from epa_rt.loop.end_state import EndState
from epa_rt.loop.run import RunResult
from epa_rt.tune.answer import tuned
from epa_rt.tune.controller import TuneError, loop_of, written_gains
from epa_rt.tune.evidence import evidence_of
from epa_rt.tune.report.terminal import text_of

RIG, EXPERIMENT = "config/rigs/bench.yaml", "config/experiments/identification_short.yaml"

LOUD = 150.0  # 1/s: beyond what this drive's delay stands


def epa(*words: object) -> int:
    return main([str(word) for word in words])


@pytest.fixture(scope="module")
def excited(tmp_path_factory):
    """A log of the motor's excitation, and the folder with the answer that came of it."""
    folder = tmp_path_factory.mktemp("tune")
    words = ("tune", "motor", "--rig", RIG, "--experiment", EXPERIMENT, "-o", folder, "--quiet")
    code = epa(*words, "--json", folder / "a.json", "--html", folder / "a.html",
               "--write", folder / "new.yaml", "--operator", "ada", "--note", "stiff")  # fmt: skip
    assert code == 0
    with LogReader(next(folder.glob("*.mcap"))) as reader:
        record = json.loads(reader.attachments["record.json"])
        assert (record["operator"], record["notes"]) == ("ada", ["stiff"])
    (log,) = folder.glob("*.mcap")
    return log


@pytest.fixture(scope="module")
def recording(excited):
    return read_recording(excited)


def test_the_answer_holds_its_bounds_and_is_written(excited):
    answer = json.loads((excited.parent / "a.json").read_text())
    assert answer["decision"] == "change"
    assert answer["proposed"]["margins"]["worst_peak"] <= 1.6
    assert answer["proposed"]["trial_rms"] < answer["present"]["trial_rms"]
    assert min(answer["response"]["coherence"]) >= 0.0
    new = (excited.parent / "new.yaml").read_text()
    assert f"position_gain: {answer['proposed']['gains']['position_gain']}\n" in new
    page = (excited.parent / "a.html").read_text()
    assert "Nyquist" in page and "coherence" in page


def test_the_log_replays_and_gives_the_same_answer_in_80_columns(excited, capsys):
    assert epa("replay", excited) == 0
    capsys.readouterr()
    assert epa("tune", "motor", excited, "--experiment", EXPERIMENT, "--quiet") == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    answer = json.loads((excited.parent / "a.json").read_text())
    assert answer["proposed"]["gains"]["position_gain"] in text


def test_nothing_is_written_over(excited, capsys):
    assert epa("tune", "motor", excited, "--write", RIG, "--quiet") == 2
    assert "expected a name that is free" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words, said",
    [
        (("joint", "--rig", RIG), "without a joint"),
        (("motor",), "neither a log nor --rig"),
        (("motor", "--rig", RIG), "no pressure for muscle"),
        (("motor", "--rig", RIG, "--fill", "muscle", "3 bar"), "expected a pressure that says"),
        (("motor", "--rig", RIG, "--fill", "mussel", "3 bar gauge"), "has not"),
        (("motor", "--rig", RIG, "--fill", "muscle", "3 bar gauge", "--at", "1 m"), "limits"),
        (("motor", "--rig", RIG, "--experiment", "config/experiments/step.yaml"), "loop"),
        (("motor", "--rig", RIG, "--experiment", RIG), "unknown key 'rig'"),
        (("motor", "README.md"), "expected an MCAP log"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)
def test_what_cannot_be_tuned_is_refused_in_one_sentence(words, said, capsys):
    assert epa("tune", *words, "--dry" if "--rig" in words else "--quiet") == 2
    error = capsys.readouterr().err
    assert said in error and "Traceback" not in error


def test_an_excitation_that_leaves_air_says_so_last_and_gives_no_answer(tmp_path, capsys):
    words = ("tune", "motor", "--rig", RIG, "--experiment", EXPERIMENT, "-o", tmp_path, "--quiet")
    log = SimpleNamespace(path="absent.mcap", samples=1, events=0, failure=None, size_bytes=1)
    left = EndState({}, {"muscle_pressure_pa": 5e5}, None, True, False, True, "current", True, {})
    ran = RunResult("completed", "", 1, True, 0, 0, end=left)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("epa_rt.cli.run.run_simulated", lambda *_, **__: (log, ran))
        patch.setattr("epa_rt.cli.inputs.load_inputs", _unprotected(load_inputs))
        assert epa(*words) == 20
    said = capsys.readouterr()
    assert "NOT vented" in said.out and "UNPROTECTED: no force" in said.err


def _unprotected(load):
    return lambda *given, **named: replace(load(*given, **named), unprotected=("no force",))


@pytest.fixture(scope="module")
def loud(recording):
    """The recording's rig with a gain that breaks the bound of Ms on its response."""
    rig = load_rig(RIG)
    loop = loop_of(rig, "motor")
    return written_gains(rig, loop, replace(loop.gains, kp=LOUD))


def test_kept_gains_that_break_the_bound_are_warned_of(recording, loud):
    answer = tuned([recording], loud, "motor", None)
    assert answer.present.margins.worst_peak > 1.6
    assert (answer.warning is not None) == answer.proposal.keep
    for merit in ("tracking", "load"):  # what is proposed instead does neither worse
        assert getattr(answer.after.merit, merit) <= getattr(answer.present.merit, merit)
    if answer.proposal.keep:
        assert f"warning: {answer.warning}" in " ".join(text_of(answer).split())


def test_where_the_margin_costs_tracking_both_sets_are_shown(recording, loud):
    kept, held = (
        tuned([recording], loud, "motor", None, hold_margin=asked) for asked in (False, True)
    )
    assert kept.proposal.keep and not held.proposal.keep
    assert kept.holding is not None and held.holding is None
    assert kept.holding.gains == held.after.gains
    assert held.after.margins.worst_peak <= 1.6 and held.after.gains.kp <= LOUD
    said, shown = kept.warning or "", " ".join(text_of(kept).split())
    cost = held.after.merit.tracking / kept.present.merit.tracking
    assert cost > 1.0 and f"costs {100 * (cost - 1):.0f} % of tracking" in said
    for words in (said, "margin held", f"{held.after.gains.kp:g} 1/s", "--hold-margin"):
        assert words in shown, words
    assert "was asked for, and costs" in " ".join(text_of(held).split())


def refusal(recording) -> str:
    rig = load_rig(RIG)
    with pytest.raises(TuneError) as refused:
        evidence_of([recording], rig, loop_of(rig, "motor"))
    return str(refused.value)


def test_logs_that_say_nothing_are_named_for_what_they_are(recording):
    spans = tuple(replace(span, trial=False) for span in recording.spans)
    assert "no trial in the loop motor_speed" in refusal(replace(recording, spans=spans))
    trip = (*recording.found, "trip at 3.000 s: limit: motor_travel_m")
    assert "found a trip at 3.000 s" in refusal(replace(recording, found=trip))
    assert "of the rig 'knee'" in refusal(replace(recording, rig="knee"))
    assert "a period of 2 ms" in refusal(replace(recording, period_s=2e-3))
    short = tuple(replace(span, stop=min(span.stop, span.start + 900)) for span in recording.spans)
    assert "trials of at most 0.9 s" in refusal(replace(recording, spans=short))


def test_a_command_at_its_limit_and_a_dead_sensor_are_refused(recording):
    columns = dict(recording.columns)
    columns["cmd_motor_speed_m_s"] = np.full(recording.samples, 0.08)
    assert "at its limit in 100 %" in refusal(replace(recording, columns=columns))
    columns = dict(recording.columns)
    columns["motor_travel_m"] = np.zeros(recording.samples)
    assert "that never moves" in refusal(replace(recording, columns=columns))
    del columns["motor_travel_m"]
    assert "found no motor_travel_m" in refusal(replace(recording, columns=columns))


def test_readings_that_are_missing_only_cut_the_trial(recording):
    rig = load_rig(RIG)
    whole = evidence_of([recording], rig, loop_of(rig, "motor"))
    columns = dict(recording.columns)
    travel = columns["motor_travel_m"].copy()
    first = next(span for span in recording.spans if span.trial)
    travel[first.start + 5000] = np.nan
    columns["motor_travel_m"] = travel
    cut = evidence_of([replace(recording, columns=columns)], rig, loop_of(rig, "motor"))
    assert len(cut.trials) == len(whole.trials) + 1
    assert cut.seconds >= whole.seconds - 0.01

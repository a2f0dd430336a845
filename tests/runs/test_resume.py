"""A run that was broken off goes on where it stopped, and both logs are one data set."""

import json
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.inputs import read
from epa_rt.cli.replay import replay_log
from epa_rt.cli.resume import resumed_inputs
from epa_rt.config.rig import load_rig
from epa_rt.config.source import ConfigError
from epa_rt.experiments.experiment import experiment_from_text, load_experiment
from epa_rt.gap.hygiene.check import check
from epa_rt.identify.data import normalisation, pressures, trials
from epa_rt.identify.linear import scaled, sums
from epa_rt.identify.models import BY_NAME, POLYNOMIAL
from epa_rt.identify.scores import score
from epa_rt.logs.reader import LogReader
from epa_rt.runs.resume import ATTACHMENT
from tests.runs.series import RIG, ROOT, SHORT, cut, experiment_file, inputs_of, run

IDENTIFICATION = ROOT / "config/experiments/identification.yaml"


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(experiment file, log of the run that was let go)."""
    folder = tmp_path_factory.mktemp("whole")
    path = experiment_file(folder)
    assert run(inputs_of(path), folder / "whole.mcap").outcome == "completed"
    return path, folder / "whole.mcap"


def fit(logs, plant):
    """Polynomial of the trials of some logs: names, coefficients and intervals."""
    found = trials(read(logs, load_rig(RIG)), load_rig(RIG), plant.params)
    norm = normalisation(plant.params)
    muscle = plant.params["muscle"][0, 0]
    shape = float(muscle["braid_length_m"]), float(muscle["braid_turns_ratio"])
    model = BY_NAME[POLYNOMIAL]
    data = sums(model, [scaled(trial, norm, *shape) for trial in found], found[0].period_s)
    judged = score(model, data, pressures(found), norm, "none")[1]
    return sorted(trial.name for trial in found), judged


@settings(max_examples=7, deadline=None)
@given(first=st.integers(1, 6))
def test_what_is_left_is_what_the_whole_run_would_have_done(first):
    rig, text = load_rig(RIG), IDENTIFICATION.read_text()
    all_phases = load_experiment(IDENTIFICATION, rig).phases
    left = experiment_from_text(f"{text}\nfirst_repetition: {first}\n", "left.yaml", rig).phases
    expected = [phase for phase in all_phases if phase.repetition >= first]
    assert [p.name for p in left] == [p.name for p in expected]
    assert [p.trial_index for p in left] == [p.trial_index for p in expected]
    t_s = np.linspace(0.0, 20.0, 500)
    for one, other in zip(left, expected, strict=True):
        if one.trial_index is not None:
            for a, b in zip(
                one.profile(0.01).sample(t_s), other.profile(0.01).sample(t_s), strict=True
            ):
                assert np.array_equal(a, b)


@pytest.mark.parametrize(
    "share", [0.5, *(pytest.param(share, marks=pytest.mark.slow) for share in (0.2, 0.75))]
)
def test_a_cut_run_goes_on_and_gives_the_same_fit_within_its_intervals(share, whole, tmp_path):
    path, log = whole
    inputs = inputs_of(path)
    first = cut(log, tmp_path / "first.mcap", share)
    left = resumed_inputs(inputs, first, "sim")
    assert run(left, tmp_path / "second.mcap", seed=7).outcome == "completed"
    assert replay_log(tmp_path / "second.mcap") == 0
    names, judged = fit([log], inputs.plant)
    again_names, again = fit([first, tmp_path / "second.mcap"], inputs.plant)
    assert again_names == names
    for key, value in judged.coefficients.items():
        low, high = again.intervals[key]
        assert low <= value <= high, key
        low, high = judged.intervals[key]
        assert low <= again.coefficients[key] <= high, key


def test_a_run_broken_off_twice_is_one_chain_and_a_missing_link_is_said(whole, tmp_path):
    path, log = whole
    inputs = inputs_of(path)
    first = cut(log, tmp_path / "first.mcap", 0.4)
    run(resumed_inputs(inputs, first, "sim"), tmp_path / "long.mcap")
    second = cut(tmp_path / "long.mcap", tmp_path / "second.mcap", 0.6)
    left = resumed_inputs(inputs, second, "sim")
    assert [p.trial_index for p in left.experiment.trials] == [2]
    run(left, tmp_path / "third.mcap")
    with LogReader(tmp_path / "third.mcap") as reader:
        chain = json.loads(reader.attachments[ATTACHMENT])["logs"]
    assert [one["name"] for one in chain] == ["first.mcap", "second.mcap"]
    assert [len(one["trials"]) for one in chain] == [1, 1]
    rig = load_rig(RIG)
    three = read([first, second, tmp_path / "third.mcap"], rig)
    assert [sum(span.trial for span in r.spans) for r in three] == [1, 1, 1]
    assert not [f.says for f in check(three, rig) if f.severity == "refuse"], "a diagnosis takes it"
    two = read([second, tmp_path / "third.mcap"], rig)
    assert any("first.mcap, which is not among these logs" in s for s in two[1].found)


def test_nothing_is_left_of_a_whole_log(whole, capsys):
    path, log = whole
    assert resumed_inputs(inputs_of(path), log, "sim") is None
    assert "all 3 trials are whole" in capsys.readouterr().out
    assert resumed_inputs(inputs_of(path), log, "sim", sys.stderr) is None
    assert not capsys.readouterr().out, "JSON stands alone there"


def test_other_files_or_another_backend_are_refused_and_comments_are_not(whole, tmp_path):
    path, log = whole
    first = cut(log, tmp_path / "first.mcap", 0.5)
    commented = experiment_file(tmp_path, SHORT + "# a remark\n")
    assert resumed_inputs(inputs_of(commented), first, "sim") is not None
    slower = experiment_file(tmp_path, SHORT.replace("50 mm/s", "40 mm/s"))
    with pytest.raises(VerbError, match="found another experiment file in the log"):
        resumed_inputs(inputs_of(slower), first, "sim")
    for folder in ("rigs", "plants"):
        (tmp_path / folder).mkdir()
    (tmp_path / "plants/bench.yaml").write_text((ROOT / "config/plants/bench.yaml").read_text())
    other = tmp_path / "rigs/bench.yaml"
    other.write_text(RIG.read_text().replace("101.325 kPa abs", "100.9 kPa abs"))
    with pytest.raises(VerbError, match="found another rig file in the log"):
        resumed_inputs(inputs_of(path, other), first, "sim")
    with pytest.raises(VerbError, match="log of the backend 'sim', expected 'ethercat'"):
        resumed_inputs(inputs_of(path), first, "ethercat")

    class Emulated(LogReader):
        """The log as an emulated bus would have left it."""

        def __init__(self, path):
            super().__init__(path)
            self.metadata["run"] |= {"backend": "ethercat", "bus": "emulated"}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("epa_rt.runs.resume.LogReader", Emulated)
        with pytest.raises(VerbError, match="log of the backend 'emulated', expected 'ethercat'"):
            resumed_inputs(inputs_of(path), first, "ethercat")
    with pytest.raises(VerbError, match="does not repeat"):
        once = SHORT.replace("repeat:\n  p0: [460 kPa gauge, 550 kPa gauge, 640 kPa gauge]\n", "")
        resumed_inputs(
            inputs_of(experiment_file(tmp_path, once.replace("$p0", "460 kPa gauge"))), first, "sim"
        )


@pytest.mark.parametrize("line", ["first_repetition: 3", "first_repetition: -1"])
def test_a_repetition_that_is_not_there_is_refused(line):
    with pytest.raises(ConfigError, match="first_repetition"):
        experiment_from_text(f"{SHORT}{line}\n", "three.yaml", load_rig(RIG))

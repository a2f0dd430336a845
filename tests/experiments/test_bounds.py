"""A run too long to plan or record is one sentence; a long one is shown in little memory."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from epa_rt.cli.main import main
from epa_rt.config.rig import load_rig
from epa_rt.config.source import ConfigError, parse_yaml
from epa_rt.experiments import dry
from epa_rt.experiments.experiment import experiment_from

ROOT = Path(__file__).resolve().parents[2]
BENCH = ROOT / "config/rigs/bench.yaml"
RIG = load_rig(BENCH)
CASES = ROOT.parent / "shared/cases/experiments"
MEAN = "{name: mean, move: {to: 13 mm, speed: 20 mm/s}}"
WAVE = "mean: 13 mm, peak_to_peak: 4 mm"


def read(phase: str, more: str = ""):
    head = f"experiment: long\nloop: motor_speed\n{more}\nphases:\n"
    text = f"{head}  - {MEAN}\n  - {{name: trial, {phase}}}\n"
    return experiment_from(parse_yaml(text, "long.yaml"), RIG)


RANDOM = "random_speed: {between: [2 mm, 20 mm], speed: 30 mm/s, dwell: [X, X]}, for: 1 h"


@pytest.mark.parametrize(
    ("phase", "more", "where", "found"),
    [
        ("for: 1e6 s", "", "for", "'1e6 s'"),
        ("for: 24.1 h", "", "for", "'24.1 h'"),
        ("for: 13 h", "times: 2", "for", "a run of 936"),
        ("until: valves_settled, timeout: 25 h", "", "timeout", "'25 h'"),
        ("for: 1 s", "times: 5001", "times", "10002 phases"),
        ("move: {to: 2 mm, speed: 1e-8 mm/s}", "", "", "a run of"),
        (f"multisine: {{{WAVE}, from: 0.2 Hz, to: 2 Hz, period: 1e7 s}}, for: 60 s", "",
         "multisine.period", "2e+07 waves"),
        (f"sine: {{{WAVE}, frequency: 5 Hz}}, for: 23 h", "", "sine", "455400 waves"),
        (f"chirp: {{{WAVE}, from: 1 Hz, to: 2 Hz, fade: 1 us}}, for: 60 s", "", "chirp", "waves"),
        (RANDOM.replace("X", "10 ms"), "", "random_speed.dwell", "360000 speeds"),
        (RANDOM.replace("X", "50 ms"), "times: 9", "", "pieces"),
    ],
)  # fmt: skip
def test_too_long_or_too_large_is_one_sentence(phase, more, where, found):
    with pytest.raises(ConfigError) as caught:
        read(phase, more)
    assert caught.value.where.endswith(where) and found in str(caught.value), caught.value


def test_a_day_is_not_too_long():
    assert read("for: 23.9 h").duration_s > 86_000.0


def test_a_long_dry_run_keeps_its_figures_and_little_memory():
    experiment = read(f"sine: {{{WAVE}, frequency: 0.5 Hz}}, for: 2 h")
    tracemalloc.start()
    found = dry.dry_run(experiment, RIG)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 150e6
    trial = found.phases[-1]
    assert trial.t_s.size <= dry.MOST_KEPT + 2 and (np.diff(trial.t_s) > 0.0).all()
    assert trial.low == trial.positions.min() and trial.high == trial.positions.max()
    assert trial.high == pytest.approx(0.015, abs=1e-9) and trial.low == pytest.approx(0.011)
    assert trial.speed_peak == pytest.approx(np.pi * 0.002, rel=1e-4)


@pytest.mark.parametrize("kept", [7, 100, 999, 1000])
def test_ends_of_stretches_are_the_extremes(kept, monkeypatch):
    """Against the samples themselves, whatever the number of stretches."""
    experiment = read(f"sine: {{{WAVE}, frequency: 3 Hz, fade: 0.2 s}}, for: 1 s")
    phase = experiment.phases[-1]
    monkeypatch.setattr(dry, "AT_ONCE", 300)
    whole = dry._sampled(phase, phase.profile(0.013), 2.0, 1e-3, 10_000)
    few = dry._sampled(phase, phase.profile(0.013), 2.0, 1e-3, kept)
    assert few.t_s.size <= 2 * kept + 2
    assert (few.low, few.high, few.speed_peak) == (whole.low, whole.high, whole.speed_peak)
    assert few.positions.min() == whole.low and few.positions.max() == whole.high
    assert set(zip(few.t_s, few.positions, strict=True)) <= set(
        zip(whole.t_s, whole.positions, strict=True)
    )


@pytest.mark.skipif(not CASES.is_dir(), reason="the shared inputs are not beside this repository")
@pytest.mark.parametrize("name", ["big_multisine_1e7", "big_trial_1e6s"])
@pytest.mark.parametrize("verb", ["check", "run"])
def test_the_shared_inputs(name, verb, tmp_path, capsys):
    words = [verb, str(CASES / f"{name}.yaml"), "--rig", str(BENCH)]
    assert main(words + (["--dry", "-o", str(tmp_path)] if verb == "run" else [])) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and ": found " in said and ", expected at most " in said

"""Experiment files: the delivered ones load on their rigs; broken ones are answered by one sentence
with file and line.
"""

import json
import re

import pytest
from experiment_rigs import ROOT, rig, written

from epa_rt.config.experiment import ExperimentFile
from epa_rt.config.source import ConfigError
from epa_rt.experiments.dry import dry_run
from epa_rt.experiments.experiment import load_experiment

DELIVERED = sorted((ROOT / "config/experiments").glob("*.yaml"))
ON_RIGS = [
    (path, on)
    for path in DELIVERED
    for on in (
        ("knee",)
        if "knee" in path.stem
        else ("mass",)
        if "mass" in path.stem
        else ("bench", "bench_analog")
    )
]


@pytest.mark.parametrize("path,on", ON_RIGS, ids=lambda value: getattr(value, "stem", value))
def test_delivered_experiments_load_and_stay_within_their_rigs(path, on):
    experiment = load_experiment(path, rig(on))
    dry = dry_run(experiment, rig(on))
    assert experiment.name == path.stem
    assert dry.findings == ()
    assert len(experiment.trials) >= 1
    assert dry.duration_s == pytest.approx(
        experiment.duration_s, abs=0.01 * len(experiment.phases) + 3.0
    )
    # a drive keeps one mode through a run
    targets = {"motor_position": "position", "joint_angle": "position"}
    assert len({targets.get(loop, loop) for loop in experiment.loops}) == 1


def test_the_knee_chirp_is_what_was_asked():
    experiment = load_experiment(ROOT / "config/experiments/knee_chirp.yaml", rig("knee"))
    dry = dry_run(experiment, rig("knee"))
    trial = next(p for p in dry.phases if p.phase.key == "trial")
    assert trial.duration_s == 300.0 and trial.t_s.size == 300_000
    assert (trial.high - trial.low) * 57.29577951308232 == pytest.approx(10.0, abs=1e-3)


def test_the_schema_for_editors_is_json_and_knows_the_words_of_the_file():
    schema = json.dumps(ExperimentFile.model_json_schema(by_alias=True))
    for word in ('"for"', '"from"', '"random_speed"', '"hold_and_trim"', '"valves_settled"'):
        assert word in schema


def test_labels_and_values():
    text = BASE.replace("phases:", "repeat: {p0: [100 kPa gauge, 200 kPa gauge]}\nphases:").replace(
        "300 kPa gauge", "$p0"
    )
    experiment = written(text)
    assert experiment.phase_names[:2] == ("go[0] p0=100 kPa gauge", "fill[0] p0=100 kPa gauge")
    assert [p.values for p in experiment.trials] == [
        {"p0": "100 kPa gauge"},
        {"p0": "200 kPa gauge"},
    ]
    assert experiment.loops == ("motor_speed",)


BASE = """experiment: test
loop: motor_speed
phases:
  - {name: go, move: {to: no_load, speed: 20 mm/s}}
  - {name: fill, valves: {all: {set: 300 kPa gauge}}, until: valves_settled, timeout: 60 s}
  - name: trial
    trial: true
    random_speed: {between: [1 mm, 27 mm], speed: 50 mm/s, dwell: [100 ms, 800 ms]}
    for: 10 s
    valves: {all: hold}
"""

SINE = (
    "random_speed: {between: [1 mm, 27 mm], speed: 50 mm/s, dwell: [100 ms, 800 ms]}",
    "sine: {mean: 0 mm, peak_to_peak: 4 mm, frequency: 1 Hz, fade: 1 s}",
)
MULTI = (
    SINE[0],
    (
        "multisine: {mean: 0 mm, peak_to_peak: 4 mm, from: 0.2 Hz, to: 2 Hz, lines: 8, period: 20"
        " s, fade: 1 s}"
    ),
)
STEP = (SINE[0] + "\n    for: 10 s", "step: {levels: [5 mm, 0 mm], rise: 300 ms, dwell: 1 s}")

# (what is changed, line, found, expected)
BROKEN = {
    "unknown phase key": (
        [("timeout:", "time_out:")],
        5,
        "an unknown key 'time_out'",
        "only keys that the schema knows",
    ),
    "unknown motion key": (
        [("speed: 50", "velocity: 50")],
        8,
        "an unknown key 'velocity'",
        "only keys",
    ),
    "unknown top key": (
        [("loop: motor_speed", "loop: motor_speed\nrepeats: 3")],
        3,
        "an unknown key 'repeats'",
        "only keys",
    ),
    "unknown place": (
        [("no_load", "slack")],
        4,
        "the place 'slack'",
        "a place of this rig: no_load, stretched",
    ),
    "unknown muscle": (
        [("all: {set", "spam: {set")],
        5,
        "the muscle 'spam'",
        "all or one of this rig's: muscle",
    ),
    "undefined name": ([("300 kPa gauge", "$p0")], 5, "'$p0', which nothing defines", "'repeat'"),
    "misspelt name": (
        [("phases:", "repeat: {p0: [300 kPa gauge]}\nphases:"), ("300 kPa gauge}}", "$p1}}")],
        3,
        "'p0', which no phase uses",
        "$p0",
    ),
    "pressure without reference": (
        [("300 kPa gauge", "300 kPa")],
        5,
        "'300 kPa'",
        "gauge' or '... kPa abs'",
    ),
    "repeated pressure without reference": (
        [("phases:", "repeat: {p0: [300 kPa]}\nphases:"), ("300 kPa gauge}}", "$p0}}")],
        6,
        "'300 kPa' for $p0",
        "gauge",
    ),
    "pressure above the muscle's": (
        [("300 kPa", "800 kPa")],
        5,
        "'800 kPa gauge'",
        "101.325 to below 881.325 kPa abs",
    ),
    "pressure below the atmosphere": (
        [("300 kPa gauge", "50 kPa abs")],
        5,
        "'50 kPa abs'",
        "101.325 to below",
    ),
    "position without unit": ([("to: no_load", "to: 3")], 4, "'3' without a unit", "a unit like m"),
    "position in degrees": ([("to: no_load", "to: 3 deg")], 4, "'3 deg'", "a quantity in m"),
    "position outside limits": ([("27 mm", "32 mm")], 8, "'32 mm'", "-10 mm to 31 mm"),
    "range upside down": (
        [("[1 mm, 27 mm]", "[27 mm, 1 mm]")],
        8,
        "['27 mm', '1 mm']",
        "the lower position before",
    ),
    "range too narrow": ([("[1 mm, 27 mm]", "[1 mm, 2 mm]")], 8, "a range of 1 mm", "5 mm"),
    "three ends of a range": ([("[1 mm, 27 mm]", "[1 mm, 2 mm, 27 mm]")], 8, "a list", "at most 2"),
    "speed beyond the rig": ([("speed: 20 mm/s", "speed: 2 m/s")], 4, "'2 m/s'", "70 mm/s"),
    "speed with a wrong unit": ([("speed: 20 mm/s", "speed: 20 mm")], 4, "'20 mm'", "m/s"),
    "negative speed": ([("speed: 20 mm/s", "speed: -20 mm/s")], 4, "'-20 mm/s'", "above zero"),
    "acceleration beyond the rig": (
        [("speed: 20 mm/s", "speed: 20 mm/s, acceleration: 5 m/s^2")],
        4,
        "'5 m/s^2'",
        "2000 mm/s^2",
    ),
    "a loop of another rig": (
        [("loop: motor_speed", "loop: joint_angle")],
        2,
        "the loop 'joint_angle'",
        "motor_position, motor_speed, motor_torque",
    ),
    "no such loop": ([("loop: motor_speed", "loop: motor")], 2, "'motor'", "'motor_position'"),
    "a phase's loop": (
        [("name: go,", "name: go, loop: joint_angle,")],
        4,
        "the loop 'joint_angle'",
        "'bench' can do",
    ),
    "negative duration": ([("for: 10 s", "for: -10 s")], 9, "'-10 s'", "above zero"),
    "duration under a cycle": (
        [("for: 10 s", "for: 0.1 ms")],
        9,
        "'0.1 ms'",
        "at least one cycle of 1 ms",
    ),
    "duration in mm": ([("for: 10 s", "for: 10 mm")], 9, "'10 mm'", "a quantity in s"),
    "motion without an end": (
        [("    for: 10 s\n", "")],
        8,
        "a random_speed without 'for'",
        "'for: TIME'",
    ),
    "phase without an end": (
        [("move: {to: no_load, speed: 20 mm/s}", "valves: {all: close}")],
        4,
        "the phase 'go' without an end",
        "'for' or 'until'",
    ),
    "for beside a move": (
        [("speed: 20 mm/s}", "speed: 20 mm/s}, for: 2 s")],
        4,
        "'for' beside 'move'",
        "ends by itself",
    ),
    "until without timeout": ([(", timeout: 60 s", "")], 5, "'until' without a timeout", "timeout"),
    "timeout without until": (
        [("speed: 20 mm/s}", "speed: 20 mm/s}, timeout: 5 s")],
        4,
        "a timeout without 'until'",
        "until",
    ),
    "timeout before the end": (
        [("valves: {all: {set", "for: 90 s, valves: {all: {set")],
        5,
        "'60 s'",
        "more than the 90 s",
    ),
    "until nothing": ([("valves_settled", "settled")], 5, "'settled'", "valves_settled or"),
    "until half a condition": (
        [("valves_settled", "{signal: muscle_force_n}")],
        5,
        "a condition that is not whole",
        "below or above",
    ),
    "until an unknown signal": (
        [("valves_settled", "{signal: knee_force_n, below: 5 N}")],
        5,
        "the signal 'knee_force_n'",
        "muscle_force_n",
    ),
    "until a wrong unit": (
        [("valves_settled", "{signal: muscle_force_n, below: 5 mm}")],
        5,
        "'5 mm'",
        "N",
    ),
    "two motions": (
        [("    for: 10 s", "    move: {to: no_load, speed: 20 mm/s}\n    for: 10 s")],
        6,
        "move and random_speed in one phase",
        "one motion",
    ),
    "trial that sets": (
        [("valves: {all: hold}", "valves: {all: {set: 200 kPa gauge}}")],
        10,
        "'set' in a trial",
        "no valve switches during a trial",
    ),
    "trial that trims": (
        [("valves: {all: hold}", "valves: {muscle: hold_and_trim}")],
        10,
        "'hold_and_trim' in a trial",
        "hold",
    ),
    "trial while filling": (
        [("until: valves_settled, timeout: 60 s", "for: 1 s")],
        7,
        "a trial while 'fill' may still be setting",
        "valves_settled",
    ),
    "trim of nothing": (
        [("{set: 300 kPa gauge}", "hold_and_trim")],
        5,
        "'hold_and_trim' of the muscle muscle",
        "a phase before it",
    ),
    "unknown valve word": (
        [("all: hold", "all: keep")],
        10,
        "'keep'",
        "hold, hold_and_trim, vent, close or {set: PRESSURE}",
    ),
    "set without a pressure": (
        [("{set: 300 kPa gauge}", "{to: 300 kPa gauge}")],
        5,
        "{'to': '300 kPa gauge'}",
        "{set: PRESSURE}",
    ),
    "frequency beyond Nyquist/10": (
        [SINE, ("1 Hz", "80 Hz")],
        8,
        "'80 Hz'",
        "at most 50 Hz, a tenth of Nyquist",
    ),
    "frequency in mm": ([SINE, ("1 Hz", "1 mm")], 8, "'1 mm'", "Hz"),
    "wave too fast": ([SINE, ("1 Hz", "10 Hz")], 8, "a speed of up to", "70 mm/s"),
    "wave beyond the range": (
        [SINE, ("4 mm", "24 mm"), ("1 Hz", "0.1 Hz")],
        8,
        "positions from -12 mm to 12 mm",
        "-10 mm to 31 mm",
    ),
    "wave away from its mean": (
        [SINE, ("mean: 0 mm", "mean: 5 mm")],
        8,
        "a motion about 5 mm that starts at 0 mm",
        "a move to the mean",
    ),
    "wave without height": ([SINE, ("4 mm", "0 mm")], 8, "'0 mm'", "above zero"),
    "fade too long": (
        [SINE, ("fade: 1 s", "fade: 6 s")],
        8,
        "a fade that does not fit",
        "half of the duration",
    ),
    "lines that coincide": (
        [MULTI, ("period: 20 s", "period: 5 s")],
        8,
        "8 lines of which only",
        "a longer period",
    ),
    "band upside down": ([MULTI, ("to: 2 Hz", "to: 0.1 Hz")], 8, "'0.1 Hz'", "above 'from'"),
    "too steep a step": ([STEP, ("300 ms", "5 ms")], 8, "a speed of up to", "70 mm/s"),
    "no step": ([STEP, ("[5 mm, 0 mm]", "[]")], 8, "an empty list", "at least 1"),
    "motion from nowhere": (
        [("move: {to: no_load, speed: 20 mm/s}", "for: 1 s")],
        8,
        "a random_speed from a position that is not known",
        "a move before it",
    ),
    "a name twice": (
        [("name: fill", "name: go")],
        5,
        "the phase name 'go' a second time",
        "each name once",
    ),
    "a name with a space": ([("name: fill", "name: fill it")], 5, "'fill it'", "pattern"),
    "repeat of two lengths": (
        [
            ("phases:", "repeat: {p0: [1 kPa gauge], p1: [1 kPa gauge, 2 kPa gauge]}\nphases:"),
            ("300 kPa gauge", "$p0"),
            ("[100 ms", "[$p1"),
        ],
        3,
        "2 values",
        "as many as $p0 has, 1",
    ),
    "repeat beside times": (
        [("phases:", "times: 2\nrepeat: {p0: [1 kPa gauge]}\nphases:"), ("300 kPa gauge", "$p0")],
        3,
        "'times' beside 'repeat'",
        "one of the two",
    ),
    "no phases": (
        [(BASE[BASE.index("phases:") :], "phases: []\n")],
        3,
        "an empty list",
        "at least 1",
    ),
    "a key twice": (
        [("for: 10 s", "for: 10 s\n    for: 20 s")],
        10,
        "the key 'for' a second time",
        "each key once",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_answered_by_one_sentence(name):
    changes, line, found, expected = BROKEN[name]
    text = BASE
    for old, new in changes:
        assert old in text, f"the case '{name}' changes nothing"
        text = text.replace(old, new)
    with pytest.raises(ConfigError) as caught:
        written(text)
    sentence = str(caught.value)
    assert re.match(rf"test\.yaml:{line}: .*found .+, expected .+$", sentence), sentence
    assert "\n" not in sentence
    assert found in caught.value.found, sentence
    assert expected in caught.value.expected, sentence


def test_the_base_of_the_broken_files_is_sound():
    assert len(written(BASE).phases) == 3

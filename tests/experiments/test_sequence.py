"""The sequence on a rig that follows at once: order, counts, ends, time-outs, stops."""

import math

import numpy as np
import pytest
from experiment_rigs import ROOT, PerfectRun, rig, written

from epa_rt.experiments.experiment import load_experiment

HEAD = "experiment: test\nloop: motor_position\n"


def run_of(phases: str, on: str = "bench", head: str = HEAD, **kwargs) -> PerfectRun:
    return PerfectRun(written(head + "phases:\n" + phases, on), rig(on), **kwargs)


def starts(run: PerfectRun) -> list[dict]:
    return [data for kind, _, data in run.events if kind == "phase_start"]


def test_identification_runs_seven_trials_of_200_000_cycles_in_order():
    experiment = load_experiment(ROOT / "config/experiments/identification.yaml", rig("bench"))
    run = PerfectRun(experiment, rig("bench")).until_finished()
    assert run.sequence.failure is None
    begun = starts(run)
    assert [d["phase"] for d in begun] == list(experiment.phase_names)
    keys = ["go_to_no_load", "fill", "settle", "trim", "trial", "return", "vent"]
    assert [phase.key for phase in experiment.phases] == keys * 7
    ended = {data["phase"]: data for kind, _, data in run.events if kind == "phase_end"}
    trials = [d for d in begun if d["trial_index"] is not None]
    assert [d["trial_index"] for d in trials] == list(range(7))
    assert [d["values"]["p0"] for d in trials] == [f"{p} kPa gauge" for p in range(460, 641, 30)]
    assert [ended[d["phase"]]["cycle"] - d["cycle"] for d in trials] == [200_000] * 7
    assert trials[2]["targets"] == {"ref_muscle_pressure_pa": 520e3 + 101_325.0}


def test_valves_are_told_and_never_during_a_trial():
    run = PerfectRun(
        load_experiment(ROOT / "config/experiments/identification_short.yaml", rig("bench")),
        rig("bench"),
    )
    told_in_trial = []
    valve = run.valves["muscle"]
    while not run.sequence.finished:
        before = len(valve.told)
        run.step()
        if run.sequence.phase.trial_index is not None:
            told_in_trial += valve.told[before:]
            assert not valve.retrim
    assert told_in_trial == [("hold",)] * 2
    p0 = 460e3 + 101_325.0
    assert valve.told[:6] == [
        ("close",),
        ("set", p0),
        ("set", p0),
        ("hold",),
        ("vent",),
        ("set", 640e3 + 101_325.0),
    ]


@pytest.mark.parametrize("name", ["identification_short", "knee_chirp_short", "step", "mass_sine"])
def test_references_are_continuous_and_speed_is_their_derivative(name):
    on = "knee" if "knee" in name else "mass" if "mass" in name else "bench"
    experiment = load_experiment(ROOT / f"config/experiments/{name}.yaml", rig(on))
    run = PerfectRun(experiment, rig(on), start={"motor_travel_m": 0.004})
    rows = []
    while not run.sequence.finished:
        run.step()
        sequence = run.sequence
        rows.append(
            (
                sequence.loop_changed,
                run.reference[sequence.phase.coordinate.position_key],
                run.reference[sequence.phase.coordinate.speed_key],
                sequence.phase.coordinate.acceleration_max,
            )
        )
    changed, position, speed, acceleration = (
        np.array(column) for column in zip(*rows, strict=False)
    )
    assert position[0] == (0.004 if on == "bench" else position[0])
    # the trapezoid rule is off by at most half a period's change of speed
    step = position[1:] - position[:-1] - 0.5e-3 * (speed[1:] + speed[:-1])
    assert np.abs(step[~changed[1:]]).max() <= 0.5e-6 * acceleration.max()
    assert np.abs(np.diff(speed)[~changed[1:]]).max() <= 1e-3 * acceleration.max() * (1 + 1e-9)


def test_the_loop_changes_where_the_rig_is_and_only_the_active_coordinate_has_a_reference():
    run = PerfectRun(
        load_experiment(ROOT / "config/experiments/knee_chirp_short.yaml", rig("knee")),
        rig("knee"),
        start={"motor_travel_m": 0.002, "knee_angle_rad": -0.03},
    )
    changes = []
    while not run.sequence.finished:
        run.step()
        active = run.reference[run.sequence.phase.coordinate.position_key]
        other = "ref_motor_travel_m" if run.sequence.loop == "joint_angle" else "ref_knee_angle_rad"
        assert math.isfinite(active) and math.isnan(run.reference[other])
        if run.sequence.loop_changed:
            changes.append((run.sequence.loop, run.sequence.phase.key, active))
    assert [c[:2] for c in changes] == [
        ("motor_position", "go_to_no_load"),
        ("joint_angle", "go_to_mean"),
        ("motor_position", "return"),
    ]
    assert changes[0][2] == 0.002 and changes[1][2] == -0.03


def test_reference_names_are_known_before_the_start():
    names = run_of("  - {name: rest, for: 1 s}\n", "knee").sequence.reference_names
    assert names == (
        "ref_motor_travel_m",
        "ref_motor_speed_m_s",
        "ref_knee_angle_rad",
        "ref_knee_speed_rad_s",
        "ref_spam_pressure_pa",
        "ref_ppam_pressure_pa",
    )


def test_nothing_moves_at_the_start():
    run = run_of("  - {name: rest, for: 100 ms}\n", start={"motor_travel_m": 0.0123})
    run.until_finished()
    assert run.cycle == 101
    assert (run.reference["ref_motor_travel_m"], run.reference["ref_motor_speed_m_s"]) == (
        0.0123,
        0.0,
    )
    assert run.valves["muscle"].told == [("close",)] and not run.valves["muscle"].retrim


def test_valves_that_never_settle_time_out_with_a_sentence():
    run = run_of(
        "  - {name: fill, valves: {all: {set: 200 kPa gauge}}, until: valves_settled, timeout: 2"
        " s}\n",
        settle_cycles=10**9,
    )
    run.until_finished()
    assert run.sequence.failure == "fill: timed out after 2 s, waiting for valves settled"
    assert [kind for kind, _, _ in run.events] == ["phase_start", "failure", "brake", "finished"]
    assert run.valves["muscle"].told[-1] == ("hold",)


def test_a_signal_ends_a_phase_once_it_holds_steadily():
    run = run_of(
        "  - {name: relax, until: {signal: muscle_force_n, below: 5 N, steady: 10 ms}, timeout: 1"
        " s}\n",
        start={"muscle_force_n": 50.0},
    )
    for cycle in range(400):
        run.measured["muscle_force_n"] = (
            50.0 if cycle < 100 or cycle == 105 else float("nan") if cycle == 110 else 2.0
        )
        run.step()
        if run.sequence.finished:
            break
    assert run.sequence.failure is None and run.cycle == 121


def test_a_pressure_condition_reads_against_the_atmosphere():
    run = run_of(
        "  - {name: wait, until: {signal: muscle_pressure_pa, below: 10 kPa gauge}, timeout: 1"
        " s}\n",
        start={"muscle_pressure_pa": 115e3},
    )
    for _ in range(20):
        run.step()
    assert not run.sequence.finished
    run.measured["muscle_pressure_pa"] = 111e3
    run.step()
    run.step()
    assert run.sequence.finished and run.sequence.failure is None


@pytest.mark.parametrize("at_cycle", [0, 1, 700, 1300, 5000])
def test_brake_comes_to_rest_within_limits_and_finishes(at_cycle):
    run = run_of(
        "  - {name: go, move: {to: 1 mm, speed: 20 mm/s}}\n  - {name: trial, trial: true,"
        " random_speed: {between: [1 mm, 27 mm], speed: 50 mm/s}, for: 20 s}\n"
    )
    for _ in range(at_cycle):
        run.last_speed = run.reference["ref_motor_speed_m_s"]
        run.step()
    before = dict(run.reference)
    run.sequence.brake()
    if at_cycle == 0:
        run.step()
        assert run.sequence.finished and run.valves["muscle"].told == [("close",)]
        return
    speeds = [run.last_speed if at_cycle > 1 else 0.0, before["ref_motor_speed_m_s"]]
    while not run.sequence.finished:
        run.step()
        speeds.append(run.reference["ref_motor_speed_m_s"])
    assert speeds[-1] == 0.0 and len(speeds) < 250
    assert np.abs(np.diff(speeds)).max() <= 1e-3 * 2.0 + 1e-9  # within the rig's limit
    # no step of the acceleration where braking begins: 20 per cent of the limit in a cycle at most
    assert np.abs(np.diff(speeds, 2)).max() <= 1e-3 * 0.4
    acceleration_m_s2, length_s = (speeds[1] - speeds[0]) / 1e-3, 1e-3 * len(speeds)
    distance = run.reference["ref_motor_travel_m"] - before["ref_motor_travel_m"]
    assert (
        abs(distance)
        <= 0.75 * speeds[1] ** 2 / 1.0 + abs(acceleration_m_s2) * length_s**2 / 12 + 1e-6
    )
    assert run.sequence.failure is None
    run.sequence.brake()  # twice is once
    assert [kind for kind, _, _ in run.events].count("brake") == 1


def test_a_stop_lets_venting_go_on():
    run = run_of("  - {name: vent, valves: {all: vent}, until: valves_settled, timeout: 2 s}\n")
    for _ in range(10):
        run.step()
    run.sequence.brake()
    run.until_finished()
    assert run.valves["muscle"].told[-1] == ("vent",)


def test_a_failed_valve_ends_the_run_with_its_sentence():
    run = run_of("  - {name: trial, trial: true, for: 10 s}\n")
    for _ in range(500):
        run.step()
    run.valves["muscle"].failure = "supply empty while filling"
    run.until_finished(at_most=600)
    assert run.sequence.failure == "valves of the muscle muscle: supply empty while filling"
    assert run.events[-1][:2] == ("finished", run.sequence.failure)


def test_an_invalid_position_where_a_loop_takes_over_fails():
    run = run_of("  - {name: rest, for: 1 s}\n", start={"motor_travel_m": math.nan})
    run.until_finished(at_most=5)
    assert run.sequence.failure == "rest: motor_travel_m is not valid where its loop takes over"


def test_torque_starts_from_none_whatever_the_rig_does():
    run = run_of(
        "  - {name: push, move: {to: 50 mNm, speed: 100 mNm/s, acceleration: 10 Nm/s^2}}\n",
        head="experiment: test\nloop: motor_torque\n",
        start={"motor_travel_m": 0.01},
    )
    run.step()
    assert run.reference["ref_motor_torque_nm"] == 0.0
    asked = 0.0
    while not run.sequence.finished:
        asked = run.reference["ref_motor_torque_nm"]
        run.step()
    assert asked == pytest.approx(0.05, rel=1e-3)
    assert run.reference["ref_motor_torque_nm"] == 0.0  # the end lets go


def test_a_repeated_phase_has_the_same_motion_only_where_it_has_its_own_seed():
    def trials(seed):
        text = (
            "experiment: test\nloop: motor_speed\nseed: 3\ntimes: 2\nphases:\n  - {name: go, move:"
            " {to: 1 mm, speed: 20 mm/s}}\n  - {name: trial, trial: true, random_speed: {between:"
            f" [1 mm, 20 mm], speed: 50 mm/s}}, for: 5 s{seed}}}\n"
        )
        first, second = (phase.profile(0.001) for phase in written(text).trials)
        return first.sample(np.linspace(0, 5, 50))[0], second.sample(np.linspace(0, 5, 50))[0]

    assert np.array_equal(*trials(", seed: 7"))
    assert not np.array_equal(*trials(""))

"""Frozen channels of rigs of others, of whose converters nothing is known; and what stands still
because it rests.
"""

from pathlib import Path

import numpy as np
import pytest

from epa_rt.gap.hygiene.check import check
from epa_rt.gap.hygiene.still import check_still
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.rig.foreign.rig_file import load_rig

N = 6000
T = np.arange(N) * 1e-3


def recording(**columns: np.ndarray) -> Recording:
    return Recording(
        "log",
        "log.mcap",
        "cart",
        "cart",
        "",
        1e-3,
        np.arange(N),
        columns,
        (Span("trial 1", 0, N, True),),
    )


def carriage() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    place = 0.1 * np.sin(2.0 * np.pi * 0.5 * T)
    return {
        "carriage_position_m": np.round(place + 1e-6 * rng.standard_normal(N), 6),
        "motor_force_n": np.round(
            10.0 * np.cos(2.0 * np.pi * 0.5 * T) + 0.2 * rng.standard_normal(N), 2
        ),
        "ref_carriage_position_m": place,
    }


def chamber() -> dict[str, np.ndarray]:
    return {
        "chamber_pressure_pa": (
            np.round(
                (5e5 * np.exp(-T / 60.0) + 150.0 * np.random.default_rng(2).standard_normal(N))
                / 244.0
            )
            * 244.0
        )
    }


def frozen(found) -> list[tuple[str, str, tuple]]:
    return [(one.channel, one.severity, one.rows) for one in found if one.kind == "frozen"]


@pytest.mark.parametrize(
    ("made", "name"),
    [
        (carriage, "carriage_position_m"),
        (carriage, "motor_force_n"),
        (chamber, "chamber_pressure_pa"),
    ],
)
@pytest.mark.parametrize("stop", [N, 4600])
def test_a_channel_that_is_frozen_to_the_end_or_for_a_while_is_left_out(made, name, stop):
    columns = made()
    columns[name][2650:stop] = columns[name][2650]
    found = check([recording(**columns)], None)
    assert [(channel, severity) for channel, severity, _ in frozen(found)] == [(name, "exclude")]
    (start, end), *others = frozen(found)[0][2]
    assert 2640 <= start <= 2650 and abs(end - stop) < 10 and not others
    assert f"{name}: found" in next(one.says for one in found if one.kind == "frozen")


@pytest.mark.parametrize("made", [carriage, chamber])
def test_what_moves_is_let_alone(made):
    assert not frozen(check([recording(**made())], None))


def test_a_carriage_that_rests_without_noise_is_let_alone():
    """Dry friction holds it, and its controller asks for the same to the last digit."""
    columns = {name: values.copy() for name, values in carriage().items()}
    for values in columns.values():
        values[2000:4000] = values[2000]
    assert not check_still(recording(**columns), None)


def test_a_place_that_dry_friction_holds_while_the_force_grows_is_let_alone():
    columns = carriage()
    columns["carriage_position_m"][2400:2700] = columns["carriage_position_m"][2400]
    columns["ref_carriage_position_m"] = np.where(
        (T >= 2.4) & (T < 2.7),
        columns["ref_carriage_position_m"][2400] + 0.05 * (T - 2.4),
        columns["ref_carriage_position_m"],
    )
    assert not check_still(recording(**columns), None)


def test_a_drive_at_its_limit_is_let_alone():
    columns = carriage()
    columns["motor_force_n"] = np.clip(columns["motor_force_n"], -8.0, 8.0)
    assert not frozen(check([recording(**columns)], None))


def test_a_force_that_rests_at_first_and_is_cut_off_then_is_said_at_both_ends():
    """A carriage that rests shows no noise there, so that its force counts as none that has any."""
    noise = 0.2 * np.random.default_rng(3).standard_normal(N)
    force = np.where(T < 0.2, 0.0, np.round(10.0 * np.sin(2.0 * np.pi * (T - 0.2)) + noise, 2))
    columns = {
        "carriage_position_m": carriage()["carriage_position_m"],
        "motor_force_n": np.clip(force, -7.0, 8.0),
    }
    said = [one.says for one in check([recording(**columns)], None) if one.kind == "saturated"]
    assert (
        len(said) == 2
        and "flat at 8, its highest value" in said[0]
        and "flat at -7, its lowest value" in said[1]
    )


def test_what_is_asked_of_a_drive_at_its_limit_is_no_sensor_at_the_end_of_its_range():
    """By its column's name: a force that is read back may be either."""
    columns = carriage()
    columns["cmd_motor_force_n"] = np.clip(columns.pop("motor_force_n"), -8.0, 8.0)
    assert not check([recording(**columns)], None)


def test_a_channel_that_is_frozen_twice_loses_both_stretches_whichever_check_finds_them():
    """The first one ends with a jump, which another check finds; it does not stand for the second,
    at the end of the log.
    """
    columns = carriage()
    columns["carriage_position_m"][1300:1900] = columns["carriage_position_m"][1300]
    columns["carriage_position_m"][4300:] = columns["carriage_position_m"][4300]
    rows = [row for _, _, rows in frozen(check([recording(**columns)], None)) for row in rows]
    assert any(a <= 1310 and b >= 1890 for a, b in rows)
    assert any(a <= 4310 and b == N for a, b in rows)


def joints() -> dict[str, np.ndarray]:
    """The pitch moves in the first half, the elbow in the second; each answers three rows late."""
    swing = np.where(T < 3.0, 0.0, 0.5 * np.sin(2.0 * np.pi * (T - 3.0)))
    asked = {"pitch": swing[::-1].copy(), "elbow": swing + 0.3}
    step = 1.5e-5
    columns = {f"cmd_{name}_position_rad": values for name, values in asked.items()}
    for name, values in asked.items():
        place = np.round(np.concatenate([np.full(3, values[0]), values[:-3]]) / step) * step
        columns |= {f"{name}_position_rad": place, f"{name}_speed_rad_s": np.gradient(place) * 1e3}
    return columns


def test_joints_that_move_one_after_the_other_are_let_alone():
    assert not check_still(recording(**joints()), None)


def test_a_joint_that_stands_still_where_it_is_asked_to_move_is_left_out_with_its_rests_let_alone():
    columns = joints()
    columns["elbow_position_rad"][4100:4600] = columns["elbow_position_rad"][4100]
    (finding,) = check_still(recording(**columns), None)
    assert (finding.channel, finding.severity) == (
        "elbow_position_rad",
        "exclude",
    ) and finding.rows == ((4100, 4600),)


def test_a_joint_whose_command_nobody_recorded_is_held_against_the_others():
    columns = joints()
    del columns["cmd_elbow_position_rad"], columns["elbow_speed_rad_s"]
    columns["pitch_position_rad"] += columns["elbow_position_rad"]  # it moves all the time now
    columns["elbow_position_rad"][4100:4600] = columns["elbow_position_rad"][4100]
    (finding,) = check_still(recording(**columns), None)
    assert (finding.channel, finding.rows) == ("elbow_position_rad", ((4100, 4600),))


def test_a_joint_is_held_against_the_command_that_the_rig_file_names():
    """Its name says nothing: the elbow rests while the pitch moves, and then begins with a step."""
    columns = joints()
    del columns["elbow_speed_rad_s"]
    columns["elbow_position_rad"] += 0.2 * (T > 3.0)
    columns["cmd_goal_rad"] = columns.pop("cmd_elbow_position_rad")
    assert check_still(recording(**columns), None)
    asked = {"elbow_position_rad": ("cmd_goal_rad",)}
    assert not check_still(recording(**columns), None, asked)
    servo_file = load_rig(Path("config/rigs_foreign/so101_elbow.yaml"))
    assert list(servo_file.asked_by_column.values()) == [(servo_file.channels["command"],)]
    assert not load_rig(Path("config/rigs_foreign/emps.yaml")).asked_by_column


STEP = 1.5e-3


def resampled(values: np.ndarray, step: float = STEP) -> np.ndarray:
    """Readings (N,) of something at times of its own, 4 % further apart than rows are, with steps,
    put onto the rows by straight lines.
    """
    read_at = np.arange(0.0, T[-1] + 2e-3, 1.04e-3)
    return np.interp(T, read_at, np.round(np.interp(read_at, T, values) / step) * step)


def servo() -> dict[str, np.ndarray]:
    """A joint that stays in its dead band where it is asked to turn back."""
    asked = 0.4 * np.sin(2.0 * np.pi * 0.7 * T) + 0.2 * np.sin(2.0 * np.pi * 1.1 * T)
    place, held = np.empty(N), 0.0
    for k, wanted in enumerate(asked):
        held = min(max(held, wanted - 0.05), wanted + 0.05)
        place[k] = held
    return {"joint_position_rad": resampled(place), "cmd_joint_position_rad": asked}


def test_an_encoder_that_rests_within_its_play_is_let_alone_at_another_rate():
    rests = np.diff(servo()["joint_position_rad"]) == 0.0
    assert rests.sum() > 1000 and not check([recording(**servo())], None)


def test_an_encoder_that_is_frozen_in_its_motion_is_left_out_at_another_rate():
    columns = servo()
    columns["joint_position_rad"][2900:3300] = columns["joint_position_rad"][2900]
    ((channel, _, rows),) = frozen(check([recording(**columns)], None))
    assert channel == "joint_position_rad" and rows == ((2900, 3300),)


@pytest.mark.parametrize("steps_of_noise", [0.05, 0.5])
@pytest.mark.parametrize("moves", [0.0, 1.0])
def test_noise_that_stops_for_a_while_is_left_out_at_another_rate(steps_of_noise, moves):
    """Readings as fine as a twentieth of their noise, and as coarse as half of it."""
    noise = np.random.default_rng(4).standard_normal(N)
    force = resampled(noise + 30.0 * moves * np.sin(2.0 * np.pi * 0.7 * T), steps_of_noise)
    force[3000:3070] = force[3000]
    ((channel, _, rows),) = frozen(check([recording(motor_force_n=force)], None))
    assert channel == "motor_force_n" and rows == ((3000, 3070),)


def test_steps_that_the_rig_file_says_are_believed():
    """A few strokes at one speed: of so few readings none slows down to tell an encoder by, and its
    steps, between which straight lines run, pass for noise.
    """
    place = np.interp(T, [0.0, 1.0, 1.1, 3.0, 3.1, N * 1e-3], [0.0, 0.9, 0.9, -0.8, -0.8, 1.8])
    columns = {"joint_position_rad": resampled(place)}
    assert frozen(check([recording(**columns)], None))
    assert not check([recording(**columns)], None, {"joint_position_rad": STEP})


def test_a_servo_that_rests_until_its_next_step_has_no_frozen_sensor():
    told = np.repeat([0.0, 0.3, 0.1, 0.5, 0.2, 0.4], N // 6)
    late = np.concatenate([np.zeros(40), told[:-40]])  # rows until it answers
    swings = np.repeat([1.5, -0.5], 60) / 60.0  # beyond where it rests: that is no end of its range
    angle = np.round(np.convolve(late, swings)[:N] + 0.05 * (T < 0.2) * np.sin(50.0 * T), 5)
    assert not check_still(recording(horn_angle_rad=angle, cmd_servo_rad=told), None)

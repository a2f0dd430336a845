"""Motor and joint controllers: bumpless starts, no drift, limits, wiring, closed loops."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.control.motion import JointAngle, MotorPosition, MotorSpeed, MotorTorque
from epa_rt.control.pid import PidGains

DT_S = 1e-3
travel = st.floats(-0.1, 0.1)


@given(travel, travel, travel)
def test_position_starts_at_the_last_target_and_follows_from_there(measured, reference, last):
    c = MotorPosition()
    m = {"motor_travel_m": measured}
    c.reset(m, {"cmd_motor_travel_m": last})
    assert c.step(m, {"ref_motor_travel_m": reference}, DT_S)[
        "cmd_motor_travel_m"
    ] == pytest.approx(last)
    moved = c.step(m, {"ref_motor_travel_m": reference + 0.01}, DT_S)["cmd_motor_travel_m"]
    assert moved == pytest.approx(last + 0.01)
    for no_command in (None, {}, {"cmd_motor_travel_m": math.nan}):
        c.reset(m, no_command)
        start = c.step(m, {"ref_motor_travel_m": reference}, DT_S)["cmd_motor_travel_m"]
        assert start == pytest.approx(measured)


def test_position_alignment_bleeds_off_at_its_speed():
    c = MotorPosition(align_speed_m_s=0.1)
    m = {"motor_travel_m": 0.05}
    c.reset(m)
    out = [c.step(m, {"ref_motor_travel_m": 0.0}, DT_S)["cmd_motor_travel_m"] for _ in range(600)]
    assert out[0] == 0.05 and out[-1] == 0.0
    assert max(abs(b - a) for a, b in zip(out, out[1:], strict=False)) <= 0.1 * DT_S + 1e-12


def test_speed_keeps_the_mean_on_a_drive_that_is_slow_by_five_percent():
    c = MotorSpeed(kp_position=5.0, limit_m_s=0.3)
    x = 0.02
    c.reset({"motor_travel_m": x})
    worst = 0.0
    for k in range(60_000):
        t = k * DT_S
        r = {"ref_motor_travel_m": 0.01 * math.sin(t), "ref_motor_speed_m_s": 0.01 * math.cos(t)}
        x += DT_S * (0.95 * c.step({"motor_travel_m": x}, r, DT_S)["cmd_motor_speed_m_s"] + 1e-3)
        worst = max(worst, abs(x - 0.02 - r["ref_motor_travel_m"]))
    assert worst < 4e-4 and c.saturated == 0


@given(st.floats(-1, 1), travel, travel)
def test_speed_is_limited_counted_and_starts_at_the_reference(speed, measured, reference):
    c = MotorSpeed(kp_position=50.0, limit_m_s=0.2)
    m = {"motor_travel_m": measured}
    c.reset(m)
    r = {"ref_motor_travel_m": reference, "ref_motor_speed_m_s": speed}
    assert c.step(m, r, DT_S)["cmd_motor_speed_m_s"] == pytest.approx(max(-0.2, min(0.2, speed)))
    assert c.saturated == (abs(speed) > 0.2)
    assert math.isnan(c.step({"motor_travel_m": math.nan}, r, DT_S)["cmd_motor_speed_m_s"])


@given(st.floats(-10, 10), st.floats(-10, 10))
def test_torque_slews_from_the_last_command_within_its_limit(last, wanted):
    c = MotorTorque(limit_n_m=5.0, slew_n_m_s=100.0)
    c.reset({}, {"cmd_motor_torque_n_m": last})
    previous = last
    for _ in range(200):
        now = c.step({}, {"ref_motor_torque_n_m": wanted}, DT_S)["cmd_motor_torque_n_m"]
        assert abs(now - previous) <= 0.1 + 1e-9
        previous = now
    assert now == pytest.approx(max(-5.0, min(5.0, wanted)))
    assert c.saturated == (200 if abs(wanted) > 5.0 else 0)
    assert math.isnan(c.step({}, {"ref_motor_torque_n_m": math.nan}, DT_S)["cmd_motor_torque_n_m"])
    assert c.step({}, {"ref_motor_torque_n_m": wanted}, DT_S)[
        "cmd_motor_torque_n_m"
    ] == pytest.approx(now)


JOINT_COMMAND = {
    "travel": "cmd_motor_travel_m",
    "speed": "cmd_motor_speed_m_s",
    "torque": "cmd_motor_torque_n_m",
}


@given(
    st.sampled_from(list(JOINT_COMMAND)), st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.05, 0.05)
)
def test_joint_starts_at_the_last_command(output, angle, reference, last):
    name = JOINT_COMMAND[output]
    c = JointAngle(
        PidGains(0.05, 0.1, 0.001, 50.0, -0.1, 0.1), lever_arm_m=-0.04, output=output, command=name
    )
    m = {"knee_angle_rad": angle, "motor_travel_m": 0.01}
    r = {"ref_knee_angle_rad": reference, "ref_knee_speed_rad_s": 0.5}
    c.reset(m, {name: last})
    assert c.step(m, r, DT_S)[name] == pytest.approx(last)
    c.reset(m)
    assert c.step(m, r, DT_S)[name] == pytest.approx(0.01 if output == "travel" else 0.0)


@pytest.mark.parametrize("lever_arm_m", [0.04, -0.04])
@pytest.mark.parametrize("output", list(JOINT_COMMAND))
def test_joint_closes_the_loop_with_either_sign_of_the_lever_arm(output, lever_arm_m):
    """Joint behind a lever: angle follows travel / lever with a lag; torque is what a spring and
    damper answer.
    """
    name = JOINT_COMMAND[output]
    gains = {
        "travel": PidGains(0.01, 0.2, 0.0, 50.0, -0.5, 0.5),
        "speed": PidGains(0.4, 0.2, 0.0, 50.0, -0.5, 0.5),
        "torque": PidGains(60.0, 100.0, 0.5, 50.0, -50.0, 50.0),
    }[output]
    c = JointAngle(gains, lever_arm_m=lever_arm_m, output=output, command=name)
    angle = x = 0.0
    m = {"knee_angle_rad": 0.0, "motor_travel_m": 0.0}
    c.reset(m)
    errors = []
    for k in range(8000):
        t = k * DT_S
        r = {
            "ref_knee_angle_rad": 0.2 * math.sin(3 * t),
            "ref_knee_speed_rad_s": 0.6 * math.cos(3 * t),
        }
        m["knee_angle_rad"], m["motor_travel_m"] = angle, x
        u = c.step(m, r, DT_S)[name]
        if output == "torque":
            angle += DT_S * (math.copysign(1.0, lever_arm_m) * u - angle) / 0.5
        else:
            x = u if output == "travel" else x + DT_S * u
            angle += DT_S / 0.01 * (x / lever_arm_m - angle)
        errors.append(r["ref_knee_angle_rad"] - angle)
    assert math.sqrt(sum(e * e for e in errors[4000:]) / 4000) < 0.01


def test_joint_with_smoothing_and_speed_feedforward_starts_at_the_last_command_and_forgets_a_nan():
    c = JointAngle(
        PidGains(0.1, 0.2, 0.001, 50.0, -0.1, 0.1),
        lever_arm_m=0.04,
        feedforward_speed_s=0.05,
        output_cutoff_hz=20.0,
    )
    m = {"knee_angle_rad": 0.1, "motor_travel_m": 0.0}
    r = {"ref_knee_angle_rad": 0.3, "ref_knee_speed_rad_s": 0.5}
    c.reset(m, {"cmd_motor_travel_m": 0.02})
    assert c.step(m, r, DT_S)["cmd_motor_travel_m"] == pytest.approx(0.02)
    assert math.isnan(c.step({**m, "knee_angle_rad": math.nan}, r, DT_S)["cmd_motor_travel_m"])
    assert c.step(m, r, DT_S)["cmd_motor_travel_m"] == pytest.approx(0.02, abs=1e-4)


def test_wiring_is_declared_and_the_result_is_one_dict():
    controllers = [
        MotorPosition(travel="a", reference_travel="b", command="c"),
        MotorSpeed(
            travel="a",
            reference_travel="b",
            reference_speed="s",
            command="c",
            kp_position=1.0,
            limit_m_s=1.0,
        ),
        MotorTorque(reference="b", command="c", limit_n_m=1.0),
        JointAngle(
            PidGains(1.0), lever_arm_m=0.1, angle="k", reference_angle="b", travel="a", command="c"
        ),
    ]
    for c in controllers:
        signals = dict.fromkeys(c.reads, 0.0)
        c.reset(signals)
        out = c.step(signals, signals, DT_S)
        assert c.writes == ("c",) == tuple(out)
        assert c.step(signals, signals, DT_S) is out


@pytest.mark.parametrize(
    "make",
    [
        lambda: MotorSpeed(kp_position=1.0, limit_m_s=0.0),
        lambda: MotorTorque(limit_n_m=1.0, slew_n_m_s=0.0),
        lambda: JointAngle(PidGains(1.0), lever_arm_m=0.1, output="volts"),
    ],
)
def test_settings_that_make_no_sense_are_refused(make):
    with pytest.raises(ValueError, match="expected"):
        make()

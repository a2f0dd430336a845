"""Homing finds a taut strap and an end stop, says what it did not find, and guesses nothing."""

from pathlib import Path

import pytest

from epa_rt.config.rig import Zero, load_rig
from tests.loop.one_rig import OneRig

RIGS = Path(__file__).resolve().parents[2] / "config/rigs"
STOP = Zero(
    method="stop",
    at="25 mm",
    direction="increasing",
    speed="5 mm/s",
    distance_max="30 mm",
    current="1 A",
)
START_HOMING = 0x1F


def with_zero(one: OneRig, zero: Zero) -> None:
    """The same rig with another ``motor.zero``."""
    motor = one.rig.motor.model_copy(update={"zero": zero})
    one.rig = one.rig.model_copy(update={"motor": motor})


def words(one: OneRig) -> set[int]:
    return {int(sample[8]["cmd_drive_control_raw"]) for sample in one.memory.samples}


def test_a_stop_is_found_by_its_current_and_left_again(tmp_path):
    one = OneRig(tmp_path)
    with_zero(one, STOP)
    one.stop_at(15e-3 * 19 / 0.010)  # 15 mm of the spool's 10 mm radius, behind the gear
    result, found = one.home()
    assert result.outcome == "completed", result.cause
    assert found.touches == pytest.approx([15e-3] * 3, abs=2e-5)
    assert max(map(abs, one.measured("motor_current_a"))) < 3.0
    assert found.place == pytest.approx(one.travel_m, abs=2e-5)
    assert words(one).isdisjoint({START_HOMING})


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"distance_max": 0.006}, "motor_current_a has not reached 1 A within 6 mm"),
        ({"current": 0.02}, "does not fall below 0.01 A within 30 mm"),
    ],
)
def test_what_is_not_found_is_said(tmp_path, changes, sentence):
    one = OneRig(tmp_path)
    with_zero(one, STOP.model_copy(update=changes))
    result, found = one.home()
    assert result.outcome == "tripped" and sentence in result.cause, result.cause
    assert found.place is None


def test_between_touches_it_stays_within_the_limits_whatever_the_file_says(tmp_path):
    """A touch says where the limits are: -7 mm is 3 mm from the one behind it."""
    one = OneRig(tmp_path)
    with_zero(one, STOP.model_copy(update={"at": -7e-3, "distance_max": 0.4, "approaches": 2}))
    one.stop_at(2e-3 * 19 / 0.010)
    result, found = one.home()
    assert result.outcome == "completed", result.cause
    assert found.touches == pytest.approx([2e-3] * 2, abs=2e-5)
    travel = one.measured("motor_travel_m")
    assert -1.5e-3 < min(travel) < -0.9e-3


def test_approaches_that_scatter_set_no_zero(tmp_path):
    one = OneRig(tmp_path)
    with_zero(one, one.rig.motor.zero.model_copy(update={"tolerance": 1e-6}))
    result, _ = one.home()
    assert result.outcome == "tripped" and "approaches scatter by" in result.cause


def test_here_stands_still_and_sets_the_travel_of_the_rig_file(tmp_path):
    one = OneRig(tmp_path, "mass", "motor_position")
    one.model.lose_drive_supply()
    before = one.travel_m
    result, setting = one.set_zero()
    assert result.outcome == "completed" and setting.after == pytest.approx(-28e-3, abs=2e-6)
    assert one.travel_m == pytest.approx(before, abs=1e-4)
    modes = {sample[8]["cmd_drive_mode_raw"] for sample in one.memory.samples}
    assert START_HOMING in words(one) and modes <= {0, 6}


def test_a_motor_that_crept_without_power_is_not_given_a_zero(tmp_path):
    one = OneRig(tmp_path)
    result, _ = one.set_zero(place=0.001)
    assert result.outcome == "tripped" and "the motor crept -1 mm without power" in result.cause
    assert START_HOMING not in words(one)


@pytest.mark.parametrize(
    ("kept", "added", "sentence"),
    [
        (0xEF, 0x00, "did not report homing attained and referenced"),  # bit 12 never comes
        (0x7F, 0x00, "did not report homing attained and referenced"),  # bit 15 neither
        (0xFF, 0x20, "the drive reports a homing error (status word bit 13)"),
    ],
)
def test_a_drive_that_does_not_do_it_is_found_out(tmp_path, kept, added, sentence):
    one = OneRig(tmp_path)
    high_byte, cycle = int(one.model._drive["status_byte"][0]) + 1, one.model.cycle

    def otherwise(outputs_raw: bytes) -> bytes:
        inputs = bytearray(cycle(outputs_raw))
        inputs[high_byte] = inputs[high_byte] & kept | added
        return bytes(inputs)

    one.model.cycle = otherwise
    result, _ = one.set_zero()
    assert result.outcome == "tripped" and sentence in result.cause, result.cause


def test_a_count_that_is_not_the_home_position_is_found_out(tmp_path):
    one = OneRig(tmp_path)
    one.model._drive["home_counts"] = 9000
    result, _ = one.set_zero()
    assert result.outcome == "tripped" and "travel reads 7.2662 mm after homing" in result.cause


def test_a_rig_without_a_zero_section_has_its_zero_set_by_hand(tmp_path):
    text = "".join(
        line
        for line in (RIGS / "mass.yaml").read_text(encoding="utf-8").splitlines(keepends=True)
        if "zero: {" not in line
    )
    path = tmp_path / "mass.yaml"
    path.write_text(text, encoding="utf-8")
    zero = load_rig(path).motor.zero
    assert (zero.method, zero.at) == ("here", 0.0)

"""Power that was refused stays refused, and the first refusal is the one that is said."""

import pytest
from safety_bench import Bench, edited

from epa_rt.safety.commands import CommandGate

TRAVEL, SPEED, CONTROL, MODE = (
    "cmd_motor_travel_m",
    "cmd_motor_speed_m_s",
    "cmd_drive_control_raw",
    "cmd_drive_mode_raw",
)
ON = {CONTROL: 0x0F, MODE: 8}
BRAKE = (
    (
        "  # normally open: without current the muscle vents",
        "  - {name: cmd_brake_open, entry: valves.ch4}\n"
        "  # normally open: without current the muscle vents",
    ),
    ("  places: {no_load", "  brake: {output: cmd_brake_open}\n  places: {no_load"),
)


@pytest.mark.parametrize("change", [{SPEED: 0.001}, {TRAVEL: 0.01}])
def test_power_that_was_refused_once_is_refused_again(change):
    """The gate alone, without the trip that latches: a refused power must not count as on."""
    bench = Bench()
    command = bench.safe | ON | change
    first = bench.gate.pass_through(bench.measured, command)
    assert first is not None and first[0] == "jump at enable"
    assert not bench.gate.powered
    assert bench.gate.pass_through(bench.measured, command) == first


def test_a_jump_at_enable_goes_before_the_brake_that_opens_with_it():
    bench = Bench(edited("bench", *BRAKE))
    bench.check()
    assert bench.check(command=ON | {SPEED: 0.001, "cmd_brake_open": 1.0}) == bench.safe
    assert bench.trip[:2] == ("jump at enable", SPEED)


def test_a_gate_that_is_told_nothing_of_homing_lets_a_run_have_its_mode_and_no_homing():
    for mode, refused in ((9, False), (6, True)):
        bench = Bench()
        gate = CommandGate(bench.rig)
        refusal = gate.pass_through(bench.measured, bench.safe | {CONTROL: 0x0F, MODE: mode})
        assert (refusal is not None) is refused

"""Where each bound of a stop under power begins, and what a rig without some rows does."""

import pytest
from safety_bench import Bench, edited, rig

from epa_rt.safety.commands import CommandGate
from epa_rt.safety.stopping import BRAKING, Stopping

TRAVEL, SPEED, TOLD = "motor_travel_m", "motor_speed_m_s", "cmd_motor_speed_m_s"
ENABLED = 0x0237


def test_a_speed_beyond_what_braking_explains_is_said_to_four_digits():
    bench = Bench(edited("bench", ("safety:", "safety:\n  stop_overspeed: 1.23456")))
    bench.power_on(9, ENABLED)
    bench.envelope.trip("recorder", "", "the disk is full", 1)
    bench.check()
    bench.check({SPEED: 0.1987654, TRAVEL: 0.19e-3})
    assert bench.envelope.stopping.why == (
        f"{SPEED} = 198.8 mm/s while it should brake, beyond 185.2 mm/s"
    )


def test_a_wired_drive_without_a_row_for_its_speed_is_held_by_its_enable():
    motor = rig("bench_analog").motor.model_copy(update={"speed_target": None})
    on = rig("bench_analog").model_copy(update={"motor": motor})
    stopping, gate = Stopping(on), CommandGate(on)
    gate.outputs["cmd_drive_enable"] = 1.0
    stopping.begin(gate, True)
    measured = dict.fromkeys((row.name for row in on.inputs), 0.0)
    assert stopping.step(measured, True, "", 0, 0)["cmd_drive_enable"] == 1.0


@pytest.mark.parametrize("held_cycles", [1, 400])
def test_a_load_that_is_let_down_fast_is_not_taken_for_a_drive_that_does_not_stop(held_cycles):
    """50 mm/s, where a drive that brakes must be below 30 mm/s after 170 cycles."""
    bench = Bench(
        edited("bench", ("  speed_max: 70", "  let_down_speed: 50 mm/s\n  speed_max: 70"))
    )
    bench.measured[TRAVEL] = bench.command["cmd_motor_travel_m"] = travel = 0.028
    bench.check()
    bench.power_on(9, ENABLED)
    bench.envelope.trip("recorder", "", "the disk is full", 1)
    stopping, speed, fastest = bench.envelope.stopping, 0.0, 0.0
    for cycle in range(held_cycles + 2500):
        if cycle == held_cycles:
            stopping.ask_to_let_down()
        out = bench.check({TRAVEL: travel, SPEED: speed})
        assert stopping.category == BRAKING, stopping.why
        speed = out[TOLD]
        travel, fastest = travel + 1e-3 * speed, max(fastest, abs(speed))
    assert stopping.let_down.arrived and fastest > 0.045

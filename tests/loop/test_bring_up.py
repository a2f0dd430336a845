"""Nothing moves at start: not before the drive is enabled, not by enabling it, not by the first
reference.
"""

import numpy as np
import pytest

from tests.loop.rigging import run_in_memory, tiny_inputs

RUN = 2


@pytest.mark.parametrize(
    ("rig", "loop"),
    [("bench", "motor_speed"), ("bench", "motor_position"), ("bench_analog", "motor_speed")],
)
def test_the_motor_stays_where_it_is_until_the_first_motion(rig, loop, tmp_path):
    start_rad = -60.0  # nowhere near zero: an encoder stands where it was left

    def prepare(assembly, model):
        model.params["load"]["start_travel_m"] = -0.004
        from epa_rt.models.plant import new_state

        model.state = new_state(model.params)

    inputs = tiny_inputs(tmp_path, rig, loop)
    out = run_in_memory(inputs, prepare=prepare)
    assert start_rad and out.result.outcome == "completed"
    first_move = next(s[0] for s in out.memory.samples if s[3] == 1)
    travel = np.array([s[6]["motor_travel_m"] for s in out.memory.samples[:first_move]])
    assert np.ptp(travel) < 20e-6
    assert abs(travel[0] + 0.004) < 50e-6


def test_before_the_drive_is_live_its_targets_are_its_actual_values(tmp_path):
    out = run_in_memory(tiny_inputs(tmp_path))
    before = [s for s in out.memory.samples if s[2] < RUN]
    assert all(s[8]["cmd_motor_travel_m"] == s[6]["motor_travel_m"] for s in before)
    assert all(
        s[8]["cmd_motor_speed_m_s"] == 0.0 and s[8]["cmd_motor_torque_nm"] == 0.0 for s in before
    )


def test_valves_stay_de_energised_until_the_first_phase(tmp_path):
    out = run_in_memory(tiny_inputs(tmp_path))
    before = [s for s in out.memory.samples if s[2] < RUN]
    assert all(
        (s[8]["cmd_muscle_inlet_open"], s[8]["cmd_muscle_exhaust_open"]) == (0.0, 1.0)
        for s in before
    )


def test_control_words_walk_the_drive_up_one_transition_at_a_time(tmp_path):
    out = run_in_memory(tiny_inputs(tmp_path))
    words = [s[8]["cmd_drive_control_raw"] for s in out.memory.samples]
    order = [w for i, w in enumerate(words) if i == 0 or words[i - 1] != w]
    assert order == [0x00, 0x06, 0x07, 0x0F, 0x07, 0x06, 0x00]


def test_a_drive_that_does_not_come_up_is_said_to_be_stuck(tmp_path):
    def hurt(exchange, model):
        model.machine["state"] = 1
        return exchange

    out = run_in_memory(tiny_inputs(tmp_path), hurt)
    assert out.result.trip.cause == "drive"
    assert "switch on disabled" in out.result.cause

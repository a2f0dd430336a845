"""After every kind of trip, epa jog and (zero lost) epa home bring the rig back to a run."""

import pytest

from tests.loop.one_rig import OneRig

TRIPS = [
    ("bench", "motor_speed", "wire_broken", "muscle_force_n", {}),
    ("bench", "motor_position", "wire_broken", "muscle_pressure_pa", {}),
    ("bench", "motor_speed", "sto", "", {"cycles": 100}),
    ("bench", "motor_speed", "encoder_jump", "", {}),
    ("bench", "motor_speed", "valve_stuck_open", "cmd_muscle_inlet_open", {}),
    ("bench", "motor_speed", "supply_lost", "", {}),
    ("bench_analog", "motor_speed", "wire_broken", "muscle_force_n", {}),
    ("knee", "motor_position", "sto", "", {"cycles": 100}),
    ("mass", "motor_position", "sto", "", {"cycles": 100}),
]


@pytest.mark.parametrize(("rig", "loop", "kind", "where", "more"), TRIPS)
def test_a_jog_leads_from_a_trip_to_a_run_that_completes(tmp_path, rig, loop, kind, where, more):
    one = OneRig(tmp_path, rig, loop)
    one.break_it(kind, where, at_cycle=200 if kind == "supply_lost" else 4000, **more)
    assert one.experiment().outcome == "tripped"
    one.mend(3000)
    low, high = one.rig.row(one.rig.motor.position).limits
    left_m = one.measured(one.rig.motor.position)[-1]
    was_m = one.travel_m
    result, jog = one.jog(f"move {-was_m} m", "vent")
    assert result.outcome == "completed", result.cause
    travel = one.measured(one.rig.motor.position)
    assert min(low, was_m) - 1e-3 <= min(travel) and max(travel) <= max(high, was_m) + 1e-3
    if one.rig.motor.speed:
        speeds = one.measured(one.rig.motor.speed)
        assert max(map(abs, speeds)) < 2.0 * jog.speed_max
    again = one.experiment()
    assert again.outcome == "completed", (again.cause, left_m)


@pytest.mark.parametrize("start_mm", [40.0, -20.0])
def test_from_beyond_a_limit_of_travel_only_the_way_back_is_open(tmp_path, start_mm):
    one = OneRig(tmp_path)
    one.inputs.plant.params["load"]["start_travel_m"] = 1e-3 * start_mm
    try:
        one.model.__init__(one.rig, one.inputs.plant, 1)
    finally:
        one.inputs.plant.params["load"]["start_travel_m"] = 0.0
    assert one.experiment().cause.startswith("over-travel")
    outward = "move 5 mm" if start_mm > 0.0 else "move -5 mm"
    result, _ = one.jog(outward)
    assert result.outcome == "tripped" and "a move to" in result.cause
    assert abs(one.travel_m - 1e-3 * start_mm) < 1e-4
    result, _ = one.jog("fill muscle 50 kPa")
    assert "is not filled while motor_travel_m is outside of its limits" in result.cause
    assert one.jog(f"move {-start_mm} mm")[0].outcome == "completed"
    assert one.experiment().outcome == "completed"


def test_a_drive_without_its_zero_is_refused_before_power_jogged_and_homed(tmp_path):
    one = OneRig(tmp_path)
    assert one.jog("move 15 mm")[0].outcome == "completed"
    one.model.lose_drive_supply()
    refused = one.experiment()
    assert refused.cause.startswith("unreferenced: ") and "epa home" in refused.cause
    assert not any(sample[8]["cmd_drive_control_raw"] == 0x0F for sample in one.memory.samples)
    result, jog = one.jog("move -3 mm", "move 3 mm")
    assert result.outcome == "completed" and jog.found_zero is False
    assert one.experiment().cause.startswith("unreferenced: ")
    result, found = one.home()
    assert result.outcome == "completed" and len(found.touches) == 3
    result, setting = one.set_zero(found.place)
    assert result.outcome == "completed" and abs(setting.before - setting.after) > 0.01
    assert one.measured("motor_travel_m")[-1] == pytest.approx(one.travel_m, abs=3e-4)
    assert one.experiment().outcome == "completed"


def test_nine_thousand_counts_of_offset_are_refused(tmp_path):
    one = OneRig(tmp_path)
    one.model.machine["offset_counts"], one.model.machine["is_referenced"] = 9000, 0
    assert one.experiment().cause.startswith("unreferenced: ")


def test_a_jog_does_not_fill_a_muscle_beyond_its_most(tmp_path):
    one = OneRig(tmp_path)
    result, _ = one.jog("fill muscle 200 kPa", "wait 0.2 s", "vent")
    assert result.outcome == "completed"
    assert 290e3 < max(one.measured("muscle_pressure_pa")) < 310e3
    assert one.measured("muscle_pressure_pa")[-1] < 110e3

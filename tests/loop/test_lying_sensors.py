"""Sensors that lie in a run on the simulated rig: found before 1.1 times any limit of the rig, and
named. All of them: python scripts/sensor_table.py.
"""

import pytest

from tests.loop.sensor_scenarios import BEFORE, LIES, facts_of

FOUND = (
    ("bench", "pressure -40 kPa", "muscle_pressure_pa"),
    ("bench", "pressure frozen", "muscle_pressure_pa"),
    ("bench", "pressure x 0.8", "muscle_pressure_pa"),
    ("bench", "pressure x 0.5", "muscle_pressure_pa"),
    ("bench", "force +100 N", "muscle_force_n"),
    ("bench", "force x 0.5", "muscle_force_n"),
    ("bench_analog", "current dead", "motor_current_a"),
    ("bench", "count short by 9000", "motor_travel_m"),
    ("bench_analog", "count short by 9000", "motor_travel_m"),
    ("mass", "count over by 9000", "motor_travel_m"),
    ("mass", "force constant 0 V", "muscle_force_n"),
    ("knee", "joint x 0.5", "knee_angle_rad"),
    ("knee", "pressure wires exchanged", "ppam_pressure_pa"),
    ("knee_geared", "hoses exchanged", "spam_pressure_pa"),
)


@pytest.mark.parametrize(("rig", "name", "signal"), FOUND)
def test_a_sensor_that_lies_from_the_start_is_found_in_time_and_named(rig, name, signal):
    lie = next(lie for lie in LIES if lie.name == name)
    facts = facts_of(rig, lie, BEFORE[0], 0)
    assert facts["outcome"] == "tripped", facts
    assert facts["check"] in ("sensor at rest", "implausible sensor"), facts
    assert signal in facts["sentence"] and facts["largest_share"] < 1.1, facts


def test_a_burst_in_the_trial_is_found_within_a_tenth_of_a_second():
    lie = next(lie for lie in LIES if lie.name == "muscle burst")
    facts = facts_of("bench", lie, "in the trial", 5500)
    assert facts["found_after_s"] < 0.1 and "burst" in facts["sentence"], facts

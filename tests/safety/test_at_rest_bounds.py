"""Figures, units and bands of what a vented rig reads, and what a rig that says less is asked."""

import pytest

from epa_rt.config.rig import Rig
from epa_rt.safety.at_rest import AtRest
from tests.safety.safety_bench import edited, rig

PRESSURE, FORCE, CURRENT, TRAVEL = (
    "muscle_pressure_pa",
    "muscle_force_n",
    "motor_current_a",
    "motor_travel_m",
)


def asked(on: Rig, cycles: int = 5000, **changes: float) -> AtRest:
    """The check of a rig that stands; ``changes``: what is read beside a sound rest."""
    measured = dict.fromkeys((row.name for row in on.inputs), 0.0)
    measured |= {muscle.pressure: on.atmosphere_pa for muscle in on.muscles}
    check = AtRest(on)
    for _ in range(cycles):
        if check.done:
            break
        check.step(measured | changes, True)
    return check


def sensors(on: str = "bench", **update: object) -> Rig:
    changed = rig(on).safety.sensors.model_copy(update=update)
    safety = rig(on).safety.model_copy(update={"sensors": changed})
    return rig(on).model_copy(update={"safety": safety})


def test_a_pressure_is_said_in_kpa_to_a_tenth():
    refusal = asked(rig("bench"), **{PRESSURE: 101_325.0 + 412_345.6}).refusal
    assert refusal[2].startswith(f"{PRESSURE} reads +412.3 kPa gauge with muscle vented, more than")


def test_the_band_of_the_current_is_said_as_the_rig_file_says_it():
    refusal = asked(sensors(current_zero=0.123456789), **{CURRENT: 0.5}).refusal
    assert refusal[2].startswith(f"{CURRENT} reads +0.500 A without power, more than 0.123457 A;")


def test_a_joint_is_asked_only_where_there_is_one():
    on = sensors(joint_rest=rig("knee").safety.sensors.joint_rest)
    assert on.safety.sensors.joint_rest is not None and on.joint is None
    assert asked(on).done and asked(on).refusal is None


def test_a_supply_that_the_rig_file_does_not_give_is_not_asked():
    row = (
        "  - {name: supply_pressure_pa, entry: analog_in.ch3, port: supply_gauge_pa, reads: gauge,"
        " calibration: {native: [1 V, 5 V], value: [0 kPa, 1000 kPa]}}\n"
    )
    on = edited(
        "bench",
        ("  # encoder 1024 lines", row + "  # encoder 1024 lines"),
        ("    valves: {supply: 850 kPa gauge}\n", ""),
    )
    changed = on.safety.sensors.model_copy(update={"supply": "supply_pressure_pa"})
    safety = on.safety.model_copy(update={"sensors": changed})
    check = asked(on.model_copy(update={"safety": safety}))
    assert check.done and check.refusal is None


@pytest.mark.parametrize(("limits", "band"), [("[-500 N, 350 N]", 20.0), ("[-40 N, 350 N]", 14.0)])
@pytest.mark.parametrize("law", [True, False])
def test_the_band_of_a_cell_is_of_its_larger_limit_on_either_side_of_zero(limits, band, law):
    edits = [("limits: [-40 N, 350 N]", f"limits: {limits}")]
    edits += [] if law else [("    law: {", "    # law: {")]
    on = edited("bench", *edits)
    sides = (-1.0,) if law else (1.0, -1.0)  # above zero its own law lets a muscle pull
    for sign in sides:
        assert asked(on, **{FORCE: sign * (band - 0.1)}).refusal is None
        refusal = asked(on, **{FORCE: sign * (band + 0.1)}).refusal
        assert refusal[1] == FORCE and "home again" not in refusal[2]


def test_the_zero_of_travel_is_suspected_once_a_locked_braid_must_pull():
    """20 N/mm beyond the locked length and its band of 2 mm: half a newton at 25 um."""
    on = edited("bench", ("lock_length: 145 mm", "lock_length: 145 mm, locked_length: 145 mm"))
    for beyond_m, named in ((-25e-6, False), (25e-6, True)):
        refusal = asked(on, **{TRAVEL: 0.147 - 0.120 + beyond_m, FORCE: -30.0}).refusal
        assert refusal[1] == FORCE
        assert refusal[2].endswith(", the zero of motor_travel_m (home again)") is named


def test_a_loop_that_is_slower_than_an_average_takes_every_cycle_for_one():
    on = rig("bench").model_copy(update={"period": 0.5})
    assert not asked(on, 1).done and asked(on, 2).done

"""What a vented, unpowered rig must read: sound readings pass, each lie is found and named."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.safety.at_rest import CAUSE, AtRest
from tests.safety.safety_bench import edited, rig

NAMES = ("bench", "bench_analog", "knee", "mass")


def at_rest(on) -> dict[str, float]:
    """Readings of a sound rig at rest."""
    measured = {row.name: 0.0 for row in on.inputs}
    measured |= {muscle.pressure: on.atmosphere_pa for muscle in on.muscles}
    if on.joint:
        measured[on.joint.position] = on.safety.sensors.joint_rest.at
    return measured


def asked(on, changes=None, cycles=200, bus_ok=True) -> AtRest:
    """The check after bring-up; ``changes``: name to offset, or to a function of the cycle."""
    check, sound = AtRest(on), at_rest(on)
    for cycle in range(cycles):
        measured = dict(sound)
        for name, change in (changes or {}).items():
            measured[name] += change(cycle) if callable(change) else change
        check.step(measured, bus_ok)
    return check


@pytest.mark.parametrize("name", NAMES)
@given(st.data())
def test_what_lies_within_its_hint_is_passed_without_a_word(name, data):
    on = rig(name)
    bands = {m.pressure: on.safety.sensors.vented_hint for m in on.muscles}
    bands[on.motor.current] = on.safety.sensors.current_zero_hint
    for row in on.inputs:
        if row.si_unit == "N":
            bands[row.name] = on.safety.sensors.unloaded_hint * row.limits[1]
    share = st.floats(-0.99, 0.99)
    check = asked(on, {row: data.draw(share) * band for row, band in bands.items()})
    assert check.done and check.refusal is None and check.hints == []


@pytest.mark.parametrize(
    ("name", "row", "wrong", "words"),
    [
        ("bench", "muscle_pressure_pa", -40e3, "-40.0 kPa gauge with muscle vented"),
        ("bench", "muscle_force_n", 100.0, "+100.0 N"),
        ("bench", "muscle_force_n", -15.0, "-15.0 N"),
        ("bench_analog", "motor_current_a", 0.5, "without power"),
        ("knee", "ppam_pressure_pa", 9e3, "cmd_ppam_exhaust_open"),
        ("knee", "knee_angle_rad", 0.14, "where the joint lies"),
        ("mass", "mass_position_m", -0.01, "where the joint lies"),
    ],
)
def test_a_reading_beyond_its_band_is_refused_and_named(name, row, wrong, words):
    cause, signal, sentence = asked(rig(name), {row: wrong}).refusal
    assert (cause, signal) == (CAUSE, row)
    assert words in sentence and "check" in sentence


def test_a_small_error_advises_to_calibrate():
    check = asked(rig("bench"), {"muscle_pressure_pa": 5e3})
    assert check.refusal is None
    kind, text, data = check.hints[0]
    assert kind == "hint" and "+5 kPa" in text and data["signal"] == "muscle_pressure_pa"


def test_the_first_of_several_is_named():
    check = asked(rig("bench"), {"muscle_pressure_pa": 1e4, "muscle_force_n": 100.0})
    assert check.refusal[1] == "muscle_pressure_pa"


def test_a_muscle_that_still_vents_is_waited_for():
    def vents(cycle: int) -> float:
        return 3e5 * math.exp(-cycle / 200.0)

    assert not asked(rig("bench"), {"muscle_pressure_pa": vents}, cycles=500).done
    later = asked(rig("bench"), {"muscle_pressure_pa": vents}, cycles=3000)
    assert later.done and later.refusal is None


def test_a_muscle_that_never_vents_is_refused_after_the_wait():
    check = asked(rig("bench"), {"muscle_pressure_pa": lambda cycle: 1e5 + 30.0 * cycle}, 4999)
    assert not check.done
    check = asked(rig("bench"), {"muscle_pressure_pa": lambda cycle: 1e5 + 30.0 * cycle}, 5000)
    assert check.done and check.refusal[1] == "muscle_pressure_pa"


def test_old_values_do_not_count():
    assert not asked(rig("bench"), bus_ok=False).done


def test_a_stretched_muscle_may_pull_by_its_rubber_and_a_locked_one_as_it_likes():
    stretched = {"motor_travel_m": 0.020, "muscle_force_n": 13.0}
    assert asked(rig("bench"), stretched).refusal is None
    assert asked(rig("bench"), stretched | {"muscle_force_n": 40.0}).refusal is not None
    assert asked(rig("bench"), {"motor_travel_m": 0.026, "muscle_force_n": 60.0}).refusal is None


def test_a_channel_that_must_flicker_and_stands_is_refused():
    on = edited("bench", ("sensors: {", "sensors: {flicker: [muscle_force_n], "))
    assert asked(on).refusal[1:] == (
        "muscle_force_n",
        "muscle_force_n stood still to the count for 0.10 s; check its wire and its converter",
    )
    assert asked(on, {"muscle_force_n": lambda cycle: 0.2 * (cycle % 2)}).refusal is None
    worse = asked(on, {"muscle_pressure_pa": 1e4})
    assert worse.refusal[1] == "muscle_pressure_pa"


def test_a_supply_that_is_not_what_is_said_is_refused():
    row = (
        "  - {name: supply_pressure_pa, entry: analog_in.ch3, port: supply_gauge_pa, reads: gauge,"
        " calibration: {native: [1 V, 5 V], value: [0 kPa, 1000 kPa]}}\n"
    )
    on = edited(
        "bench",
        ("  # encoder 1024 lines", row + "  # encoder 1024 lines"),
        ("sensors: {", "sensors: {supply: supply_pressure_pa, "),
    )
    supply_pa = on.muscles[0].valves.supply
    assert asked(on, {"supply_pressure_pa": supply_pa}).refusal is None
    assert "regulator" in asked(on, {"supply_pressure_pa": 0.7 * supply_pa}).refusal[2]


def test_a_rig_that_says_little_is_asked_little():
    on = edited(
        "bench",
        ("    law: {", "    # law: {"),
        ("  current: motor_current_a\n", ""),
        ("    valves: {supply: 850 kPa gauge}\n", ""),
        ("    limits: [-40 N, 350 N]\n", ""),
    )
    assert asked(on, {"muscle_force_n": 100.0, "motor_current_a": 3.0}).refusal is None
    assert asked(on, {"muscle_pressure_pa": 1e4}).refusal is not None

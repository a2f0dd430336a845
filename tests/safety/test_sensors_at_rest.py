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


SUPPLY = (
    "  - {name: supply_pressure_pa, entry: analog_in.ch3, port: supply_gauge_pa, reads: gauge,"
    " calibration: {native: [1 V, 5 V], value: [0 kPa, 1000 kPa]}}\n"
)


def with_supply():
    """The bench with a sensor at the supply, which the rig file says is 951.325 kPa absolute."""
    return edited(
        "bench",
        ("  # encoder 1024 lines", SUPPLY + "  # encoder 1024 lines"),
        ("sensors: {", "sensors: {supply: supply_pressure_pa, "),
    )


def test_each_refusal_in_full():
    """Signal, figures with their units, and what to look at."""
    supply_pa = 951_325.0
    of = {
        "pressure": (rig("bench"), {"muscle_pressure_pa": -40e3}),
        "force": (rig("bench"), {"muscle_force_n": 100.0}),
        "locked": (rig("mass"), {"motor_travel_m": 0.010}),
        "current": (rig("bench"), {"motor_current_a": -0.5}),
        "joint": (rig("knee"), {"knee_angle_rad": 0.14}),
        "supply": (with_supply(), {"supply_pressure_pa": 0.7 * supply_pa}),
    }
    said = {name: asked(*what).refusal[2] for name, what in of.items()}
    assert said == {
        "pressure": "muscle_pressure_pa reads -40.0 kPa gauge with muscle vented, more than 8 kPa"
        " off; check the sensor (zero, calibration, wire), cmd_muscle_exhaust_open (does it open?),"
        " cmd_muscle_inlet_open (does it leak?)",
        "force": "muscle_force_n reads +100.0 N with the muscles vented, more than 14 N from what"
        " an unloaded cell may; check its zero, its wire, what pulls at it",
        "locked": "muscle_force_n reads +0.0 N with the muscles vented, more than 14 N from what an"
        " unloaded cell may; check its zero, its wire, what pulls at it, the zero of motor_travel_m"
        " (home again)",
        "current": "motor_current_a reads -0.500 A without power, more than 0.1 A; check its wire,"
        " its calibration, the drive's monitor",
        "joint": "knee_angle_rad reads -7.979 deg with the muscles vented, where the joint lies at"
        " -16 deg; check its calibration, its wire, what holds the joint",
        "supply": "supply_pressure_pa reads 666 kPa abs, where the rig file says 951 kPa abs; check"
        " the regulator, the sensor",
    }


def _slack():
    """The bench with a strap so long that no rubber pulls at rest."""
    return edited("bench", ("rest_length: 120 mm", "rest_length: 110 mm"))


@pytest.mark.parametrize(
    ("on", "row", "hint", "band", "words"),
    [
        (rig("bench"), "muscle_pressure_pa", 3e3, 8e3, "+3 kPa"),
        (rig("bench"), "motor_current_a", 0.03, 0.10, "+0.03 A"),
        (_slack(), "muscle_force_n", 3.5, 14.0, "+3.5 N"),
        (rig("mass"), "mass_position_m", 1.5e-3, 3e-3, "+1.5 mm"),
        (with_supply(), "supply_pressure_pa", 47566.25, 95132.5, "+47.6 kPa"),
    ],
)
def test_each_band_ends_where_it_says_and_its_hint_begins_there(on, row, hint, band, words):
    sound = 951_325.0 if row == "supply_pressure_pa" else 0.0

    def of(wrong: float) -> AtRest:
        others = {"supply_pressure_pa": 951_325.0} if on.safety.sensors.supply else {}
        return asked(on, others | {row: sound + wrong})

    assert of(0.999 * hint).hints == [] and of(0.999 * hint).refusal is None
    (kind, text, data), *more = of(1.001 * hint).hints
    assert (kind, text) == ("hint", f"{row} is {words} off at rest: calibrate it") and not more
    assert data == {"signal": row, "error": pytest.approx(1.001 * hint, rel=1e-6)}
    for sign in (-1.0, 1.0):
        assert of(0.999 * sign * band).refusal is None
        assert of(1.001 * sign * band).refusal[:2] == (CAUSE, row)


def test_a_pressure_just_at_its_band_passes_and_just_at_its_hint_is_not_named():
    assert asked(rig("bench"), {"muscle_pressure_pa": 8e3}).refusal is None
    assert asked(rig("bench"), {"muscle_pressure_pa": 3e3}).hints == []


def test_a_pressure_stands_where_it_changes_by_1_kpa_from_one_average_to_the_next():
    def falls(step_pa: float):
        return {"muscle_pressure_pa": lambda cycle: 6e3 - step_pa * (cycle // 50)}

    assert asked(rig("bench"), falls(1000.0), cycles=100).done
    assert not asked(rig("bench"), falls(1001.0), cycles=100).done
    assert asked(rig("bench"), falls(-1000.0), cycles=100).done


def test_two_averages_are_the_shortest_wait():
    on = edited("bench", ("sensors: {", "sensors: {wait: 10 ms, "))
    rises = {"muscle_pressure_pa": lambda cycle: 1e3 * cycle}
    assert not asked(on, rises, cycles=99).done
    assert asked(on, rises, cycles=100).done


def test_once_it_is_done_nothing_is_judged_again():
    check = asked(rig("bench"), {"muscle_pressure_pa": 5e3})
    assert check.done and len(check.hints) == 1
    bad = at_rest(rig("bench")) | {"muscle_pressure_pa": 5e5}
    for _ in range(300):
        check.step(bad, True)
    assert check.refusal is None and len(check.hints) == 1


@pytest.mark.parametrize("name", ["bench", "mass"])
@given(st.floats(-0.02, 0.03), st.floats(-0.035, 0.035), st.floats(-60.0, 200.0))
def test_an_unloaded_cell_reads_zero_or_what_a_vented_muscle_pulls(name, travel, joint, read):
    """By the law anew: rubber above the no-load length, 20 N/mm where the braid is locked."""
    on = rig(name)
    law = on.muscles[0].law
    length = law.rest_length + travel + (joint if name == "mass" else 0.0)
    no_load = law.braid_length / math.sqrt(3.0)
    high = law.rubber * max(length + law.length_band - no_load, 0.0)
    if law.lock_length and length > law.lock_length - law.length_band:
        high = math.inf
    braid, low = length - law.strap * max(read, 0.0), 0.0
    if law.locked_length and braid > law.locked_length + law.length_band:
        low = 2e4 * (braid - law.locked_length - law.length_band)
    beyond = max(low - read, read - high, 0.0)
    allowed = 0.04 * 350.0
    if abs(beyond - allowed) < 1e-6:
        return
    measured = {"motor_travel_m": travel, "muscle_force_n": read}
    if name == "mass":
        measured["mass_position_m"] = joint - on.safety.sensors.joint_rest.at
    refusal = asked(on, measured).refusal
    named = refusal is not None and refusal[1] == "muscle_force_n"
    assert named == (beyond > allowed)


def test_a_joint_that_may_lie_anywhere_is_not_asked():
    sensors = rig("knee").safety.sensors.model_copy(update={"joint_rest": None})
    safety = rig("knee").safety.model_copy(update={"sensors": sensors})
    on = rig("knee").model_copy(update={"safety": safety})
    check = AtRest(on)
    for _ in range(100):
        check.step(at_rest(rig("knee")) | {"knee_angle_rad": 0.4}, True)
    assert check.done and check.refusal is None

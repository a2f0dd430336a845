"""Pressure, force, current and joint against what moves them: sound signals pass, lies do not."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.safety.gas_watch import CAUSE, flow_share
from epa_rt.safety.in_motion import InMotion
from epa_rt.safety.motion_watch import JointWatch, TorqueWatch, travel_per_turn
from epa_rt.safety.muscle_law import geometry_of
from tests.safety.safety_bench import edited, rig

INLET, EXHAUST = "cmd_muscle_inlet_open", "cmd_muscle_exhaust_open"
PRESSURE, FORCE, CURRENT = "muscle_pressure_pa", "muscle_force_n", "motor_current_a"
ATMOSPHERE = 101_325.0
SHUT, FILL, VENT = {INLET: 0.0, EXHAUST: 0.0}, {INLET: 1.0, EXHAUST: 0.0}, {EXHAUST: 1.0}
POWER = {"cmd_drive_control_raw": 15.0, "cmd_drive_mode_raw": 8.0}


class Rig:
    """Signals in front of the checks; ``go`` runs cycles with functions of the cycle, or values."""

    def __init__(self, on="bench"):
        self.rig = rig(on) if isinstance(on, str) else on
        self.check = InMotion(self.rig)
        self.measured = {row.name: 0.0 for row in self.rig.inputs}
        self.measured |= {m.pressure: self.rig.atmosphere_pa for m in self.rig.muscles}
        self.outputs = {row.name: row.safe for row in self.rig.outputs}
        self.now_ns = 0

    def go(self, cycles: int, outputs: dict | None = None, bus_ok=True, **signals):
        """The first refusal with its cycle, or None."""
        self.outputs |= outputs or {}
        for cycle in range(cycles):
            for name, value in signals.items():
                self.measured[name] = value(cycle) if callable(value) else value
            self.now_ns += 1_000_000
            refusal = self.check.step(self.measured, self.outputs, bus_ok, self.now_ns)
            if refusal is not None:
                return cycle, refusal
        return None

    def found(self, cycles: int, outputs: dict | None = None, **signals) -> tuple[int, str, str]:
        """Cycle, signal and sentence of a refusal that must come."""
        cycle, (cause, signal, sentence) = self.go(cycles, outputs, **signals)
        assert cause == CAUSE and "check" in sentence
        return cycle, signal, sentence


def fills(start_pa=ATMOSPHERE, rate_pa_s=4e5):
    return lambda cycle: start_pa + rate_pa_s * 1e-3 * cycle


def held(pressure_pa=6e5, on="bench") -> Rig:
    """A rig whose muscle is shut in at a pressure."""
    found = Rig(on)
    assert found.go(round((pressure_pa - ATMOSPHERE) / 400.0), FILL, **{PRESSURE: fills()}) is None
    assert found.go(600, SHUT, **{PRESSURE: pressure_pa}) is None
    return found


def sound_pull(bench: Rig, travel_m: float) -> dict[str, float]:
    """Pressure and force of a sound muscle at a travel, by Boyle and equation (1)."""
    length, b, n = 0.120 + travel_m, 0.2078, 3.05

    def volume(at):
        return (b * b - at * at) * at

    pressure = 6e5 * volume(0.12) / volume(length)
    pull = (pressure - ATMOSPHERE) * (3 * length**2 - b * b) / (4 * math.pi * n * n)
    return {"motor_travel_m": travel_m, PRESSURE: pressure, FORCE: max(pull, 0.0)}


@settings(max_examples=25)
@given(
    st.floats(0.002, 0.013), st.floats(0.2, 1.5), st.floats(0.0, 6.28), st.integers(0, 2**31 - 1)
)
def test_a_sound_muscle_in_motion_is_never_refused(amplitude_m, hertz, phase, seed):
    import random

    noise, bench = random.Random(seed), held()
    bench.outputs |= POWER
    turn = 2 * math.pi * hertz
    start = 0.014 + amplitude_m * math.sin(phase)
    for cycle in range(3000):
        share = min(cycle / 1000.0, 1.0)
        angle = turn * 1e-3 * max(cycle - 1000, 0) + phase
        travel = share * (0.014 + amplitude_m * math.sin(angle)) if cycle > 1000 else share * start
        signals = sound_pull(bench, travel)
        speed = amplitude_m * turn * math.cos(angle) if cycle > 1000 else start
        signals[PRESSURE] += noise.gauss(0.0, 600.0)
        friction_a = math.copysign(0.2, speed) + noise.gauss(0.0, 0.005)
        signals |= {
            CURRENT: signals[FORCE] * travel_per_turn(bench.rig) / 0.0448 + friction_a,
            "motor_speed_m_s": speed,
            FORCE: signals[FORCE] + noise.gauss(0.0, 1.0),
        }
        bench.measured |= signals
        assert bench.check.step(bench.measured, bench.outputs, True) is None


def test_a_pressure_that_stays_while_its_inlet_is_open_is_found_in_a_quarter_second():
    cycle, signal, sentence = Rig().found(1000, FILL)
    assert cycle < 250 and signal == PRESSURE
    assert "stays at 101.3 kPa abs" in sentence and "frozen" in sentence and "exchanged" in sentence


def test_pulses_that_never_raise_the_pressure_add_up():
    bench, after = held(), {}
    for _ in range(8):
        after = bench.go(60, FILL) or bench.go(600, SHUT)
        if after:
            break
    assert after and after[1][1] == PRESSURE


def test_pulses_that_do_their_work_are_passed():
    bench, pressure = held(), 6e5
    for _ in range(12):
        assert bench.go(40, FILL, **{PRESSURE: fills(pressure, 3e5)}) is None
        pressure += 12e3
        assert bench.go(600, SHUT, **{PRESSURE: pressure}) is None
        pressure -= 12e3
        assert bench.go(200, VENT, **{PRESSURE: fills(pressure + 12e3, -6e4)}) is None
        bench.outputs[EXHAUST] = 0.0
        assert bench.go(400, SHUT, **{PRESSURE: pressure}) is None


def test_near_the_supply_an_open_inlet_need_not_raise():
    bench = held(9e5)
    assert bench.go(2000, FILL, **{PRESSURE: 9e5}) is None


@pytest.mark.parametrize("slow", [False, True])
def test_a_fill_that_slows_like_one_near_the_supply_reads_low(slow):
    supply_pa = 951_325.0

    def curve(gain):
        pressure, out = ATMOSPHERE, []
        for _ in range(3000):
            pressure += 500.0 * flow_share(pressure / supply_pa)
            out.append(ATMOSPHERE + gain * (pressure - ATMOSPHERE))
        return out

    read = curve(0.7 if slow else 1.0)
    bench = Rig()
    found = bench.go(2400, FILL, **{PRESSURE: lambda cycle: read[cycle]})
    if not slow:
        assert found is None
        return
    assert "fills as slowly as one near the supply" in found[1][2]
    assert read[found[0]] < 0.78 * supply_pa


@pytest.mark.parametrize("pause_ms", [0, 30])
def test_a_machine_that_stood_still_does_not_make_a_filling_fast(pause_ms):
    """What came in meanwhile took longer than its cycles say; later cycles are no slower for it."""
    supply_pa, pressure, read = 951_325.0, ATMOSPHERE, []
    for cycle in range(2400):
        times = 1 + pause_ms * (cycle in (150, 300))
        pressure += 500.0 * flow_share(pressure / supply_pa) * times
        read.append(pressure)
    bench = Rig()
    assert bench.go(150, FILL, **{PRESSURE: lambda c: read[c]}) is None
    bench.now_ns += pause_ms * 1_000_000
    assert bench.go(150, FILL, **{PRESSURE: lambda c: read[150 + c]}) is None
    bench.now_ns += pause_ms * 1_000_000
    assert bench.go(2100, FILL, **{PRESSURE: lambda c: read[300 + c]}) is None


def test_an_inlet_that_opened_before_pauses_has_its_time_to_fill_after_them():
    bench = held(3e5)
    for _ in range(3):
        assert bench.go(20, FILL, **{PRESSURE: 3e5}) is None
        bench.now_ns += 30 * 1_000_000
    assert bench.go(300, FILL, **{PRESSURE: fills(3e5)}) is None


@pytest.mark.parametrize("pause_ms", [30, 300])
def test_a_pause_as_a_valve_switches_is_no_time_that_it_had(pause_ms):
    """It may have switched as the pause ended: what then rises, falls or settles has its time."""
    bench, pause_ns = held(3e5), pause_ms * 1_000_000
    bench.now_ns += pause_ns
    assert bench.go(20, FILL, **{PRESSURE: 3e5}) is None
    assert bench.go(80, FILL, **{PRESSURE: fills(3e5)}) is None
    bench.now_ns += pause_ns
    after = {PRESSURE: lambda cycle: 324e3 + 300.0 * min(cycle, 40)}
    assert bench.go(400, SHUT, **after) is None
    bench.now_ns += pause_ns
    assert bench.go(20, VENT, **{PRESSURE: 336e3}) is None
    assert bench.go(300, VENT, **{PRESSURE: fills(336e3, -3e5)}) is None


@pytest.mark.parametrize(("late_ms", "refused"), [(0, True), (1, True), (2, False)])
def test_a_jump_is_judged_by_the_time_that_went_by(late_ms, refused):
    """6 kPa more each cycle: within 1 or 2 ms that is no filling, within 3 ms it is a fast one."""
    bench = Rig()
    assert bench.go(48, SHUT) is None
    found = None
    for cycle in range(50):
        bench.now_ns += late_ms * 1_000_000
        found = bench.go(1, FILL, **{PRESSURE: ATMOSPHERE + 6e3 * cycle})
        if found is not None:
            break
    assert (found is not None) is refused
    if refused:
        text = found[1][2]
        assert f"jumps by +48.0 kPa within {8 * (1 + late_ms)} ms" in text


def test_the_first_reading_of_a_clock_that_counts_from_1970_is_no_pause():
    bench = Rig()
    bench.now_ns = 1_800_000_000_000_000_000
    assert bench.go(600, SHUT) is None


def test_what_jumps_during_a_pause_jumps():
    bench = held()
    bench.now_ns += 30 * 1_000_000
    _, _, sentence = bench.found(20, SHUT, **{PRESSURE: 4e5})
    assert "jumps by -2" in sentence and "within 38 ms" in sentence


def test_a_pressure_that_was_not_heard_has_all_the_time_since_it_was():
    bench = Rig()
    assert bench.go(48, SHUT) is None
    assert bench.go(16, FILL, bus_ok=False) is None
    assert bench.go(8, FILL, **{PRESSURE: ATMOSPHERE + 45e3}) is None


def test_flow_share_is_one_when_choked_and_none_at_the_supply():
    assert flow_share(0.1) == flow_share(0.3) == 1.0
    assert flow_share(1.0) == flow_share(1.2) == 0.0
    assert 0.69 < flow_share(0.8) < 0.71


@pytest.mark.parametrize(
    ("rate", "words"), [(4e5, "rises to"), (-4e5, "falls to"), (-4e6, "jumps by")]
)
def test_gas_that_comes_or_goes_with_both_valves_shut(rate, words):
    cycle, signal, sentence = held().found(400, SHUT, **{PRESSURE: fills(6e5, rate)})
    assert cycle < 340 and signal == PRESSURE and words in sentence


def test_a_burst_is_found_within_a_tenth_of_a_second():
    cycle, _, sentence = held().found(
        300, SHUT, **{PRESSURE: lambda c: ATMOSPHERE + 5e5 * math.exp(-c / 100.0)}
    )
    assert cycle < 100 and "burst" in sentence


def test_a_pressure_that_rises_while_the_exhaust_is_open():
    bench = Rig()
    assert bench.go(300) is None
    cycle, _, sentence = bench.found(300, VENT, **{PRESSURE: fills()})
    assert cycle < 100 and "while cmd_muscle_exhaust_open is open" in sentence


def test_a_frozen_pressure_is_found_while_the_muscle_is_stretched():
    bench = held()
    way = lambda c: 0.013 - 0.012 * math.cos(c / 300.0)  # noqa: E731
    pull = lambda c: sound_pull(bench, way(c))[FORCE]  # noqa: E731
    _, signal, sentence = bench.found(6000, SHUT, motor_travel_m=way, **{FORCE: pull})
    assert signal == PRESSURE and "frozen" in sentence


def test_a_travel_that_moves_twice_as_far_as_it_reads():
    bench = held()
    true = lambda c: 0.012 - 0.012 * math.cos(c / 150.0)  # noqa: E731
    _, signal, sentence = bench.found(
        12000,
        SHUT,
        motor_travel_m=lambda c: 0.55 * true(c),
        **{
            PRESSURE: lambda c: sound_pull(bench, true(c))[PRESSURE],
            FORCE: lambda c: 0.6 * sound_pull(bench, true(c))[FORCE],
        },
    )
    assert signal == PRESSURE and "move further" in sentence


@pytest.mark.parametrize(("force", "words"), [(5.0, "at least"), (190.0, "at most")])
def test_a_force_outside_of_the_muscles_law(force, words):
    bench = held()
    sound = sound_pull(bench, 0.021)
    bench.go(300, SHUT, motor_travel_m=lambda c: 0.021 * c / 300)
    cycle, signal, sentence = bench.found(300, SHUT, **(sound | {FORCE: force}))
    assert signal == FORCE and words in sentence and "motor_travel_m" in sentence


def test_a_force_out_of_its_law_for_a_moment_or_while_venting_is_passed():
    bench = held()
    for _ in range(5):
        assert bench.go(80, SHUT, **{FORCE: 100.0}) is None
        assert bench.go(80, SHUT, **{FORCE: 0.0}) is None
    bench.outputs[EXHAUST] = 1.0
    assert bench.go(1000, VENT, **{FORCE: 100.0}) is None


def test_a_force_that_stands_to_the_count_while_the_muscle_moves():
    bench = held()

    def at(c):
        return sound_pull(bench, 0.015 + 0.003 * math.sin(c / 200.0))

    for c in range(300):
        bench.go(1, SHUT, **sound_pull(bench, 0.015 * c / 300))
    frozen = sound_pull(bench, 0.015)[FORCE]
    _, signal, sentence = bench.found(
        3000,
        SHUT,
        motor_travel_m=lambda c: at(c)["motor_travel_m"],
        **{PRESSURE: lambda c: at(c)[PRESSURE], FORCE: frozen},
    )
    assert signal == FORCE and "to the count" in sentence


def speeds(c):
    return 0.03 * math.sin(c / 60.0)


def test_a_current_that_is_dead_while_the_motor_turns_to_and_fro():
    bench = held()
    _, signal, sentence = bench.found(3000, POWER, motor_speed_m_s=speeds)
    assert signal == CURRENT and "i2t is blind" in sentence


@pytest.mark.parametrize(
    "outputs", [{"cmd_drive_control_raw": 0.0}, POWER | {"cmd_drive_mode_raw": 10.0}]
)
def test_a_motor_that_is_not_regulated_needs_no_current(outputs):
    bench = held()
    assert bench.go(3000, outputs, motor_speed_m_s=speeds) is None


def test_a_wired_drive_is_under_power_by_its_enable():
    bench = held(on="bench_analog")
    assert bench.go(3000, motor_speed_m_s=speeds) is None
    _, signal, _ = bench.found(3000, {"cmd_drive_enable": 1.0}, motor_speed_m_s=speeds)
    assert signal == CURRENT


@pytest.mark.parametrize(("current", "row"), [(1.2, FORCE), (0.06, CURRENT)])
def test_a_torque_that_does_not_fit_the_pull(current, row):
    bench = held()
    for c in range(300):
        bench.go(1, SHUT, **sound_pull(bench, 0.015 * c / 300))
    bench.measured |= sound_pull(bench, 0.015)
    _, signal, sentence = bench.found(
        20000,
        POWER,
        motor_speed_m_s=lambda c: 0.02 if c % 1000 < 500 else -0.02,
        **{CURRENT: current},
    )
    assert signal == row and "to and fro" in sentence


def both_shut(at_pa=3e5) -> Rig:
    """The knee with both muscles shut in."""
    knee = Rig("knee")
    names = [(m.inlet, m.exhaust, m.pressure) for m in knee.rig.muscles]
    filling = {row: float(row == inlet) for inlet, exhaust, _ in names for row in (inlet, exhaust)}
    rows = {pressure: fills() for *_, pressure in names}
    assert knee.go(round((at_pa - ATMOSPHERE) / 400), filling, **rows) is None
    shut = {row: 0.0 for inlet, exhaust, _ in names for row in (inlet, exhaust)}
    assert knee.go(600, shut, **{pressure: at_pa for *_, pressure in names}) is None
    return knee


@pytest.mark.parametrize(("filled", "rises"), [("spam", "ppam"), ("ppam", "spam")])
def test_exchanged_muscles_are_named(filled, rises):
    knee = both_shut()
    _, signal, sentence = knee.found(
        300, {f"cmd_{filled}_inlet_open": 1.0}, **{f"{rises}_pressure_pa": fills(3e5)}
    )
    assert signal == f"{filled}_pressure_pa" and "exchanged" in sentence


def test_a_muscle_that_is_filled_alone_is_passed():
    knee = both_shut()
    assert knee.go(300, {"cmd_spam_inlet_open": 1.0}, spam_pressure_pa=fills(3e5)) is None


def test_a_joint_that_goes_against_its_lever():
    knee = both_shut()
    lever = knee.rig.joint.lever_arm
    _, signal, sentence = knee.found(
        500, motor_travel_m=lambda c: 2e-5 * c, knee_angle_rad=lambda c: -1e-5 * c / lever
    )
    assert signal == "knee_angle_rad" and "other way" in sentence


def test_a_joint_beyond_its_resonance_is_passed():
    """A motor that swings ever further: its joint goes against it, and the lever says nothing."""
    knee = both_shut()
    lever, watch = knee.rig.joint.lever_arm, JointWatch(knee.rig, knee.rig.joint, 0.001)
    for c in range(5000):
        travel = 1e-6 * max(c - 300, 0) * math.sin(2.0 * math.pi * 3.5e-3 * c)
        knee.measured |= {"motor_travel_m": travel, "knee_angle_rad": -0.8 * travel / lever}
        assert watch.step(knee.measured, knee.outputs) is None


@pytest.mark.parametrize("share", [0.5, 0.0])
def test_a_joint_that_follows_or_does_not_answer_is_passed(share):
    knee = both_shut()
    joint = knee.rig.joint
    watch = JointWatch(knee.rig, joint, 0.001)
    for c in range(2000):
        travel = 2e-5 * max(c - 300, 0)
        knee.measured |= {
            "motor_travel_m": travel,
            "knee_angle_rad": share * travel / joint.lever_arm,
        }
        assert watch.step(knee.measured, knee.outputs) is None


def test_old_values_are_not_judged():
    assert Rig().go(2000, FILL, bus_ok=False) is None


def test_without_a_law_pressure_and_valves_alone_are_asked():
    on = edited(
        "bench",
        ("    law: {", "    # law: {"),
        ("    valves: {supply: 850 kPa gauge}\n", ""),
        ("  current: motor_current_a\n", ""),
    )
    assert held(on=on).go(500, SHUT, **{FORCE: 150.0, "motor_travel_m": 0.02}) is None
    assert Rig(on).found(1000, FILL)[1] == PRESSURE


def test_without_a_force_row_or_a_torque_constant_less_is_asked():
    on = edited(
        "bench", (", force: muscle_force_n}", "}"), ("  sensors: {torque_constant: 44.8 mNm/A}", "")
    )
    assert held(on=on).go(500, SHUT, **{FORCE: 150.0}) is None
    on = edited("bench", ("  sensors: {torque_constant: 44.8 mNm/A}", ""))
    assert held(on=on).go(500, POWER) is None


def test_the_geometry_stays_finite_beyond_what_a_braid_can_be():
    on = rig("bench")
    geometry = geometry_of(on.muscles[0], on)
    assert geometry.volume_ratio(0.0) == 1.0
    assert 0.0 < geometry.volume_ratio(1.0) == geometry.volume_ratio(0.9 * 0.2078)
    assert geometry.pull(-5e3, 0.10) == (pytest.approx(-8.0), pytest.approx(8.0))
    low, high = geometry.pull(5e5, 0.146)
    assert 0.0 < low < high == math.inf


def test_a_turn_of_the_motor_is_so_much_travel():
    assert travel_per_turn(rig("bench")) == pytest.approx(0.010 / 19)
    assert travel_per_turn(rig("knee")) == pytest.approx(0.017 / 19)


def test_heat_that_moves_the_pressure_beside_the_motion_is_no_lie():
    bench = held()
    for c in range(4000):
        signals = sound_pull(bench, 0.010 + 0.004 * math.sin(c / 150.0) if c > 300 else c / 3e4)
        signals[PRESSURE] *= 1.0 + 0.04 * math.sin(c / 330.0 + 1.0)
        assert bench.go(1, SHUT, **signals) is None


@pytest.mark.parametrize(("efficiency", "pull"), [(0.6, 60.0), (0.85, 30.0), (1.0, 0.0)])
def test_a_torque_that_gear_and_friction_explain_is_passed(efficiency, pull):
    on = rig("bench")
    watch, outputs = TorqueWatch(on, FORCE, 0.0448, 0.024), {row.name: 0.0 for row in on.outputs}
    measured = {FORCE: pull, CURRENT: 0.0, "motor_speed_m_s": 0.0}
    for i in range(1000):
        forth = i % 50 < 25
        torque = pull * travel_per_turn(on) * (1.0 / efficiency if forth else efficiency)
        measured["motor_speed_m_s"] = 0.02 if forth else -0.02
        measured[CURRENT] = torque / 0.0448 + (0.3 if forth else -0.3)
        assert watch.step(measured, outputs | POWER) is None


def test_a_position_that_is_no_drives_tells_no_travel_per_turn():
    on = rig("knee")
    joint = on.motor.model_copy(update={"position": "knee_angle_rad"})
    assert travel_per_turn(on.model_copy(update={"motor": joint})) == 0.0

"""What leaves after a trip: category 1 while drive, bus and position are sound, else category 0."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import NAMES, Bench, assert_may_stop, edited, rig

from epa_rt.safety.commands import CommandGate
from epa_rt.safety.stopping import BRAKING, OFF, SLOW_SHARE, Stopping

TRAVEL, SPEED, FORCE = "motor_travel_m", "motor_speed_m_s", "muscle_force_n"
ENABLED, QUICK_STOP = 0x0237, 0x0217  # status words, with bits that do not belong to the state
BRAKE_ROW = (
    "  # normally open: without current the muscle vents",
    (
        "  - {name: cmd_brake_open, entry: valves.ch4}\n"
        "  # normally open: without current the muscle vents"
    ),
)
BRAKE = ("  places: {no_load", "  brake: {output: cmd_brake_open}\n  places: {no_load")


def running(on="bench", says: int = ENABLED) -> Bench:
    return Bench(on).power_on(9, says)


def tripped(bench: Bench) -> dict:
    """Trips on something that leaves drive, bus and position alone."""
    bench.envelope.trip("recorder", "", "the disk is full", bench.cycle)
    return bench.check()


def category(bench: Bench) -> int:
    return bench.envelope.stopping.category


def why(bench: Bench) -> str:
    return bench.envelope.stopping.why


@pytest.mark.parametrize("name", NAMES)
def test_a_sound_rig_brakes_in_the_cycle_of_the_trip_and_holds(name):
    bench = running(name)
    before = dict(bench.gate.outputs)
    for _ in range(500):
        out = tripped(bench)
        assert_may_stop(bench.rig, before, out)
        before = dict(out)
    assert category(bench) == BRAKING and why(bench) == ""


@pytest.mark.parametrize("cause", ["measured", "command", "fault"])
def test_every_kind_of_trip_brakes_in_its_own_cycle(cause):
    bench = running()
    if cause == "measured":
        out = bench.check({"muscle_force_n": 999.0})
    elif cause == "command":
        out = bench.check(command={"cmd_muscle_inlet_open": math.nan})
    else:
        out = bench.envelope.check(
            1, True, bench.measured, 0, 0, bench.command, 0, ("valve", "x", "stuck")
        )
        assert bench.trip[:3] == ("valve", "x", "stuck")
    assert out["cmd_drive_control_raw"] == 0x02 and out["cmd_drive_mode_raw"] == 9


def test_what_the_gate_refuses_is_the_cause_before_what_was_found_above():
    bench = running()
    bench.envelope.check(
        1,
        True,
        bench.measured,
        0,
        0,
        bench.command | {"cmd_drive_control_raw": 99},
        0,
        ("x", "", "y"),
    )
    assert bench.trip.cause == "bad command"


@pytest.mark.parametrize("name", NAMES)
def test_without_power_there_is_nothing_to_brake_with(name):
    bench = Bench(name)
    assert tripped(bench) == bench.safe and category(bench) == OFF and why(bench) == ""


@pytest.mark.parametrize("state", [0x27, 0x07])
@pytest.mark.parametrize("extra", [0, 0x0200, 0x1690])
def test_a_drive_that_says_it_has_power_brakes(state, extra):
    bench = running(says=state | extra)
    assert tripped(bench)["cmd_drive_control_raw"] == 0x02


@pytest.mark.parametrize("status", [0x00, 0x40, 0x21, 0x23, 0x0F, 0x08, 0x0218, 0xFFFF])
def test_a_drive_that_says_otherwise_is_let_go_for_good(status):
    bench = running()
    tripped(bench)
    bench.measured["drive_status_raw"] = status
    assert bench.check() == bench.safe and category(bench) == OFF
    assert f"status word 0x{status:04X}" in why(bench)
    bench.measured["drive_status_raw"] = ENABLED
    assert bench.check() == bench.safe


@pytest.mark.parametrize("status", [math.nan, math.inf, -1.0, 65536.0, 65536.0 + 0x27])
def test_a_status_that_is_no_word_is_no_word_of_power(status):
    bench = running()
    tripped(bench)
    assert bench.check({"drive_status_raw": status}) == bench.safe
    assert why(bench).endswith(f"(status word {status})")


def test_a_gap_says_nothing_and_a_lost_bus_ends_the_braking():
    bench = running()
    tripped(bench)
    for _ in range(2):
        out = bench.check({"drive_status_raw": 0, TRAVEL: math.nan}, bus_ok=False)
        assert out["cmd_drive_control_raw"] == 0x02
    assert bench.check()["cmd_drive_control_raw"] == 0x02  # the count begins anew
    bench.check(bus_ok=False)
    bench.check(bus_ok=False)
    assert category(bench) == BRAKING
    assert bench.check(bus_ok=False) == bench.safe
    assert why(bench) == "the working counter was wrong in 3 cycles in a row"


def test_a_bus_lost_by_and_by_before_the_trip_counts():
    bench = running()
    bench.check(bus_ok=False)
    bench.check(bus_ok=False)
    assert bench.check(bus_ok=False) == bench.safe and bench.trip.cause == "lost working counter"
    assert category(bench) == OFF


@pytest.mark.parametrize("how", ["invalid", "stale", "nan", "jump", "speed"])
def test_a_position_that_cannot_be_believed_ends_the_braking(how):
    bench = running()
    tripped(bench)
    bit = 1 << [row.name for row in bench.rig.inputs].index(TRAVEL)
    if how in ("invalid", "stale"):
        out = bench.check(**{how: bit})
    elif how == "speed":
        out = bench.check({SPEED: math.nan})
    else:
        out = bench.check({TRAVEL: math.nan if how == "nan" else 0.02})
    assert out == bench.safe and category(bench) == OFF and TRAVEL.split("_")[0] in why(bench)


def test_a_position_that_is_no_number_ends_it_without_a_row_of_the_speed_too():
    bench = running(edited("bench", ("  speed: motor_speed_m_s\n", "")))
    tripped(bench)
    assert bench.check({TRAVEL: math.nan}) == bench.safe
    assert why(bench) == f"{TRAVEL} cannot be believed"


def test_what_the_page_says_of_a_stop_is_so():
    assert (SLOW_SHARE, BRAKING, OFF) == (0.2, 1, 0)


def test_speeds_are_said_to_four_digits():
    bench = running(edited("bench", ("safety:", "safety:\n  stop_overspeed: 1.1")))
    tripped(bench)
    bench.check({SPEED: 0.1651234, TRAVEL: 0.16e-3})
    assert why(bench) == f"{SPEED} = 165.1 mm/s while it should brake, beyond 165 mm/s"
    bench, travel = running(), 0.0
    while category(bench) == BRAKING:
        travel += 0.0312345e-3
        bench.measured |= {SPEED: 0.0312345, TRAVEL: travel}
        tripped(bench)
    assert f"{SPEED} = 31.23 mm/s 171" in why(bench)


def test_another_sensor_that_is_lost_does_not():
    bench = running()
    tripped(bench)
    assert bench.check(invalid=1, stale=2)["cmd_drive_control_raw"] == 0x02


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({TRAVEL: 0.02}, "position jump"),
        ({TRAVEL: 0.2}, "over-travel"),
        ({TRAVEL: math.nan}, "NaN"),
    ],
)
def test_a_trip_by_the_position_itself_is_category_0_at_once(change, cause):
    bench = running()
    assert bench.check(change) == bench.safe and bench.trip.cause == cause
    assert TRAVEL in why(bench)


def test_the_operator_takes_the_power_off_at_once_also_while_it_brakes():
    bench = running()
    bench.envelope.trip("operator", "", "asked twice", 1)
    assert bench.check() == bench.safe and why(bench) == "asked twice"
    bench = running()
    tripped(bench)
    bench.envelope.trip("operator", "", "asked twice", 2)
    assert bench.trip.cause == "recorder"
    assert bench.check() == bench.safe and why(bench) == "asked twice"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_speed_far_beyond_its_limit_is_no_braking(sign):
    """1.2 times 150 mm/s; the travel follows, so that the two agree."""
    for speed, brakes in ((0.1799, True), (0.1801, False)):
        bench = running()
        tripped(bench)
        out = bench.check({SPEED: sign * speed, TRAVEL: sign * speed * 1e-3})
        assert (out != bench.safe) == brakes
        if not brakes:
            said = f"{SPEED} = {sign * speed * 1e3:.4g} mm/s while it should brake, beyond 180 mm/s"
            assert why(bench) == said


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_drive_that_does_not_slow_down_in_its_time_is_let_go(sign):
    """20 ms and twice 150 mm/s at 2 m/s^2: 170 cycles; slow is a fifth of 150 mm/s."""
    for speed, brakes in ((0.15 * SLOW_SHARE, True), (0.15 * SLOW_SHARE + 1e-4, False)):
        bench = running()
        travel, cycles = 0.0, 0
        while cycles < 300 and category(bench) == BRAKING:
            travel += sign * speed * 1e-3
            bench.measured |= {SPEED: sign * speed, TRAVEL: travel}
            tripped(bench)
            cycles += 1
        assert cycles == (300 if brakes else 171)
        if not brakes:
            said = f"the drive does not stop the motor: {SPEED} = {sign * speed * 1e3:.4g} mm/s"
            assert why(bench) == f"{said} 171 cycles after it was told to"


def test_bounds_of_braking_come_from_the_rig_file():
    bounds = "safety:\n  stop_time: 1\n  stop_overspeed: 1.0"
    on = edited(
        "bench", ("safety:", bounds), ("  places:", "  stop_deceleration: 5 m/s^2\n  places:")
    )
    bench, travel, cycles = running(on), 0.0, 0
    while category(bench) == BRAKING:
        travel += 0.1e-3
        bench.measured |= {SPEED: 0.1, TRAVEL: travel}
        tripped(bench)
        cycles += 1
    assert cycles == 20 + 30 + 1
    bench = running(on)
    tripped(bench)
    assert bench.check({SPEED: 0.1501, TRAVEL: 0.15e-3}) == bench.safe


def test_a_rig_without_a_row_of_its_speed_brakes_and_holds():
    bench = running(edited("bench", ("  speed: motor_speed_m_s\n", "")))
    for _ in range(500):
        assert tripped(bench)["cmd_drive_control_raw"] == 0x02


def test_a_rig_without_limits_of_its_speed_brakes_and_holds():
    bench = running(edited("bench", ("    limits: [-150 mm/s, 150 mm/s]\n", "")))
    bench.measured[SPEED] = 5.0
    for _ in range(500):
        assert tripped(bench)["cmd_drive_control_raw"] == 0x02


@pytest.mark.parametrize(
    ("limits", "longest"), [("[-300 mm/s, 150 mm/s]", 320), ("[-10 mm/s, 150 mm/s]", 170)]
)
def test_the_larger_of_two_limits_of_speed_counts(limits, longest):
    on = edited("bench", ("limits: [-150 mm/s, 150 mm/s]", f"limits: {limits}"))
    bench, travel, cycles = running(on), 0.0, 0
    while category(bench) == BRAKING:
        travel += 0.1e-3
        bench.measured |= {SPEED: 0.1, TRAVEL: travel}
        tripped(bench)
        cycles += 1
    assert cycles == longest + 1


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_wired_drive_runs_to_zero_by_its_slew_and_stays_enabled(sign):
    bench = running("bench_analog")
    speed = "cmd_motor_speed_m_s"
    for _ in range(10):
        bench.check(command={speed: sign * 0.0295})
    sent = [bench.gate.outputs[speed], *(tripped(bench)[speed] for _ in range(15))]
    steps = [abs(a - b) for a, b in zip(sent, sent[1:], strict=False)]
    assert max(steps) == pytest.approx(0.003) and steps[8] == pytest.approx(0.003)
    assert sent[10:] == [0.0] * 6 and sent[0] == pytest.approx(sign * 0.0295)
    assert bench.check()["cmd_drive_enable"] == 1.0


@pytest.mark.parametrize("mode", [9, 10])
def test_a_drive_on_the_bus_brakes_by_itself_and_has_no_target(mode):
    bench = Bench().power_on(mode, ENABLED)
    for _ in range(10):
        bench.check(command={"cmd_motor_speed_m_s": 0.02, "cmd_motor_torque_nm": 0.05})
    assert_may_stop(bench.rig, dict(bench.gate.outputs), tripped(bench))


def test_a_wired_drive_without_slew_is_told_zero_at_once():
    bench = running(edited("bench_analog", ("    slew: 3 m/s^2\n", "")))
    bench.check(command={"cmd_motor_speed_m_s": 0.05})
    assert tripped(bench)["cmd_motor_speed_m_s"] == 0.0


def test_targets_stay_where_they_were_while_it_brakes():
    bench = Bench().power_on(8, ENABLED)
    for i in range(20):
        travel = 1e-4 * i
        bench.check({TRAVEL: travel, SPEED: 0.1}, {"cmd_motor_travel_m": travel})
    bench.measured |= {TRAVEL: 1.9e-3, SPEED: 0.1}
    for _ in range(5):
        bench.measured[TRAVEL] += 1e-4
        assert (
            tripped(bench)["cmd_motor_travel_m"] == bench.gate.outputs["cmd_motor_travel_m"] > 1e-3
        )


def test_a_refused_mode_does_not_leave_with_the_quick_stop():
    bench = running()
    out = bench.check(command={"cmd_drive_mode_raw": 10})
    assert bench.trip.cause == "mode change" and out["cmd_drive_mode_raw"] == 9


def test_a_refused_command_that_would_have_had_power_does_not_count_as_power():
    bench = Bench()
    bench.measured["drive_status_raw"] = ENABLED
    command = {"cmd_drive_control_raw": 0x0F, "cmd_drive_mode_raw": 9, "cmd_motor_travel_m": 0.02}
    assert bench.check(command=command) == bench.safe
    assert bench.trip.cause == "jump at enable" and why(bench) == ""


def test_power_off_is_for_good_and_says_nothing():
    bench = running()
    tripped(bench)
    assert bench.envelope.power_off() == bench.safe
    assert bench.check() == bench.safe and why(bench) == ""
    bench.envelope.trip("operator", "", "asked twice", 9)
    assert why(bench) == "" and bench.envelope.power_off() == bench.safe


def braked() -> Bench:
    bench = running(edited("bench", BRAKE_ROW, BRAKE))
    bench.command["cmd_brake_open"] = 1.0
    bench.check()
    assert bench.trip is None
    return bench


def test_a_brake_stays_open_while_it_brakes_and_closes_before_power_goes():
    bench = braked()
    assert tripped(bench)["cmd_brake_open"] == 1.0
    bench.envelope.stopping.close_brake()
    out = bench.check()
    assert (out["cmd_brake_open"], out["cmd_drive_control_raw"]) == (0.0, 0x02)


def test_a_brake_closes_in_the_cycle_in_which_power_goes():
    bench = braked()
    tripped(bench)
    out = bench.check({"drive_status_raw": 0x08})
    assert out == bench.safe and out["cmd_brake_open"] == 0.0


def test_a_brake_that_was_closed_stays_closed():
    bench = running(edited("bench", BRAKE_ROW, BRAKE))
    assert tripped(bench)["cmd_brake_open"] == 0.0


@pytest.mark.parametrize("word", [0x00, 0x06, 0x07])
def test_a_brake_is_never_opened_without_power_nor_left_open(word):
    bench = Bench(edited("bench", BRAKE_ROW, BRAKE))
    bench.check()
    out = bench.check(command={"cmd_drive_control_raw": word, "cmd_brake_open": 1.0})
    assert out == bench.safe and bench.trip[:2] == ("forbidden combination", "cmd_brake_open")
    assert bench.trip.text == "cmd_brake_open on without power"
    bench = braked()
    out = bench.check(command={"cmd_drive_control_raw": word})
    assert bench.trip.cause == "forbidden combination"
    assert (out["cmd_brake_open"], out["cmd_drive_control_raw"]) == (1.0, 0x02)  # it still holds


def test_a_quick_stop_keeps_the_power_and_so_the_brake_open():
    bench = braked()
    for _ in range(3):
        out = bench.check(command={"cmd_drive_control_raw": 0x02})
        assert bench.trip is None and out["cmd_brake_open"] == 1.0
    assert tripped(bench)["cmd_brake_open"] == 1.0 and category(bench) == BRAKING
    bench = braked()
    bench.check(command={"cmd_drive_control_raw": 0x02})
    bench.check(command={"cmd_drive_control_raw": 0x00, "cmd_brake_open": 0.0})
    bench.check(command={"cmd_drive_control_raw": 0x02})
    assert bench.trip.cause == "forbidden combination"


def test_a_trip_after_a_quick_stop_that_was_asked_for_goes_on_with_it():
    bench = running()
    bench.check(command={"cmd_drive_control_raw": 0x02})
    bench.check(command={"cmd_drive_control_raw": 0x02})
    assert tripped(bench)["cmd_drive_control_raw"] == 0x02
    never = Bench()
    never.measured["drive_status_raw"] = ENABLED
    never.check(command={"cmd_drive_control_raw": 0x02})
    assert tripped(never) == never.safe


def test_a_brake_does_not_open_in_the_cycle_in_which_power_comes():
    bench = Bench(edited("bench", BRAKE_ROW, BRAKE))
    bench.command |= {"cmd_drive_mode_raw": 9, "cmd_drive_control_raw": 0x0F, "cmd_brake_open": 1.0}
    assert bench.check() == bench.safe and bench.trip.cause == "forbidden combination"


def test_closing_no_brake_does_nothing():
    bench = running()
    tripped(bench)
    bench.envelope.stopping.close_brake()
    assert set(bench.check()) == set(bench.safe)


@settings(max_examples=50)
@given(
    st.lists(
        st.tuples(
            st.booleans(),
            st.sampled_from([0x27, 0x07, 0x08, 0x40]),
            st.sampled_from([0, 1, 1 << 2]),
            st.floats(-0.2, 0.2),
        ),
        max_size=30,
    )
)
def test_category_0_is_latched_and_nothing_else_than_the_two_leaves(cycles):
    bench = running()
    before, is_off = dict(tripped(bench)), False
    for bus_ok, status, invalid, speed in cycles:
        out = bench.check(
            {"drive_status_raw": status, SPEED: speed}, bus_ok=bus_ok, invalid=invalid
        )
        is_off = is_off or out == bench.safe
        if is_off:
            assert out == bench.safe and category(bench) == OFF and why(bench)
        else:
            assert_may_stop(rig("bench"), before, out)


@pytest.mark.parametrize("slew", ["3", "0.1"])
def test_a_wired_drive_has_the_time_that_its_own_slew_takes(slew):
    """It follows its command down: that is braking, however soft the rig file makes it."""
    soft = edited("bench_analog", ("slew: 3 m/s^2", f"slew: {slew} m/s^2"))
    stopping, gate = Stopping(soft), CommandGate(soft)
    gate.outputs |= {"cmd_drive_enable": 1.0, "cmd_motor_speed_m_s": 0.07}
    stopping.begin(gate, True)
    measured = {row.name: 0.0 for row in soft.inputs} | {"motor_speed_m_s": 0.07}
    for _ in range(1000):
        out = stopping.step(measured, True, "", 0, 0)
        assert stopping.category == BRAKING, stopping.why
        measured["motor_speed_m_s"] = out["cmd_motor_speed_m_s"]
    assert measured["motor_speed_m_s"] == 0.0 and out["cmd_drive_enable"] == 1.0

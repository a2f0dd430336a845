"""Limits and slew, counted exactly; words, switches and combinations that never leave."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import NAMES, Bench, edited, rig

SPEED, TORQUE, TRAVEL = "cmd_motor_speed_m_s", "cmd_motor_torque_nm", "cmd_motor_travel_m"
ROWS = [(name, row.name) for name in NAMES for row in rig(name).outputs if row.limits]


def expected(row, period_s: float, last: float, value: float) -> tuple[float, bool, bool]:
    """What leaves, whether slew cut it, whether a limit did: by sorting, where the gate
    compares.
    """
    step = (row.slew or math.inf) * period_s
    slewed = sorted((last - step, value, last + step))[1]
    sent = sorted((row.limits[0], slewed, row.limits[1]))[1]
    return sent, slewed != value, sent != slewed


def test_a_row_without_slew_goes_at_once_and_is_only_clamped():
    on = edited("bench", ("    slew: 10 Nm/s\n", ""))
    bench = Bench(on).power_on(10)
    assert bench.check(command={TORQUE: 5.0})[TORQUE] == 0.170
    assert bench.check(command={TORQUE: -0.170})[TORQUE] == -0.170
    assert bench.check(command={TORQUE: -5.0})[TORQUE] == -0.170
    assert bench.check(command={TORQUE: 0.170})[TORQUE] == 0.170
    assert (bench.gate.clamped[TORQUE], bench.gate.slewed[TORQUE]) == (2, 0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_row_with_slew_ends_at_its_limit(sign):
    bench = Bench().power_on(9)
    sent = [bench.check(command={SPEED: sign * 0.2})[SPEED] for _ in range(40)]
    assert sent[25] == pytest.approx(sign * 0.078) and sent[26:] == [sign * 0.080] * 14
    assert (bench.gate.slewed[SPEED], bench.gate.clamped[SPEED]) == (40, 14)


def test_slew_is_per_second_not_per_cycle():
    on = edited("bench", ("period: 1 ms", "period: 4 ms"))
    assert Bench(on).power_on(9).check(command={SPEED: 1.0})[SPEED] == pytest.approx(3.0 * 0.004)


@pytest.mark.parametrize("row", [row.name for row in rig("bench").outputs])
def test_nan_is_refused_in_every_row(row):
    bench = Bench().power_on()
    assert bench.check(command={row: math.nan}) == bench.safe
    assert bench.trip.signal == row and bench.trip.cycle == 1
    if rig("bench").row(row).limits:
        assert (bench.trip.cause, bench.trip.text) == ("NaN command", f"{row} is not a number")
    else:
        assert bench.trip.cause == "bad command"


@pytest.mark.parametrize(
    ("row", "allowed"),
    [("cmd_drive_control_raw", [0, 2, 6, 7, 15, 128]), ("cmd_drive_mode_raw", [0, 8, 9, 10])],
)
def test_only_known_words_and_modes_leave(row, allowed):
    for word in range(-10, 0x200):
        bench = Bench()
        out = bench.check(
            command=(
                {"cmd_drive_mode_raw": 8, row: word} if row != "cmd_drive_mode_raw" else {row: word}
            )
        )
        if word in allowed:
            assert bench.trip is None and out[row] == word
        else:
            assert out == bench.safe
            assert bench.trip == (
                "bad command",
                row,
                f"{row} = {word}, expected one of {allowed}",
                0,
            )


@pytest.mark.parametrize("value", [0.5, 2.0, -1.0, math.inf, 1.0000001])
def test_a_switch_is_on_or_off(value):
    bench = Bench()
    assert bench.check(command={"cmd_muscle_inlet_open": value}) == bench.safe
    assert bench.trip == (
        "bad command",
        "cmd_muscle_inlet_open",
        f"cmd_muscle_inlet_open = {value!r}, expected 0 or 1",
        0,
    )


@pytest.mark.parametrize(
    ("name", "muscle"), [("bench", 0), ("knee", 0), ("knee", 1), ("bench_analog", 0)]
)
def test_inlet_and_exhaust_are_never_open_together(name, muscle):
    valves = rig(name).muscles[muscle]
    for inlet, exhaust in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)):
        bench = Bench(name)
        out = bench.check(command={valves.inlet: inlet, valves.exhaust: exhaust})
        if inlet and exhaust:
            assert out == bench.safe
            assert bench.trip == (
                "forbidden combination",
                valves.inlet,
                f"{valves.inlet} and {valves.exhaust} on together",
                0,
            )
        else:
            assert bench.trip is None and (out[valves.inlet], out[valves.exhaust]) == (
                inlet,
                exhaust,
            )


def test_the_rig_file_can_forbid_more():
    on = edited(
        "knee",
        (
            "  lost_cycles: 3",
            "  lost_cycles: 3\n  never_together: [[cmd_spam_inlet_open, cmd_ppam_inlet_open]]",
        ),
    )
    shut = {"cmd_spam_exhaust_open": 0.0, "cmd_ppam_exhaust_open": 0.0}
    bench = Bench(on)
    bench.check(command=shut | {"cmd_spam_inlet_open": 1.0})
    assert bench.trip is None
    bench.check(command=shut | {"cmd_spam_inlet_open": 1.0, "cmd_ppam_inlet_open": 1.0})
    assert bench.trip.text == "cmd_spam_inlet_open and cmd_ppam_inlet_open on together"


def test_after_a_refusal_the_safe_outputs_are_not_the_half_written_ones():
    bench = Bench()
    out = bench.check(command={"cmd_muscle_inlet_open": 1.0, "cmd_muscle_exhaust_open": 1.0})
    assert out is not bench.gate.outputs and out == {
        row.name: row.safe for row in rig("bench").outputs
    }
    assert out["cmd_muscle_exhaust_open"] == 1.0 and out["cmd_muscle_inlet_open"] == 0.0


@pytest.mark.parametrize("broken", ["text", None, [], {}, object()])
def test_what_is_no_number_is_a_bad_command(broken):
    for row in ("cmd_motor_speed_m_s", "cmd_drive_control_raw", "cmd_muscle_inlet_open"):
        bench = Bench()
        assert bench.check(command={row: broken}) == bench.safe
        assert bench.trip.cause == "bad command"


@pytest.mark.parametrize("row", [row.name for row in rig("bench").outputs])
def test_a_command_that_lacks_a_row_is_a_bad_command(row):
    bench = Bench()
    del bench.command[row]
    assert bench.check() == bench.safe
    assert bench.trip == (
        "bad command",
        "",
        f"a command that cannot be read (KeyError: '{row}')",
        0,
    )
    assert bench.check() == bench.safe


@pytest.mark.parametrize(("name", "row_name"), ROWS)
@settings(max_examples=40)
@given(data=st.data())
def test_limits_and_slew_cut_and_count_exactly(name, row_name, data):
    row = rig(name).row(row_name)
    bench = Bench(name).power_on()
    low, high = row.limits
    values = st.one_of(
        st.floats(low, high),
        st.floats(3 * low - high, 3 * high - low),
        st.sampled_from([low, high, math.inf, -math.inf, 10**400]),
    )
    last, slewed, clamped = 0.0, 0, 0
    for value in data.draw(st.lists(values, max_size=40)):
        last, by_slew, by_limit = expected(row, rig(name).period_s, last, value)
        assert bench.check(command={row_name: value})[row_name] == last
        slewed, clamped = slewed + by_slew, clamped + by_limit
    assert bench.trip is None
    assert (bench.gate.slewed[row_name], bench.gate.clamped[row_name]) == (slewed, clamped)
    assert all(
        n == 0 for key, n in (bench.gate.slewed | bench.gate.clamped).items() if key != row_name
    )


@pytest.mark.parametrize("second", [1.0, 0.5, math.nan])
def test_what_was_refused_once_is_refused_again(second):
    """The gate alone, without the trip that latches: a refused switch must not count as judged."""
    bench = Bench()
    muscle = bench.rig.muscles[0]
    command = bench.safe | {muscle.inlet: 1.0, muscle.exhaust: second}
    first = bench.gate.pass_through(bench.measured, command)
    assert first is not None and bench.gate.pass_through(bench.measured, command) == first
    assert bench.gate.outputs == bench.safe

"""The guard of a drive that homes by itself: distance, home, force, current; one jump of count."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.config.rig import Zero
from epa_rt.config.rig_homing import index_way
from epa_rt.safety.index_guard import IndexGuard, Rise
from epa_rt.safety.recovery import RecoveryEnvelope, RecoveryGuard, leaving_homing
from tests.safety.safety_bench import Bench, rig

TRAVEL, SPEED, FORCE, CURRENT = (
    "motor_travel_m",
    "motor_speed_m_s",
    "muscle_force_n",
    "motor_current_a",
)
STATUS, HOMED = "drive_status_raw", 0x9637
ZERO = {
    "method": "index",
    "at": "10.27 mm",
    "direction": "increasing",
    "speed": "4 mm/s",
    "current": "1 A",
    "force": "20 N",
}
HOME, DT_S = 10.27e-3, 1e-3
HOMING = {"cmd_drive_mode_raw": 6, "cmd_drive_control_raw": 0x0F}
SEEKING = {"cmd_drive_mode_raw": 6, "cmd_drive_control_raw": 0x1F}


def rig_with(**zero):
    bench = rig("bench")
    given_zero = Zero(**{k: v for k, v in (ZERO | zero).items() if v is not None})
    motor = bench.motor.model_copy(update={"zero": given_zero})
    return bench.model_copy(update={"motor": motor})


class Seeking(Bench):
    """A bench in whose envelope the drive has been told to seek its index."""

    def __init__(self, started=True, **zero):
        super().__init__(rig_with(**zero))
        self.way = index_way(self.rig)
        self.guard = IndexGuard(self.rig, self.way)
        self.envelope = RecoveryEnvelope(self.rig, lambda i: f"row {i}", self.guard, True)
        self.measured[STATUS] = 0x0637
        self.command |= HOMING
        self.check()
        if started:
            self.command |= SEEKING
            self.check()
            self.check()

    def at(self, travel, **measured):
        """One cycle; the trip's cause, or None."""
        self.check({TRAVEL: travel, **measured})
        return self.trip and self.trip.cause


def moved_to(bench, travel):
    """There within the speeds that are allowed; nothing may trip on the way."""
    step = 2.0 * bench.way.speed * DT_S
    at = bench.guard.moved
    speed = math.copysign(2.0 * bench.way.speed, travel - at)
    while abs(travel - at) > step:
        at += math.copysign(step, travel - at)
        if bench.at(at, **{SPEED: speed}) is not None:
            return at
    bench.at(travel, **{SPEED: speed})
    return travel


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_from_its_start_the_motor_moves_by_a_turn_and_what_it_needs_to_stop(way):
    bench = Seeking()
    most = bench.way.most + bench.way.landing
    assert bench.way.turn < most < 1.5 * bench.way.turn
    reached = moved_to(bench, way * 2.0 * most)
    assert bench.trip.cause == "over-travel" and "since the start" in bench.trip.text
    assert most < abs(reached) < most + 2e-5


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_position_that_stands_does_not_hide_the_way(way):
    bench = Seeking()
    most, speed = bench.way.most + 2.0 * bench.way.landing, way * bench.way.speed
    cycles = next(k for k in range(1, 4000) if bench.at(0.0, **{SPEED: speed}) is not None)
    assert bench.trip.cause == "over-travel" and bench.trip.signal == SPEED
    assert most < cycles * abs(speed) * DT_S < most + 1e-5
    assert "since the start, more than 5.336 mm, and by motor_travel_m 0 m" in bench.trip.text


def test_before_homing_has_started_a_speed_is_no_way():
    bench = Seeking(started=False)
    for _ in range(3000):
        assert bench.at(0.0, **{SPEED: bench.way.speed}) is None


def test_the_count_that_is_set_is_travelled_over():
    bench = Seeking()
    moved_to(bench, 2e-3)
    assert bench.at(HOME + 1e-4, **{SPEED: 4e-3}) is None
    assert bench.guard.is_set and bench.guard.shift == pytest.approx(HOME + 1e-4 - 2e-3 - 4e-6)
    assert bench.guard.moved == pytest.approx(2e-3 + 4e-6)
    assert bench.at(HOME, **{SPEED: -4e-3}) is None
    seen = bench.guard.seen(bench.measured | {TRAVEL: HOME}, True, bench.gate.outputs)
    assert seen[TRAVEL] == pytest.approx(2e-3 - 1e-4 + 4e-6) and seen[FORCE] == 0.0


def test_a_count_set_while_the_bus_was_silent_is_taken_with_the_time_that_passed():
    bench = Seeking()
    moved_to(bench, 2e-3)
    bench.check({TRAVEL: 2e-3, SPEED: 4e-3}, bus_ok=False)
    bench.check({TRAVEL: 2e-3, SPEED: 4e-3}, bus_ok=False)
    assert bench.at(HOME, **{SPEED: 4e-3}) is None
    assert bench.guard.shift == pytest.approx(HOME - 2e-3 - 12e-6)


@pytest.mark.parametrize("started", [False, True])
def test_before_homing_has_started_a_jump_is_one(started):
    bench = Seeking(started)
    assert (bench.at(HOME) is None) == started
    assert bench.guard.has_started == bench.guard.is_set == started


def test_what_is_no_jump_sets_no_home():
    bench = Seeking(at="0 mm")  # home is near from the start
    moved_to(bench, 0.5 * bench.way.landing)
    assert not bench.guard.is_set and bench.guard.shift == 0.0 and bench.trip is None


def test_a_jump_elsewhere_is_named_with_the_home():
    bench = Seeking()
    assert bench.at(5e-3) == "position jump"
    assert "jumped by 5 mm to 5 mm while the drive homed, expected 10.27 mm" in bench.trip.text
    small = Seeking()
    assert small.at(0.9 * small.way.landing) == "position jump"  # left to the watch of motion
    assert "expected" not in small.trip.text


def test_only_one_jump_is_the_home():
    bench = Seeking()
    assert bench.at(HOME) is None
    assert bench.at(HOME - 0.6e-3) == "position jump"


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_from_home_the_motor_stays_within_its_landing(way):
    bench = Seeking()
    bench.at(HOME)
    for step in range(1, 1000):
        at = HOME + way * 8e-6 * step
        if bench.at(at, **{SPEED: way * 8e-3}) is not None:
            break
    assert bench.trip.cause == "over-travel" and "from the home that was set" in bench.trip.text
    assert bench.way.landing < abs(at - HOME) < bench.way.landing + 2e-5


def test_a_home_that_the_drive_does_not_confirm_is_none():
    for status, cause in ((0x0637, "position jump"), (HOMED, None)):
        bench = Seeking()
        bench.at(HOME)
        for _ in range(round(bench.way.confirm_s / DT_S) - 2):
            assert bench.at(HOME) is None
        for _ in range(4):
            found = bench.at(HOME, **{STATUS: status})
        assert found == cause
    assert bench.trip is None


@pytest.mark.parametrize(
    ("row", "most", "cause"), [(CURRENT, 1.0, "over-current"), (FORCE, 20.0, "over-force")]
)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_force_and_current_may_not_leave_what_they_were(row, most, cause, way):
    bench = Seeking()
    for _ in range(200):
        assert bench.at(0.0, **{row: way * 0.98 * most}) is None
    for _ in range(200):
        found = bench.at(0.0, **{row: way * 1.02 * most})
    assert found == cause and "something is in the way" in bench.trip.text


def test_a_load_that_was_there_before_is_none_of_it():
    bench = Seeking(started=False)
    for _ in range(300):
        assert bench.at(0.0, **{FORCE: 100.0}) is None
    bench.command |= SEEKING
    for _ in range(300):
        assert bench.at(0.0, **{FORCE: 115.0}) is None
    assert bench.trip is None


def test_a_short_spike_is_none():
    bench = Seeking()
    for value in (0.0, 30.0, 0.0, 0.0):
        assert bench.at(0.0, **{FORCE: value}) is None


def test_without_a_force_in_the_rig_file_the_limits_of_its_row_hold():
    bench = Seeking(force=None)
    for _ in range(100):
        assert bench.at(0.0, **{FORCE: 340.0}) is None
    assert bench.at(0.0, **{FORCE: 351.0}) == "over-force"
    assert Seeking(current=None).at(0.0, **{CURRENT: 8.0}) is None


def test_its_speed_is_bounded_by_that_of_homing():
    bench = Seeking()
    assert bench.at(0.0, **{SPEED: 2.9 * bench.way.speed}) is None
    assert bench.at(0.0, **{SPEED: 3.1 * bench.way.speed}) == "over-speed"


@given(
    st.floats(-3e-3, 3e-3),
    st.lists(st.floats(-4e-3, 4e-3), min_size=1, max_size=40),
    st.integers(0, 39),
)
def test_whatever_the_count_becomes_travel_goes_on(start, speeds, at_cycle):
    """An oracle of its own: the way integrated, without any count."""
    of = rig_with()
    guard = IndexGuard(of, index_way(of))
    row = dict.fromkeys((r.name for r in of.inputs), 0.0) | {TRAVEL: start}
    outputs = {"cmd_drive_control_raw": 0x1F}
    true, count, shift = start, start, 0.0
    guard.seen(row, True, outputs)
    for cycle, speed in enumerate(speeds):
        true += speed * DT_S
        if cycle == at_cycle:
            shift = HOME - true
        count = true + shift
        seen = guard.seen(row | {TRAVEL: count, SPEED: speed}, True, outputs)
        assert seen[TRAVEL] == pytest.approx(true, abs=1e-9)
    assert guard.is_set == (at_cycle < len(speeds))


def test_a_rise_learns_until_homing_starts():
    rise = Rise("force_n", "over-force", "N", 5.0, 0.5)
    assert rise.step(10.0, False) is None and rise.step(10.0, False) is None
    assert rise.step(14.9, True) is None
    cause, name, text = rise.step(30.0, True)
    assert (cause, name) == ("over-force", "force_n") and "more than 5 N" in text


def test_the_plain_guard_looks_at_what_is_measured():
    guard = RecoveryGuard(rig("bench"), lambda measured: True, 1.0, 1.0)
    row = {TRAVEL: 1.0}
    assert guard.seen(row, True, {}) is row and not guard.follows_count


@pytest.mark.parametrize("ended", ["power_off", "trip"])
def test_every_way_out_takes_the_drive_out_of_its_homing_mode(ended):
    bench = Seeking()
    bench.measured[STATUS] = 0x0237
    if ended == "power_off":
        safe = bench.envelope.power_off()
    else:
        bench.check({SPEED: 0.013})
        braking = bench.check({SPEED: 0.013})
        assert braking["cmd_drive_mode_raw"] == 6  # no mode changes under power
        bench.envelope.trip("operator", "", "at once", 9)
        safe = bench.check({SPEED: 0.013})
    assert safe["cmd_drive_mode_raw"] == 9 and safe["cmd_drive_control_raw"] == 0
    assert {name: value for name, value in safe.items() if name != "cmd_drive_mode_raw"} == {
        name: value for name, value in bench.safe.items() if name != "cmd_drive_mode_raw"
    }


def test_a_wired_drive_has_no_mode_to_leave():
    wired = rig("bench_analog")
    assert [row.safe for row in leaving_homing(wired).outputs] == [
        row.safe for row in wired.outputs
    ]

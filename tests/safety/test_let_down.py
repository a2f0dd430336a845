"""The third kind of outputs after a trip: a load goes down slowly, under power, to its place."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import Bench, assert_may_let_down, assert_may_stop, edited

from epa_rt.safety.let_down import ARRIVED_S, AWAY_S, SETTLE, TOO_FAST, LetDown
from epa_rt.safety.stopping import BRAKING, OFF

TRAVEL, SPEED, FORCE, CURRENT = (
    "motor_travel_m",
    "motor_speed_m_s",
    "muscle_force_n",
    "motor_current_a",
)
STATUS, WORD = "drive_status_raw", "cmd_drive_control_raw"
ENABLED, HELD = 0x0237, 0x0217
PLACE = ("  places: {no_load: 0 mm, stretched: 28 mm}\n", "  places: {stretched: 28 mm}\n")


class Going:
    """A rig that trips where it stands, and a motor that does what leaves the envelope."""

    def __init__(self, on="bench", mode: int = 9, at: float = 0.02):
        self.bench = Bench(on)
        self.rig, self.at, self.speed = self.bench.rig, at, 0.0
        self.is_bus = self.rig.drive.interface == "cia402"
        self.bench.measured[TRAVEL] = at
        self.bench.command |= {
            name: at for name in [self.rig.motor.position_target] if name is not None
        }
        self.bench.check()  # without power the target follows the rig
        self.bench.power_on(mode, ENABLED)
        self.bench.envelope.trip("recorder", "", "the disk is full", 1)
        self.out = dict(self.bench.check())
        if self.is_bus:
            self.bench.measured[STATUS] = HELD
        self.stopping = self.bench.envelope.stopping

    def ask(self) -> "Going":
        self.stopping.ask_to_let_down()
        return self

    def cycle(self, change: dict | None = None, follows: bool = True, **more) -> dict:
        """One cycle; the motor then moves as it was told."""
        before, travel = self.out, self.at
        self.out = dict(
            self.bench.check({TRAVEL: self.at, SPEED: self.speed} | (change or {}), **more)
        )
        if self.lets_down:
            assert_may_let_down(self.rig, before, self.out, travel)
            if follows:
                self._move(before)
        return self.out

    def _move(self, before: dict) -> None:
        dt_s, motor = self.rig.period_s, self.rig.motor
        if self.is_bus and self.bench.measured[STATUS] == HELD:
            self.bench.measured[STATUS] = ENABLED
        if self.is_bus and self.out["cmd_drive_mode_raw"] == 8:
            target = self.out[motor.position_target]
            self.speed, self.at = (target - before[motor.position_target]) / dt_s, target
        else:
            self.speed = self.out[motor.speed_target]
            self.at += self.speed * dt_s

    def pushed(self, by: float, speed: float = 0.015) -> None:
        """Moved by something else, as far as the envelope lets it."""
        step, self.speed = math.copysign(speed * self.rig.period_s, by), math.copysign(speed, by)
        start = self.at
        while self.lets_down and abs(self.at - start) < abs(by):
            self.at += step
            self.cycle(follows=False)

    @property
    def lets_down(self) -> bool:
        return self.stopping.category == BRAKING and (
            self.out[WORD] == 0x0F if self.is_bus else self.stopping.let_down.targets != {}
        )

    def until_there(self, most: int = 20_000) -> int:
        for n in range(most):
            if self.stopping.let_down.arrived:
                return n
            self.cycle()
            assert self.stopping.category == BRAKING, self.stopping.why
        raise AssertionError("never there")

    def failed(self, sentence: str) -> bool:
        """Category 0, for good, with this sentence."""
        assert self.out == self.bench.safe and self.stopping.category == OFF
        assert self.cycle() == self.bench.safe
        return self.stopping.why == f"the motor cannot be let down: {sentence}"


@pytest.mark.parametrize(
    ("on", "mode"), [("bench", 8), ("bench", 9), ("bench_analog", 0), ("knee", 8), ("mass", 8)]
)
@pytest.mark.parametrize("at", [0.02, -0.005])
def test_it_goes_to_the_rest_place_and_stays_there(on, mode, at):
    going = Going(on, mode, at).ask()
    place = going.rig.motor.places[going.rig.motor.rest_place or "no_load"]
    fastest = going.rig.motor.let_down_speed_si
    cycles = going.until_there()
    assert abs(going.at - place) < 0.02 * ARRIVED_S * fastest + 1e-9
    least_s = abs(place - at) / fastest
    assert least_s < cycles * going.rig.period_s < least_s + 2.0
    for _ in range(3000):  # however long it stands there
        going.cycle()
    assert going.lets_down and abs(going.at - place) < 0.02 * ARRIVED_S * fastest + 1e-9


def test_until_it_is_asked_it_holds():
    going = Going()
    for _ in range(50):
        before = going.out
        assert_may_stop(going.rig, before, going.cycle())


def test_a_drive_that_holds_by_its_quick_stop_gets_its_targets_once_it_is_enabled():
    going = Going(mode=8).ask()
    for _ in range(20):
        out = going.cycle({STATUS: HELD}, follows=False)
        assert (out[WORD], out["cmd_motor_travel_m"]) == (0x0F, 0.02)
    going.bench.measured[STATUS] = ENABLED
    assert going.cycle()["cmd_motor_travel_m"] < 0.02


def test_a_drive_that_is_not_enabled_again_in_its_time_is_let_go():
    going = Going().ask()
    for _ in range(500):
        assert going.cycle({STATUS: HELD}, follows=False)[WORD] == 0x0F
    going.cycle({STATUS: HELD}, follows=False)
    assert going.failed("the drive is not enabled out of its quick stop")


def test_a_drive_that_leaves_operation_enabled_on_the_way_is_let_go():
    going = Going().ask()
    for _ in range(10):
        going.cycle()
    going.cycle({STATUS: HELD}, follows=False)
    assert going.failed("the drive left operation enabled")
    going = Going().ask()
    going.cycle()
    assert going.cycle({STATUS: 0x0218}) == going.bench.safe
    assert "says that it has no power" in going.stopping.why


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_motor_faster_than_it_was_let_down_is_let_go(sign):
    most = TOO_FAST * 0.007
    for speed, goes in ((most - 1e-5, True), (most + 1e-5, False), (math.nan, False)):
        going = Going().ask()
        going.cycle()
        going.cycle({SPEED: sign * speed}, follows=False)
        assert going.lets_down == goes
        if not goes and speed == speed:
            assert going.failed(f"{SPEED} = {sign * speed * 1e3:.4g} mm/s, beyond 21 mm/s")


def test_the_limit_of_speed_holds_where_it_is_the_smaller_one():
    on = edited("bench", ("  speed_max: 70", "  let_down_speed: 70 mm/s\n  speed_max: 70"))
    going = Going(on).ask()
    going.cycle()
    going.cycle({SPEED: 0.151}, follows=False)
    assert going.failed(f"{SPEED} = 151 mm/s, beyond 150 mm/s")


@pytest.mark.parametrize(
    ("edit", "fastest", "step"),
    [
        (("limits: [-80 mm/s, 80 mm/s]", "limits: [-80 mm/s, 5 mm/s]"), 0.005, 0.000025),
        (("limits: [-80 mm/s, 80 mm/s]", "limits: [-5 mm/s, 80 mm/s]"), 0.005, 0.000025),
        (("slew: 3 m/s^2", "slew: 0.02 m/s^2"), 0.007, 0.00002),
        (("    slew: 3 m/s^2\n", ""), 0.007, 0.000035),
    ],
)
def test_the_limits_and_the_slew_of_the_command_hold_without_the_gate(edit, fastest, step):
    going = Going(edited("bench_analog", edit), 0).ask()
    told = [0.0] + [abs(going.cycle()["cmd_motor_speed_m_s"]) for _ in range(1000)]
    assert max(told) == pytest.approx(fastest)
    steps = [b - a for a, b in zip(told, told[1:], strict=False)]
    assert max(steps) == pytest.approx(step) and told[1] == pytest.approx(step)


@pytest.mark.parametrize("at", [0.02, -0.005])
def test_a_motor_that_goes_the_other_way_is_let_go(at):
    going = Going(at=at).ask()
    going.cycle(follows=False)
    going.pushed(math.copysign(0.001, at))
    away = at + math.copysign(AWAY_S * 0.007 + 0.000005, at)
    assert going.at == pytest.approx(away, abs=0.000011)
    assert going.failed(f"{TRAVEL} = {going.at * 1e3:.4g} mm goes away from no_load (0 m)")


def test_away_counts_from_the_nearest_that_it_has_been_on_either_side():
    going = Going().ask()
    going.until_there()
    going.pushed(-0.001)
    assert going.at == pytest.approx(-0.0007, abs=0.00004)
    assert going.failed(f"{TRAVEL} = {going.at * 1e3:.4g} mm goes away from no_load (0 m)")
    going = Going().ask()
    for _ in range(1000):
        going.cycle()
    nearest = going.at
    assert nearest < 0.016
    going.pushed(0.001)
    assert going.at == pytest.approx(nearest + 0.0007, abs=0.00002)
    assert going.stopping.category == OFF and "goes away" in going.stopping.why


def test_a_motor_that_does_not_follow_its_target_is_let_go():
    going = Going(mode=8).ask()
    going.cycle()
    for _ in range(1000):
        if not going.lets_down:
            break
        going.cycle(follows=False)
    assert "does not follow" in going.stopping.why and "within 4 mm" in going.stopping.why
    assert going.out == going.bench.safe


def test_without_a_bound_on_following_and_under_a_speed_the_time_bounds_it():
    free = edited("bench", ("  following_error: 4 mm\n", ""))
    for going in (Going(free, 8).ask(), Going().ask()):
        cycles = 0
        going.cycle()
        while going.lets_down:
            going.cycle(follows=False)
            cycles += 1
        # twice 20 mm at 7 mm/s, the ramp, approach and settling; the drive's own time in front
        assert cycles == pytest.approx(500 + 2000 * (0.02 / 0.007 + 0.2 + 1.0), abs=2)
        assert going.failed(f"{TRAVEL} = 20 mm is not at no_load in time")


@pytest.mark.parametrize(
    ("row", "value", "span"), [(FORCE, 351.0, 390.0), (CURRENT, 9.1, 18.0), (FORCE, -41.0, 390.0)]
)
def test_force_and_current_stay_within_their_limits(row, value, span):
    going = Going().ask()
    going.cycle()
    low, high = going.rig.row(row).limits
    going.cycle({row: value})
    unit = row[-1].upper()
    assert going.failed(f"{row} = {value:g} {unit}, outside {low:g} to {high:g} {unit}")


@pytest.mark.parametrize(("start", "sign"), [(360.0, 1.0), (-50.0, -1.0)])
def test_a_force_that_began_outside_must_not_rise(start, sign):
    going = Going()
    going.bench.measured[FORCE] = start
    going.ask().cycle()
    going.cycle({FORCE: start + sign * 19.0})
    assert going.lets_down  # a twentieth of 390 N
    going.cycle({FORCE: start + sign * 20.0})
    assert going.stopping.category == OFF and FORCE in going.stopping.why


def test_a_row_that_cannot_be_believed_bounds_nothing():
    going = Going()
    bit = 1 << [row.name for row in going.rig.inputs].index(FORCE)
    going.ask()
    for _ in range(3):
        going.cycle({FORCE: math.nan}, invalid=bit)
    assert going.lets_down
    going = Going().ask()  # believed when it began, lost on the way
    going.cycle()
    going.cycle({FORCE: math.nan}, stale=bit)
    assert going.lets_down


def test_a_gap_keeps_the_targets_and_a_lost_bus_ends_it():
    going = Going()
    going.ask()
    going.cycle(bus_ok=False)
    assert going.out[WORD] == 0x02
    for _ in range(100):
        going.cycle()
    last = dict(going.out)
    for _ in range(2):
        assert going.cycle({SPEED: math.nan, TRAVEL: 9.0}, bus_ok=False) == last
    assert going.cycle(bus_ok=False) == going.bench.safe


def test_what_a_rig_lacks_is_said_and_it_holds_on():
    for going, why in (
        (Going(edited("bench", PLACE)), "the rig file has no motor.rest_place"),
        (Going(mode=10), "the drive was not under a target of position or speed"),
        (
            Going(edited("bench", ("  speed: motor_speed_m_s\n", ""))),
            "the rig has no row of the motor's speed to watch it by",
        ),
    ):
        assert going.stopping.refuses_to_let_down() == why
        going.ask()
        for _ in range(5):
            before = going.out
            assert_may_stop(going.rig, before, going.cycle())


def test_a_place_of_its_own_goes_before_no_load():
    on = edited("bench", ("  places: {no", "  rest_place: stretched\n  places: {no"))
    going = Going(on).ask()
    going.until_there()
    assert going.at == pytest.approx(0.028, abs=1e-5)


def test_without_a_zero_nothing_is_let_down():
    going = Going()
    going.stopping.has_zero = False
    assert going.stopping.refuses_to_let_down() == "travel has no zero"
    assert going.ask().cycle()[WORD] == 0x02


def test_a_closed_holding_brake_is_not_pulled_through():
    rows = (
        "  # normally open: without current the muscle vents",
        "  - {name: cmd_brake_open, entry: valves.ch4}\n"
        "  # normally open: without current the muscle vents",
    )
    brake = ("  places: {no_load", "  brake: {output: cmd_brake_open}\n  places: {no_load")
    on = edited("bench", rows, brake)
    going = Going(on)
    assert going.stopping.refuses_to_let_down() == "the holding brake is closed"
    bench = Bench(on).power_on(9, ENABLED)
    bench.command["cmd_brake_open"] = 1.0
    bench.check()
    bench.envelope.trip("recorder", "", "the disk is full", 1)
    bench.check()
    stopping = bench.envelope.stopping
    assert stopping.refuses_to_let_down() == ""
    stopping.ask_to_let_down()
    out = bench.check()
    assert (out["cmd_brake_open"], out[WORD]) == (1.0, 0x0F)
    stopping.close_brake()
    out = bench.check()
    assert (out["cmd_brake_open"], out[WORD]) == (0.0, 0x0F)


def test_a_load_that_does_not_go_down_trips_without_braking():
    bench = Bench().power_on(9, ENABLED)
    fault = ("let-down", TRAVEL, "the motor cannot be let down: x")
    assert (
        bench.envelope.check(1, True, bench.measured, 0, 0, bench.command, 0, fault) == bench.safe
    )
    assert bench.envelope.stopping.why == fault[2] and bench.trip.cause == "let-down"


def test_it_is_there_within_what_it_moves_in_a_twentieth_of_a_second():
    down = LetDown(Bench().rig)
    for travel, there in ((0.00034, True), (-0.00034, True), (0.00036, False), (-0.00036, False)):
        assert down.is_there({TRAVEL: travel}) is there


def test_a_slow_small_loop_and_a_fast_one_settle_by_their_own_time():
    for gain, cycles in ((5.0, 1000), (1000.0, 25)):
        on = edited("bench", ("position_gain: 10 1/s", f"position_gain: {gain:g} 1/s"))
        going = Going(on, 9, 0.0003).ask()  # within what counts as there
        assert going.until_there() == pytest.approx(cycles, abs=3), SETTLE


cycle_of = st.tuples(
    st.booleans(),  # asked to let down from here on
    st.sampled_from([True, True, True, False]),  # bus
    st.sampled_from([ENABLED, ENABLED, HELD, 0x0208]),
    st.sampled_from([0, 0, 0, 1, 1 << 2]),
    st.floats(-0.03, 0.03),
    st.sampled_from([1.0, 1.0, 0.0, 1.5]),  # how far the motor goes of what it was told
)


@settings(max_examples=80)
@given(
    st.sampled_from([("bench", 8), ("bench", 9), ("bench_analog", 0), ("bench", 10)]),
    st.floats(-0.009, 0.03),
    st.lists(cycle_of, min_size=1, max_size=40),
)
def test_after_a_trip_only_safe_stop_or_let_down_outputs_leave(rig_and_mode, at, cycles):
    """Whatever drive, bus and motor do; and safe outputs are for good."""
    going = Going(*rig_and_mode, at)
    motor = going.rig.motor
    is_off = False
    for asked, bus_ok, status, invalid, speed, share in cycles:
        if asked:
            going.ask()
        before, travel = going.out, going.at
        change = {SPEED: speed} | ({STATUS: status} if going.is_bus else {})
        out = going.cycle(change, follows=False, bus_ok=bus_ok, invalid=invalid)
        is_off = is_off or out == going.bench.safe
        if is_off:
            assert out == going.bench.safe and going.stopping.category == OFF
        elif not going.lets_down:
            assert_may_stop(going.rig, before, out)
        else:
            told = (
                out[motor.position_target] - before[motor.position_target]
                if going.is_bus and out["cmd_drive_mode_raw"] == 8
                else out[motor.speed_target] * going.rig.period_s
            )
            going.at = travel + share * told


def test_a_speed_that_is_not_believed_ends_it():
    going = Going().ask()
    for _ in range(50):
        going.cycle()
    assert going.stopping.category == BRAKING
    bit = 1 << [row.name for row in going.rig.inputs].index(SPEED)
    going.cycle(stale=bit)
    assert going.stopping.category == OFF and "cannot be believed" in going.stopping.why

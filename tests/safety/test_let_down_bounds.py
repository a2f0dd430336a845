"""Where each bound of letting a load down begins: at it goes on, beyond it ends with a sentence."""

import math

import pytest
from safety_bench import edited, rig

from epa_rt.config.rig import Rig
from epa_rt.safety.let_down import ARRIVED_S, AWAY_S, TOO_FAST, LetDown

TRAVEL, SPEED, FORCE, CURRENT, PRESSURE = (
    "motor_travel_m",
    "motor_speed_m_s",
    "muscle_force_n",
    "motor_current_a",
    "muscle_pressure_pa",
)
STATUS, ENABLED, HELD = "drive_status_raw", 0x0237, 0x0217
TARGET, TOLD = "cmd_motor_travel_m", "cmd_motor_speed_m_s"


class Down:
    """The motion alone, begun where the motor stands; ``step`` takes one cycle's changes."""

    def __init__(self, on: Rig | str = "bench", mode: float = 9.0, at: float = 0.02, **row: float):
        self.rig = rig(on) if isinstance(on, str) else on
        self.measured = dict.fromkeys((each.name for each in self.rig.inputs), 0.0)
        self.measured |= {TRAVEL: at, STATUS: ENABLED} | row
        self.down = LetDown(self.rig)
        self.mode = mode

    def begin(self, not_believed: int = 0) -> "Down":
        self.down.begin(self.measured, self.mode, not_believed)
        return self

    def step(self, not_believed: int = 0, **changes: float) -> str:
        return self.down.step(self.measured | changes, not_believed)

    def bit(self, name: str) -> int:
        return 1 << [row.name for row in self.rig.inputs].index(name)


def of_motor(on: str = "bench", **changes: object) -> Rig:
    motor = rig(on).motor.model_copy(update=changes)
    return rig(on).model_copy(update={"motor": motor})


def test_it_is_there_at_just_what_it_moves_in_a_twentieth_of_a_second():
    here, fastest = LetDown(rig("bench")), rig("bench").motor.let_down_speed_si
    assert here.is_there({TRAVEL: ARRIVED_S * fastest})
    assert here.is_there({TRAVEL: -ARRIVED_S * fastest})


def test_it_is_there_where_the_rest_place_is():
    here = LetDown(of_motor(rest_place="stretched"))
    assert here.is_there({TRAVEL: 0.028}) and not here.is_there({TRAVEL: -0.028})


@pytest.mark.parametrize("limits", ["[-15 mm/s, 150 mm/s]", "[-150 mm/s, 15 mm/s]"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_smaller_of_two_limits_of_speed_holds_either_way(limits, sign):
    on = edited("bench", ("limits: [-150 mm/s, 150 mm/s]", f"limits: {limits}"))
    assert Down(on).begin().step(**{SPEED: sign * 0.0149}) == ""
    assert (
        Down(on).begin().step(**{SPEED: sign * 0.0151})
        == f"{SPEED} = {sign * 15.1} mm/s, beyond 15 mm/s"
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_just_three_times_the_speed_is_not_too_fast(sign):
    most = TOO_FAST * rig("bench").motor.let_down_speed_si
    down = Down().begin()
    assert down.step(**{SPEED: sign * most}) == ""
    assert down.step(**{SPEED: sign * 0.0312345}) == (
        f"{SPEED} = {sign * 31.23} mm/s, beyond 21 mm/s"
    )
    slow = Down(of_motor(let_down_speed=0.00123456)).begin()
    assert slow.step(**{SPEED: 1.0}) == f"{SPEED} = 1 m/s, beyond 3.704 mm/s"


def test_just_so_far_away_is_not_away():
    fastest = rig("bench").motor.let_down_speed_si
    down = Down().begin()
    assert down.step(**{TRAVEL: 0.02 + AWAY_S * fastest}) == ""
    assert down.step(**{TRAVEL: 0.02 + AWAY_S * fastest + 1e-9}) == (
        f"{TRAVEL} = 20.7 mm goes away from no_load (0 m)"
    )
    on = of_motor(places={"no_load": 0.0123456, "stretched": 0.028})
    assert (
        Down(on)
        .begin()
        .step(**{TRAVEL: 0.0234567})
        .endswith("= 23.46 mm goes away from no_load (12.35 mm)")
    )


def test_a_motor_that_lags_by_just_its_following_error_follows():
    on = of_motor(following_error=2.0**-8)
    for lags, follows in ((2.0**-8, True), (2.0**-8 + 1e-9, False)):
        assert (Down(on, 8.0, 2.0**-6).begin().step(**{TRAVEL: 2.0**-6 - lags}) == "") is follows
    on = of_motor(following_error=0.00123456)
    assert Down(on, 8.0, 0.0212345).begin().step(**{TRAVEL: 0.0112345}) == (
        f"{TRAVEL} = 11.23 mm does not follow 21.23 mm within 1.235 mm"
    )


@pytest.mark.parametrize(("on", "patience"), [("bench", 500), ("bench_analog", 0)])
def test_a_motor_that_stands_has_twice_the_time_of_its_way_and_no_cycle_more(on, patience):
    """1.4 mm at 7 mm/s, 0.2 s of ramp, ten time constants; a wired drive is enabled at once."""
    down = Down(on, 9.0, 0.0014000004).begin()
    cycles = patience + 2 * (200 + 200 + 1000)
    assert {down.step() for _ in range(cycles)} == {""}
    assert down.step() == f"{TRAVEL} = 1.4 mm is not at no_load in time"


@pytest.mark.parametrize(
    ("row", "value"), [(FORCE, 350.0), (FORCE, -40.0), (CURRENT, 9.0), (CURRENT, -9.0)]
)
def test_a_row_at_its_limit_is_inside_and_gets_no_margin(row, value):
    down = Down(**{row: value}).begin()
    assert down.step(**{row: value}) == ""
    assert row in down.step(**{row: 1.001 * value})


def test_a_row_outside_is_said_with_its_bounds():
    down = Down(**{FORCE: 352.3456}).begin()
    assert down.step(**{FORCE: 378.9123}) == f"{FORCE} = 378.912 N, outside -40 to 371.846 N"
    down = Down(**{FORCE: -52.3456}).begin()
    assert down.step(**{FORCE: -78.9123}) == f"{FORCE} = -78.9123 N, outside -71.8456 to 350 N"


def test_only_force_and_current_are_bounded_and_only_where_they_have_limits():
    assert Down(**{PRESSURE: 2e6}).begin().step(**{PRESSURE: 3e6}) == ""
    on = edited("bench", ("    limits: [-40 N, 350 N]\n", ""))
    assert Down(on).begin().step(**{FORCE: 1e6}) == ""


def test_a_row_that_could_not_be_believed_at_the_beginning_bounds_nothing():
    down = Down(**{FORCE: math.nan})
    down.begin(down.bit(FORCE))
    assert down.step(**{FORCE: 999.0}) == ""


@pytest.mark.parametrize(
    "status", [math.nan, math.inf, -math.inf, -65536.0 + ENABLED, 65536.0 + ENABLED]
)
def test_a_status_that_is_no_word_is_not_enabled(status):
    down = Down().begin()
    assert down.step(**{STATUS: status}) == "" and down.down.targets == {TOLD: 0.0}
    assert down.step() == "" and down.down.targets[TOLD] < 0.0
    assert down.step(**{STATUS: status}) == "the drive left operation enabled"


def test_until_it_is_enabled_its_target_stands_where_the_motor_does():
    down = Down(mode=8.0, at=0.0123).begin()
    assert down.down.targets == {TARGET: 0.0123}
    assert down.step(**{STATUS: HELD}) == "" and down.down.targets == {TARGET: 0.0123}
    assert Down(mode=9.0).begin().down.targets == {TOLD: 0.0}


def test_in_the_cycle_that_ends_it_the_targets_stay():
    for mode in (8.0, 9.0):
        down = Down(mode=mode).begin()
        for _ in range(10):
            assert down.step() == ""
        before = dict(down.down.targets)
        assert down.step(**{SPEED: 1.0}) and down.down.targets == before


def test_begun_again_it_begins_anew():
    down = Down(at=0.0001).begin()
    while not down.down.arrived:
        assert down.step() == ""
    down.measured[TRAVEL] = 0.0014
    down.begin()
    assert not down.down.arrived and {down.step() for _ in range(3300)} == {""}
    assert down.step().endswith("not at no_load in time")


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_has_settled_after_just_its_time_also_where_it_swings_out_of_the_place(side):
    """Five time constants of 10 1/s, at a period of 1 ms."""
    at = side * ARRIVED_S * rig("bench").motor.let_down_speed_si
    down = Down(at=at).begin()
    assert down.step() == ""
    for _ in range(499):
        assert down.step(**{TRAVEL: 1.5 * at}) == "" and not down.down.arrived
    assert down.step(**{TRAVEL: 1.5 * at}) == "" and down.down.arrived


def test_a_motor_that_is_there_before_its_target_waits_for_it():
    """3.5 mm at 7 mm/s, and then the time to settle."""
    down = Down(mode=8.0, at=0.0035).begin()
    cycles = 0
    while not down.down.arrived:
        assert down.step(**{TRAVEL: 0.0}) == ""
        cycles += 1
        if down.down.targets[TARGET] != 0.0:
            assert cycles < 1500 and not down.down.arrived
            there = cycles
    assert there > 500 and cycles == there + 501


def test_where_nothing_is_said_to_be_wrong_every_row_is_believed():
    """The first row is that of the force here."""
    bench = rig("bench")
    rows = sorted(bench.signals, key=lambda row: row.name != FORCE)
    sections = {name: getattr(bench, name) for name in Rig.model_fields}
    on = Rig.model_construct(**sections | {"signals": tuple(rows)})
    assert on.inputs[0].name == FORCE
    down = Down(on)
    down.down.begin(down.measured, 9.0)
    assert down.down.step(down.measured) == ""
    assert FORCE in down.down.step(down.measured | {FORCE: 351.0})


def test_begun_again_it_has_the_bounds_of_the_new_beginning_alone():
    down = Down().begin()
    down.measured[FORCE] = 360.0
    down.begin()
    assert down.step() == "" and down.step(**{FORCE: 379.0}) == ""
    assert down.step(**{FORCE: 380.0}).endswith("outside -40 to 379.5 N")

"""Where each bound of a recovery begins, which rows it watches, and what it says, in full."""

import math

import pytest

from epa_rt.config.rig import Rig
from epa_rt.safety.recovery import (
    BACK_SHARE,
    SPEED_RATIO,
    RecoveryEnvelope,
    RecoveryGuard,
    WayBack,
    unlimited,
)
from epa_rt.safety.stopping import NO_ZERO
from tests.safety.safety_bench import Bench, edited, rig

TRAVEL, SPEED, FORCE = "motor_travel_m", "motor_speed_m_s", "muscle_force_n"
LOW, HIGH = -0.010, 0.031


def guard(on: Rig | str = "bench", zero: bool = True, distance: float = 0.25, speed: float = 0.25):
    of = rig(on) if isinstance(on, str) else on
    return RecoveryGuard(of, lambda measured: zero, distance, speed)


def sound(**measured: float) -> dict[str, float]:
    row = dict.fromkeys((each.name for each in rig("bench").inputs), 0.0)
    return row | {"muscle_pressure_pa": rig("bench").atmosphere_pa} | measured


@pytest.mark.parametrize(("start", "limit"), [(HIGH + 0.01, HIGH), (LOW - 0.01, LOW)])
def test_a_row_that_is_back_at_its_limit_is_no_longer_outside(start, limit):
    way = WayBack(rig("bench").row(TRAVEL), start)
    assert way.outside and way.step(0.999 * start) is None and way.outside
    assert way.step(limit) is None and not way.outside


def test_a_row_is_said_with_its_unit_its_limits_and_which_way():
    row = rig("bench").row(TRAVEL).model_copy(update={"limits": (-0.0101234567, 0.0312345678)})
    outside, inside = WayBack(row, 0.0400000123), WayBack(row, 0.0)
    assert outside.step(0.0512345678) == (
        "over-travel",
        TRAVEL,
        f"{TRAVEL} = 51.2346 mm goes further out of its limits -10.1235 to 31.2346 mm: move the"
        " other way",
    )
    assert inside.step(0.0312345679)[2] == (
        f"{TRAVEL} = 31.2346 mm goes out of its limits -10.1235 to 31.2346 mm: move the other way"
    )


def test_travel_force_and_pressure_are_watched_where_they_have_limits():
    of = guard()
    assert of.ways == []  # until a row says where the rig stands
    of.step(sound())
    assert {way.name for way in of.ways} == {TRAVEL, FORCE, "muscle_pressure_pa"}
    free = guard(edited("bench", ("    limits: [-40 N, 350 N]\n", "")))
    assert free.step(sound(**{FORCE: 1e6})) is None
    assert {way.name for way in free.ways} == {TRAVEL, "muscle_pressure_pa"}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_without_a_zero_just_the_distance_is_allowed_and_beyond_it_is_said(sign):
    of = guard(zero=False)
    assert of.step(sound()) is None and of.step(sound(**{TRAVEL: sign * 0.25})) is None
    assert of.step(sound(**{TRAVEL: sign * 0.2512345}))[2] == (
        f"{TRAVEL} moved {sign * 251.2:.4g} mm since the start, more than 250 mm"
    )
    narrow = guard(zero=False, distance=0.0123456)
    narrow.step(sound())
    assert narrow.step(sound(**{TRAVEL: 1.0}))[2].endswith(", more than 12.35 mm")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_three_times_the_speed_is_allowed_and_beyond_it_is_said(sign):
    of = guard()
    assert of.step(sound(**{SPEED: sign * 0.75})) is None
    assert of.step(sound(**{SPEED: sign * 0.8123456}))[2] == (
        f"{SPEED} = {sign * 812.3:.4g} mm/s, above 750 mm/s"
    )
    assert guard(speed=0.1 / 3.0 + 1e-5).step(sound(**{SPEED: 1.0}))[2].endswith(", above 100 mm/s")


class Recovering(Bench):
    def __init__(self, zero: bool):
        super().__init__("bench")
        self.guard = guard(zero=zero)
        self.envelope = RecoveryEnvelope(self.rig, lambda i: f"says row {i}", self.guard)

    def refuses(self) -> str:
        return self.envelope.stopping.refuses_to_let_down()


def test_a_load_is_let_down_only_once_a_row_has_said_that_travel_has_a_zero():
    for zero in (True, False):
        bench = Recovering(zero)
        bench.envelope.stopping.begin(bench.gate, True)
        assert bench.refuses() == NO_ZERO
        bench.check()
        assert (bench.refuses() == NO_ZERO) is not zero


def test_after_a_trip_nobody_learns_where_the_rig_stands():
    bench = Recovering(zero=True)
    bench.check(invalid=1)
    assert bench.trip.cause == "invalid sensor"
    bench.check()
    assert bench.guard.has_zero is None and bench.refuses() == NO_ZERO


def test_commands_keep_their_limits_and_rows_without_any_get_none():
    valve = (
        "  - name: cmd_valve_pa\n    entry: analog_out.ch1\n    reads: absolute\n"
        "    calibration: {native: [0 V, 10 V], value: [0 kPa, 1000 kPa]}\n"
        "    limits: [0 kPa abs, 800 kPa abs]\n    slew: 10 MPa/s\n"
    )
    free = edited("bench", ("    limits: [-40 N, 350 N]\n", ""))
    assert unlimited(free).row(FORCE).limits is None
    on = edited(
        "bench", ("  - {name: cmd_muscle_inlet_open", valve + "  - {name: cmd_muscle_inlet_open")
    )
    assert unlimited(on).row("cmd_valve_pa").limits == on.row("cmd_valve_pa").limits
    assert unlimited(on).row("muscle_pressure_pa").limits == (-math.inf, math.inf)


@pytest.mark.parametrize("name", ["bench", "knee"])
def test_a_muscles_law_is_not_asked_while_its_zero_may_be_wrong(name):
    assert all(muscle.law is not None for muscle in rig(name).muscles)
    free = unlimited(rig(name))
    assert [muscle.law for muscle in free.muscles] == [None] * len(rig(name).muscles)
    assert [muscle.pressure for muscle in free.muscles] == [m.pressure for m in rig(name).muscles]


def test_a_joint_that_turns_is_watched_too():
    of = guard("knee")
    of.step(dict.fromkeys((row.name for row in rig("knee").inputs), 0.0))
    assert "knee_angle_rad" in {way.name for way in of.ways}


def test_without_a_word_of_homing_the_motor_takes_targets():
    bench = Recovering(zero=True).power_on(9, 0x0237)
    out = bench.check(command={"cmd_motor_speed_m_s": 0.001})
    assert bench.trip is None and out["cmd_motor_speed_m_s"] == 0.001


def test_what_the_page_says_of_a_way_back_is_so():
    assert (BACK_SHARE, SPEED_RATIO) == (0.05, 3.0)

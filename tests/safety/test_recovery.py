"""The envelope of a jog and of a homing: what is outside may only come back; the rest is kept."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.safety.envelope import Envelope
from epa_rt.safety.recovery import BACK_SHARE, RecoveryEnvelope, RecoveryGuard, WayBack, unlimited
from tests.safety.safety_bench import Bench, rig

TRAVEL, LOW, HIGH = "motor_travel_m", -0.010, 0.031
MARGIN = BACK_SHARE * (HIGH - LOW)


class Recovery(Bench):
    """A bench whose envelope is that of a recovery."""

    def __init__(self, on="bench", zero=True, distance=0.02, speed=0.007, homing=False):
        super().__init__(on)
        self.guard = RecoveryGuard(self.rig, lambda measured: zero, distance, speed)
        self.envelope = RecoveryEnvelope(self.rig, lambda i: f"says row {i}", self.guard, homing)

    def at(self, **measured):
        """One cycle; the trip, or None."""
        self.check(measured)
        return self.envelope.tripped

    def jump(self, **measured):
        """The guard alone, which does not mind how fast a row got there; its cause, or None."""
        refusal = self.guard.step(self.measured | measured)
        return refusal and refusal[0]


def travel_row():
    return rig("bench").row(TRAVEL)


@given(st.lists(st.floats(-0.2, 0.2), min_size=1, max_size=30))
def test_a_row_only_comes_back(values):
    """An oracle of its own: the best place so far, plus the margin, and never less than limits."""
    way = WayBack(travel_row(), values[0])
    best_high, best_low = max(values[0], HIGH), min(values[0], LOW)
    margin_high = MARGIN if values[0] > HIGH else 0.0
    margin_low = MARGIN if values[0] < LOW else 0.0
    for value in values:
        allowed = best_low - margin_low <= value <= best_high + margin_high
        near = min(abs(value - best_low + margin_low), abs(value - best_high - margin_high)) < 1e-12
        assert near or (way.step(value) is None) == allowed
        if not allowed or near:
            return
        best_high = max(HIGH, min(best_high, value))
        best_low = min(LOW, max(best_low, value))
        assert way.outside == (not LOW <= value <= HIGH)


def test_the_limits_themselves_are_inside():
    for value in (LOW, HIGH):
        way = WayBack(travel_row(), value)
        assert not way.outside and way.step(value) is None
        assert (way.low, way.high) == (LOW, HIGH)


def test_what_is_refused_is_named_with_the_way_it_went():
    way = WayBack(travel_row(), 0.040)
    assert way.step(0.040 + MARGIN) is None
    cause, name, text = way.step(0.040 + 1.01 * MARGIN)
    assert (cause, name) == ("over-travel", TRAVEL)
    assert "further out of its limits -10 to 31 mm: move the other way" in text
    assert "goes out of its limits" in WayBack(travel_row(), 0.0).step(0.032)[2]
    assert WayBack(travel_row(), 0.0).step(math.nan) is None  # the envelope itself trips on it


@pytest.mark.parametrize(
    ("row", "outside", "further", "cause"),
    [
        (TRAVEL, 0.050, 0.053, "over-travel"),
        (TRAVEL, -0.076, -0.079, "over-travel"),
        ("muscle_force_n", 400.0, 420.0, "over-force"),
        ("muscle_pressure_pa", 950e3, 995e3, "over-pressure"),
    ],
)
def test_a_rig_outside_of_its_limits_is_let_in_and_only_comes_back(row, outside, further, cause):
    plain = Bench()
    plain.check({row: outside})
    assert plain.envelope.tripped.cause == cause
    moved = Recovery()
    assert moved.at(**{row: outside}) is None
    assert moved.jump(**{row: outside - 0.5 * (further - outside)}) is None
    assert moved.jump(**{row: further}) == cause
    assert moved.at(**{row: outside + 1.5 * (further - outside)}).cause == cause
    assert moved.check() == moved.safe  # and it latches


def test_a_row_that_starts_inside_stays_inside():
    for value, trips in ((HIGH, False), (HIGH + 1e-6, True), (LOW, False), (LOW - 1e-6, True)):
        bench = Recovery()
        bench.at()
        assert bench.jump(**{TRAVEL: value}) == ("over-travel" if trips else None)


def test_without_a_zero_the_distance_from_the_start_is_bounded():
    bench = Recovery(zero=False, distance=0.02)
    assert bench.at(**{TRAVEL: 5.0}) is None and bench.guard.has_zero is False
    assert bench.jump(**{TRAVEL: 5.0199}) is None
    assert bench.jump(**{TRAVEL: 4.9799}) == bench.jump(**{TRAVEL: 5.0201}) == "over-travel"
    assert "moved 30 mm since the start" in bench.guard.step(bench.measured | {TRAVEL: 5.03})[2]
    assert Recovery(zero=False).at(muscle_force_n=1e9) is None  # outside, and only to come back


def test_speed_is_bounded_by_what_was_asked_for():
    bench = Recovery(speed=0.007)
    assert bench.at(motor_speed_m_s=-0.0209) is None
    trip = bench.at(motor_speed_m_s=-0.0211)
    assert (trip.cause, trip.signal) == ("over-speed", "motor_speed_m_s")


def test_all_else_stays_watched():
    assert Recovery().at(motor_current_a=9.1).cause == "over-current"
    assert Recovery().at(**{TRAVEL: math.nan}).cause == "NaN"
    blind = Recovery()
    blind.check({TRAVEL: 7.0}, invalid=1)
    assert blind.envelope.tripped.cause == "invalid sensor" and blind.guard.has_zero is None
    silent = Recovery()
    for _ in range(3):
        silent.check({TRAVEL: 7.0}, bus_ok=False)
    assert silent.envelope.tripped.cause == "lost working counter" and silent.guard.has_zero is None


def test_a_rig_without_a_speed_row_is_moved_all_the_same():
    still = rig("bench").model_copy(
        update={"motor": rig("bench").motor.model_copy(update={"speed": None})}
    )
    assert Recovery(still).at(motor_speed_m_s=0.1) is None


def test_what_the_guard_watches_has_no_limits_of_its_own():
    free = unlimited(rig("bench"))
    for row, was in zip(free.signals, rig("bench").signals, strict=True):
        taken = row.name in (TRAVEL, "cmd_motor_travel_m", "muscle_force_n", "muscle_pressure_pa")
        assert row.limits == ((-math.inf, math.inf) if taken else was.limits)
    assert free.inputs[2].limits == (-math.inf, math.inf)
    assert free.motor == rig("bench").motor and unlimited(rig("bench"), True).motor.speed is None


def test_a_count_that_is_set_anew_is_no_jump_where_the_drive_is_homed():
    for homing in (False, True):
        bench = Recovery(zero=False, distance=math.inf, homing=homing)
        bench.at(**{TRAVEL: 0.0})
        assert (bench.at(**{TRAVEL: 0.5}) is None) == homing


HOMING = {"cmd_drive_mode_raw": 6}


def homing_words(envelope):
    """Which words and modes leave, of all that were asked for."""
    return {
        (word, mode)
        for word in range(256)
        for mode in range(12)
        if envelope().check({}, {"cmd_drive_control_raw": word, "cmd_drive_mode_raw": mode})[
            "cmd_drive_control_raw"
        ]
        == word
        != 0
    }


def test_only_a_homing_run_knows_the_homing_mode_and_no_other():
    def bench(homing):
        made = Bench()
        made.envelope = Envelope(made.rig, str, homing)
        return made

    run, home = homing_words(lambda: bench(False)), homing_words(lambda: bench(True))
    assert {mode for _, mode in run} == {0, 8, 9, 10} and {mode for _, mode in home} == {0, 6}
    assert {word for word, _ in home} == {word for word, _ in run} | {0x1F}
    assert all(mode == 6 for word, mode in home if word in (0x0F, 0x1F))


def test_starting_the_homing_is_power_on_like_enabling():
    bench = Recovery(zero=False, homing=True)
    moving = HOMING | {"cmd_drive_control_raw": 0x1F, "cmd_motor_speed_m_s": 0.002}
    bench.check({}, moving)
    assert bench.envelope.tripped.cause == "jump at enable"
    bench = Recovery(zero=False, homing=True)
    bench.check({}, HOMING | {"cmd_drive_control_raw": 0x0F})
    bench.check({}, HOMING | {"cmd_drive_control_raw": 0x1F, "cmd_motor_speed_m_s": 0.002})
    assert bench.envelope.tripped is None  # power has not come on: it was on
    bench.check({}, {"cmd_drive_control_raw": 0x1F, "cmd_drive_mode_raw": 0})
    assert bench.envelope.tripped.cause == "mode change"


def test_a_load_is_let_down_within_the_rigs_own_limits_of_force():
    """After a trip the guard no longer watches; the limits that it replaced are not those here."""
    recovery = Recovery()
    down, row = recovery.envelope.stopping.let_down, recovery.measured | {TRAVEL: 0.02}
    down.begin(row, 9.0)
    assert down.step(row) == ""
    assert "muscle_force_n" in down.step(row | {"muscle_force_n": 400.0})

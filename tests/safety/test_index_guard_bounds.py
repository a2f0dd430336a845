"""Where each bound of a drive that seeks its index begins, and what is said of it, in full."""

from typing import Any

import pytest

from epa_rt.config.rig import Rig, Zero
from epa_rt.config.rig_homing import index_way
from epa_rt.safety.index_guard import IndexGuard, Rise
from epa_rt.safety.recovery import Refusal
from tests.safety.safety_bench import rig

TRAVEL, SPEED, FORCE, CURRENT = (
    "motor_travel_m",
    "motor_speed_m_s",
    "muscle_force_n",
    "motor_current_a",
)
HOME, SEEK, ENABLED, HOMED = 10.274321e-3, 0x1F, 0x0F, 0x9637
ZERO = {
    "method": "index",
    "at": "10.274321 mm",
    "direction": "increasing",
    "speed": "4 mm/s",
    "current": "1 A",
    "force": "20 N",
}


def seeking(**motor: Any) -> Rig:
    bench = rig("bench")
    changed = bench.motor.model_copy(update={"zero": Zero(**ZERO), **motor})
    return bench.model_copy(update={"motor": changed})


class Guarded:
    """The guard alone, which has seen one cycle of a rig that stands at ``start``."""

    def __init__(self, on: Rig | None = None, start: float = 0.0):
        on = on or seeking()
        self.way = index_way(on)
        self.guard = IndexGuard(on, self.way)
        assert self.guard.moved == 0.0
        self.measured = dict.fromkeys((row.name for row in on.inputs), 0.0)
        self.measured |= {"muscle_pressure_pa": on.atmosphere_pa, TRAVEL: start}
        assert self.cycle(ENABLED) is None

    def cycle(self, word: int = SEEK, **measured: float) -> Refusal | None:
        row = self.measured | measured
        return self.guard.step(self.guard.seen(row, True, {"cmd_drive_control_raw": word}))


@pytest.mark.parametrize("value", [15.0, 5.0])
def test_a_rise_of_just_what_is_allowed_is_allowed(value):
    rise = Rise("force_n", "over-force", "N", 5.0, 1.0)
    assert rise.step(10.0, False) is None and rise.step(value, True) is None


def test_a_rise_is_said_with_its_figures_and_their_unit():
    rise = Rise("force_n", "over-force", "N", 5.123456, 1.0)
    rise.step(10.0, False)
    assert rise.step(16.234567, True)[2] == (
        "force_n changed by 6.235 N while the drive sought its index, more than 5.123 N: something"
        " is in the way"
    )


def test_current_and_force_are_felt_over_20_ms():
    """One cycle of 1 ms counts for a 21st."""
    assert Guarded().cycle(**{CURRENT: 20.9}) is None
    cause, signal, text = Guarded().cycle(**{CURRENT: 21.1})
    assert (cause, signal) == ("over-current", CURRENT)
    assert text.startswith(f"{CURRENT} changed by 1.005 A while")
    guarded = Guarded()
    refusals = [guarded.cycle(**{FORCE: 100.0}) for _ in range(5)]
    assert refusals[:4] == [None] * 4 and refusals[4][:2] == ("over-force", FORCE)
    assert f"{FORCE} changed by 21.65 N while" in refusals[4][2]


def test_a_motor_whose_current_is_not_measured_is_homed_by_force_alone():
    guarded = Guarded(seeking(current=None))
    assert [guarded.cycle(**{CURRENT: 8.0}) for _ in range(50)] == [None] * 50
    assert guarded.cycle(**{FORCE: 349.0}) is None
    assert guarded.cycle(**{FORCE: 349.0})[0] == "over-force"


def test_what_was_moved_counts_from_the_start():
    guarded = Guarded(start=3e-3)
    guarded.cycle(**{TRAVEL: 3.02e-3})
    assert guarded.guard.moved == pytest.approx(2e-5)


def test_a_homing_that_has_started_stays_so_when_its_word_goes():
    guarded = Guarded()
    guarded.cycle(SEEK)
    guarded.cycle(ENABLED, **{TRAVEL: HOME})
    assert guarded.guard.has_started and guarded.guard.is_set


def test_once_the_count_is_set_speed_stays_bounded():
    guarded = Guarded()
    assert guarded.cycle(**{TRAVEL: HOME}) is None and guarded.guard.is_set
    assert guarded.cycle(**{TRAVEL: HOME, SPEED: 3.1 * guarded.way.speed})[0] == "over-speed"


def test_a_jump_elsewhere_is_said_in_full():
    guarded = Guarded(start=1e-3)
    guarded.cycle(**{TRAVEL: 1e-3})
    assert guarded.cycle(**{TRAVEL: 6.1234567e-3}) == (
        "position jump",
        TRAVEL,
        f"{TRAVEL} jumped by 5.123 mm to 6.123 mm while the drive homed, expected 10.27 mm"
        " (0x30B0), its home",
    )


def test_a_way_too_far_from_home_is_said_in_full():
    guarded = Guarded()
    guarded.cycle(**{TRAVEL: HOME})
    far = 1.2345678 * guarded.way.landing
    assert guarded.cycle(**{TRAVEL: HOME - far}) == (
        "over-travel",
        TRAVEL,
        f"{TRAVEL} went {-far * 1e3:.4g} mm from the home that was set, more than"
        f" {guarded.way.landing * 1e3:.4g} mm",
    )


def test_a_home_that_is_not_confirmed_is_said_in_full():
    guarded = Guarded(start=1e-3)
    guarded.cycle(**{TRAVEL: 1e-3})
    refusal = None
    while refusal is None:
        refusal = guarded.cycle(**{TRAVEL: HOME, "drive_status_raw": 0x0637})
    assert refusal == (
        "position jump",
        TRAVEL,
        f"{TRAVEL} jumped by 9.274 mm while the drive homed, and the drive does not call itself"
        " referenced",
    )

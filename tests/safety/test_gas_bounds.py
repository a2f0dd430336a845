"""Where a muscle's pressure begins to contradict its valves, to the bound and to the word."""

import math

import pytest

from epa_rt.config.rig import Rig
from epa_rt.safety.gas_watch import GasWatch, VolumeWatch
from epa_rt.safety.muscle_law import geometry_of
from tests.safety.safety_bench import edited, rig

STEP_S, HELD_PA = 0.008, 6e5
INLET, EXHAUST = "cmd_muscle_inlet_open", "cmd_muscle_exhaust_open"
SHUT = {INLET: 0.0, EXHAUST: 0.0}


def without_law() -> Rig:
    return edited("bench", ("    law: {", "    # law: {"))


def shut_in(on: Rig, share: float) -> bool:
    """Whether a loss of this share within 60 ms is refused, of gas that was held for long."""
    watch, pressure_pa = GasWatch(on.muscles[0], on, STEP_S), HELD_PA
    row = {"motor_travel_m": -0.005}
    for _ in range(100):
        assert watch.step(row | {"muscle_pressure_pa": HELD_PA}, SHUT) is None
    while pressure_pa > (1.0 - share) * HELD_PA:
        pressure_pa = max(pressure_pa - 24e3, (1.0 - share) * HELD_PA)
        if watch.step(row | {"muscle_pressure_pa": pressure_pa}, SHUT) is not None:
            return True
    return False


@pytest.mark.parametrize(
    ("share", "with_law", "without"),
    [(0.12, False, False), (0.19, True, False), (0.28, True, True)],
)
def test_without_its_law_the_gas_of_a_muscle_may_be_half_as_far_off_again(share, with_law, without):
    assert shut_in(rig("bench"), share) is with_law
    assert shut_in(without_law(), share) is without


def filling(watch: GasWatch, start_pa: float, steps: int, rate_pa_s: float) -> float:
    """An open inlet for so many steps, which must pass; the pressure at their end."""
    pressure_pa = start_pa
    for _ in range(steps):
        pressure_pa += rate_pa_s * STEP_S
        row = {"motor_travel_m": -0.005, "muscle_pressure_pa": pressure_pa}
        assert watch.step(row, SHUT | {INLET: 1.0}) is None
    return pressure_pa


def test_after_a_fill_to_the_supply_the_next_one_has_its_whole_time():
    """Above 0.8 of the supply nothing is asked; what was counted before it is forgotten."""
    on = rig("bench")
    watch, supply_pa = GasWatch(on.muscles[0], on, STEP_S), on.muscles[0].valves.supply
    pressure_pa = filling(watch, 0.75 * supply_pa, 18, 4e5)
    assert pressure_pa > 0.8 * supply_pa
    pressure_pa = filling(watch, pressure_pa, 20, 1e4)
    while pressure_pa > 0.72 * supply_pa:
        pressure_pa -= 1e6 * STEP_S
        row = {"motor_travel_m": -0.005, "muscle_pressure_pa": pressure_pa}
        assert watch.step(row, SHUT | {EXHAUST: 1.0}) is None
    filling(watch, pressure_pa, 20, 0.0)  # 0.16 of the 0.2 s that a valve may take
    row = {"motor_travel_m": -0.005, "muscle_pressure_pa": pressure_pa}
    late = [watch.step(row, SHUT | {INLET: 1.0}) for _ in range(8)]
    assert any(late) and "stays at 684.7" in next(text for _, _, text in filter(None, late))


def test_a_jump_is_said_with_the_time_that_it_took():
    on = rig("bench")
    watch = GasWatch(on.muscles[0], on, 0.9)
    row = {"motor_travel_m": -0.005, "muscle_pressure_pa": 101_325.0}
    watch.step(row, SHUT)  # too slow for its other laws, which the next line does not ask
    refusal = watch.step(row | {"muscle_pressure_pa": 101_325.0 + 2.4e6}, SHUT)
    assert refusal[2].startswith("muscle_pressure_pa jumps by +2400.0 kPa within 900 ms; check")


@pytest.mark.parametrize("swing_m", [0.0, 0.012])
def test_a_frozen_pressure_is_found_also_where_no_valve_was_ever_open(swing_m):
    on = rig("bench")
    muscle = on.muscles[0]
    watch = VolumeWatch(muscle, geometry_of(muscle, on), on, 0.024)
    found = []
    for k in range(400):
        travel_m = 0.013 - swing_m * math.cos(0.08 * k)
        row = {"motor_travel_m": travel_m, "muscle_pressure_pa": HELD_PA}
        found.append(watch.step(row, SHUT) is not None)
    assert any(found) is (swing_m > 0.0)


def test_a_stretch_in_one_step_is_not_refused_in_that_step():
    """The muscle may be longer by a tenth at once; what follows must say so for 0.4 s."""
    on = rig("bench")
    muscle = on.muscles[0]
    watch = VolumeWatch(muscle, geometry_of(muscle, on), on, 0.024)
    for _ in range(20):
        row = {"motor_travel_m": 0.016, "muscle_pressure_pa": HELD_PA}
        assert watch.step(row, SHUT) is None
    row = {"motor_travel_m": 0.028, "muscle_pressure_pa": HELD_PA}
    found = [watch.step(row, SHUT) is not None for _ in range(20)]
    assert found[:16] == [False] * 16 and found[16]

"""Where the muscle's law begins to speak: its band, its time, its first fill, its signs."""

import math

import pytest

from epa_rt.safety.fill_watch import FILLED_PA, FillWatch
from epa_rt.safety.gas_watch import CAUSE
from epa_rt.safety.hose_watch import HoseWatch
from epa_rt.safety.motion_watch import SPEED_STEP, SPEED_STEPS, CurrentWatch, LawWatch
from epa_rt.safety.muscle_law import geometry_of
from tests.safety.safety_bench import rig

ATMOSPHERE_PA, STEP_S = 101_325.0, 0.05  # two steps are the time that the law allows
SHUT = {"cmd_muscle_inlet_open": 0.0, "cmd_muscle_exhaust_open": 0.0}


def sample(travel_m: float, gauge_pa: float, force_n: float) -> dict[str, float]:
    return {
        "motor_travel_m": travel_m,
        "muscle_pressure_pa": ATMOSPHERE_PA + gauge_pa,
        "muscle_force_n": force_n,
    }


def law_watch() -> LawWatch:
    on = rig("bench")
    muscle = on.muscles[0]
    return LawWatch(muscle, "muscle_force_n", geometry_of(muscle, on), on, STEP_S)


def fill_watch() -> FillWatch:
    on = rig("bench")
    muscle = on.muscles[0]
    return FillWatch(muscle, "muscle_force_n", geometry_of(muscle, on), on, STEP_S)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_slack_muscle_reads_just_its_band_for_ever_and_beyond_it_two_steps(sign):
    watch = law_watch()
    answers = {watch.step(sample(-0.005, 0.0, sign * 8.0), SHUT) for _ in range(50)}
    assert answers == {None}
    assert watch.step(sample(-0.005, 0.0, sign * 8.01), SHUT) is None
    cause, signal, text = watch.step(sample(-0.005, 0.0, sign * 8.01), SHUT)
    assert (cause, signal) == (CAUSE, "muscle_force_n")
    assert ("at most 8 N" if sign > 0.0 else "at least -8 N") in text


def filled(watch: FillWatch, gauge_pa: float, force_n: float, steps: int) -> list[bool]:
    """Vented for a second, then at once at a pressure: in which steps it refuses."""
    for _ in range(20):
        assert watch.step(sample(0.0, 0.0, 0.0), SHUT) is None
    row = sample(0.0, gauge_pa, force_n)
    return [watch.step(row, SHUT) is not None for _ in range(steps)]


def test_a_fill_that_is_there_at_once_has_its_time():
    assert filled(fill_watch(), 460e3, 200.0, 3) == [False, True, True]


def test_a_fill_is_asked_from_just_50_kpa_on():
    assert FILLED_PA == 50e3
    assert filled(fill_watch(), 50e3, 200.0, 2) == [False, True]
    assert filled(fill_watch(), 49.9e3, 200.0, 40) == [False] * 40


def test_a_dead_current_is_found_at_the_tenth_step_of_speed_since_it_last_flowed():
    on = rig("bench")
    watch = CurrentWatch(on, "motor_current_a", "motor_speed_m_s")
    outputs = {"cmd_drive_control_raw": 15.0, "cmd_drive_mode_raw": 9.0}
    step = 1.01 * SPEED_STEP * on.motor.speed_max
    for current_a in (0.5, 0.04):  # flows; after that it is dead
        row = {"motor_current_a": current_a, "motor_speed_m_s": 0.0}
        assert watch.step(row, outputs) is None
        for k in range(1, SPEED_STEPS + 1):
            row = {"motor_current_a": 0.0, "motor_speed_m_s": step * (k % 2)}
            assert (watch.step(row, outputs) is None) == (k < SPEED_STEPS), k


@pytest.mark.parametrize("per_angle_m", [-0.05, 0.20])
def test_pressures_that_fall_with_both_volumes_are_no_exchanged_hoses(per_angle_m):
    """A wrong sign of travel or joint: each falls where its muscle is stretched. Where the other
    one is stretched at the same time, it does not follow that one either.
    """
    knee = rig("knee")
    geometries = tuple(geometry_of(muscle, knee) for muscle in knee.muscles)
    watch = HoseWatch(knee.muscles, geometries, 0.024)
    shut = {valve: 0.0 for muscle in knee.muscles for valve in (muscle.inlet, muscle.exhaust)}
    found = []
    for k in range(400):
        angle = 0.10 * math.sin(3.0 * k * 0.024)
        row = {"motor_travel_m": 0.010 + per_angle_m * angle, "knee_angle_rad": angle}
        for muscle, geometry in zip(knee.muscles, geometries, strict=True):
            row[muscle.pressure] = 3e5 * geometry.volume_ratio(geometry.length(row))
        found.append(watch.step(row, shut) is not None)
    # in turn stretched muscles with a wrong sign cannot be told from exchanged ones
    assert any(found) is (per_angle_m > 0.0)


@pytest.mark.parametrize("length_m", [0.12, 0.14, 0.16])
def test_a_pull_that_nobody_gives_stretches_no_strap(length_m):
    on = rig("bench")
    geometry = geometry_of(on.muscles[0], on)
    assert geometry.pull(5e5, length_m) == geometry.pull(5e5, length_m, 0.0)
    assert geometry.pull(5e5, 0.14, 100.0)[0] < geometry.pull(5e5, 0.14, 0.0)[0]

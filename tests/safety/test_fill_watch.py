"""A fill at rest: the pull follows the pressure as the length says, or travel's zero is wrong."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.safety.at_rest import AtRest
from epa_rt.safety.fill_watch import FillWatch
from epa_rt.safety.gas_watch import CAUSE
from epa_rt.safety.muscle_law import geometry_of
from tests.safety.safety_bench import edited, rig

ATMOSPHERE_PA, B, N, REST = 101_325.0, 0.2078, 3.05, 0.120
STEP_S, OUTPUTS = 0.024, {"cmd_muscle_exhaust_open": 0.0}


def watch() -> FillWatch:
    on = rig("bench")
    muscle = on.muscles[0]
    return FillWatch(muscle, muscle.law.force, geometry_of(muscle, on), on, STEP_S)


def sample(read_m: float, gauge_pa: float, force_n: float) -> dict[str, float]:
    return {
        "motor_travel_m": read_m,
        "muscle_pressure_pa": ATMOSPHERE_PA + gauge_pa,
        "muscle_force_n": force_n,
    }


def pull(true_m: float, gauge_pa: float, friction: float = 0.0, end_m: float = 0.0) -> float:
    """Equation (1), and friction of the pull at the stretched length."""

    def area(length: float) -> float:
        return max(3.0 * length * length - B * B, 0.0) / (4.0 * math.pi * N * N)

    return gauge_pa * (area(REST + true_m + end_m) + friction * area(0.15))


def fill(check, read_m, true_m, to_pa, zero_n=0.0, friction=0.0, end_m=0.0, seconds=3.0):
    """Vented for half a second, then filled at rest; a refusal, or None."""
    for k in range(round(seconds / STEP_S)):
        gauge_pa = min(max(k * STEP_S - 0.5, 0.0) * 4e5, to_pa)
        force_n = zero_n + pull(true_m, gauge_pa, friction, end_m)
        refusal = check.step(sample(read_m, gauge_pa, force_n), OUTPUTS)
        if refusal is not None:
            return refusal
    return None


@settings(max_examples=40)
@given(
    travel_m=st.floats(-0.005, 0.024),
    end_m=st.floats(-0.002, 0.002),
    friction=st.floats(-0.1, 0.1),
    to_pa=st.floats(0.0, 7e5),
    zero_n=st.floats(-5.0, 5.0),
)
def test_a_sound_muscle_is_filled_without_a_word(travel_m, end_m, friction, to_pa, zero_n):
    check = watch()
    check.step(sample(travel_m - 0.01, 0.0, zero_n), OUTPUTS)  # it was stretched to get there
    assert fill(check, travel_m, travel_m, to_pa, zero_n, friction, end_m) is None


@pytest.mark.parametrize("stretched", [True, False])
def test_a_count_that_is_short_by_9000_is_found_at_the_first_fill(stretched):
    check = watch()
    if stretched:
        check.step(sample(-0.00727, 0.0, 0.0), OUTPUTS)
    cause, signal, sentence = fill(check, 0.0, 0.00727, 460e3, zero_n=4.0)
    assert (cause, signal) == (CAUSE, "motor_travel_m")
    assert "check the zero of motor_travel_m (home again)" in sentence and "120.0 mm" in sentence


def test_a_low_pressure_tells_nothing():
    assert fill(watch(), 0.0, 0.02, 45e3) is None


def test_a_moment_beyond_the_bound_is_passed():
    check = watch()
    assert fill(check, 0.0, 0.0, 460e3) is None
    for _ in range(6):
        assert check.step(sample(0.0, 460e3, 60.0), OUTPUTS) is None
        for _ in range(2):
            assert check.step(sample(0.0, 460e3, 0.0), OUTPUTS) is None


def test_a_muscle_that_vents_is_not_asked():
    check = watch()
    assert fill(check, 0.0, 0.0, 460e3) is None
    vents = {"cmd_muscle_exhaust_open": 1.0}
    for k in range(100):
        assert check.step(sample(0.0, 460e3 - 2e3 * k, 60.0), vents) is None


def test_a_muscle_that_may_be_locked_is_not_asked():
    assert fill(watch(), 0.027, 0.03, 600e3) is None


def test_a_vented_muscle_beyond_its_locked_length_must_pull():
    on = edited("bench", ("lock_length: 145 mm", "lock_length: 145 mm, locked_length: 145 mm"))
    found = []
    for travel_m, force_n in ((0.030, 0.0), (0.030, 100.0), (0.0, 0.0)):
        check = AtRest(on)
        measured = {row.name: 0.0 for row in on.inputs} | sample(travel_m, 0.0, force_n)
        for _ in range(200):
            check.step(measured, True)
        found.append(check.refusal)
    assert found[0] is not None and "the zero of motor_travel_m" in found[0][2]
    assert found[1:] == [None, None]

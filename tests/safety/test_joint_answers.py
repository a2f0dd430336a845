"""The first answer of a joint to its motor: when it is waited for, and when it is asked no more."""

from collections.abc import Iterable

from epa_rt.safety.gas_watch import CAUSE
from epa_rt.safety.motion_watch import ANSWERS, PATIENCE, STILL_M, STILL_S, JointWatch
from tests.safety.safety_bench import rig

STEP_S, WAY_M = 0.01, 0.004
KNEE = rig("knee")
SHUT = {valve: 0.0 for muscle in KNEE.muscles for valve in (muscle.inlet, muscle.exhaust)}


def went(samples: Iterable[tuple[float, float]]) -> int | None:
    """Travel and what the joint followed of it, both in m; the sample that is refused, or None."""
    watch = JointWatch(KNEE, KNEE.joint, STEP_S)
    for k, (travel_m, followed_m) in enumerate(samples):
        row = {"motor_travel_m": travel_m, "knee_angle_rad": followed_m / KNEE.joint.lever_arm}
        refusal = watch.step(row, SHUT)
        if refusal is not None:
            assert refusal[:2] == (CAUSE, "knee_angle_rad") and "goes the other way" in refusal[2]
            return k
    return None


def way(start_m: float, end_m: float, step_m: float = 1e-4) -> list[float]:
    count = round(abs(end_m - start_m) / step_m)
    return [start_m + (end_m - start_m) * (k + 1) / count for k in range(count)]


STANDS = [(0.0, 0.0)] * 40


def test_what_the_rig_file_and_the_page_say_is_so():
    assert KNEE.safety.sensors.joint_follows == WAY_M
    assert (STILL_M, STILL_S, ANSWERS, PATIENCE) == (0.0004, 0.2, 0.2, 4.0)


def test_a_joint_that_swings_while_its_motor_stands_has_not_been_at_rest():
    swings = [(0.0, 1e-3 * (k % 2)) for k in range(40)]
    against = [(m, -m) for m in way(0.0, 0.012)]
    assert went(swings + against) is None
    assert went(STANDS + against) == 40 + 39  # after four millimetres


def test_a_weak_answer_the_other_way_is_none():
    assert went(STANDS + [(m, -0.1 * m) for m in way(0.0, 0.030)]) is None


def test_a_joint_that_is_late_with_its_answer_is_waited_for():
    """Held by friction for 8 mm, then it goes against the motor."""
    late = [(m, -max(m - 0.008, 0.0)) for m in way(0.0, 0.030)]
    found = went(STANDS + late)
    assert found is not None and 0.0098 < late[found - 40][0] < 0.0102


def test_a_joint_that_gave_no_answer_in_four_ways_is_asked_no_more():
    late = [(m, -3.0 * max(m - 0.0165, 0.0)) for m in way(0.0, 0.030)]
    assert went(STANDS + late) is None


def test_once_the_motor_has_turned_back_its_way_begins_where_it_stands():
    """To 1 mm and back to 0.3 mm at once; from there it is 4 mm again."""
    back = [(m, 0.0) for m in way(0.0, 0.001)] + [(0.0003, 0.0)] * 40
    on = [(m, -(m - 0.0003)) for m in way(0.0003, 0.00425, 5e-5)]
    assert went(STANDS + back + on) is None
    further = [(m, -(m - 0.0003)) for m in way(0.0003, 0.00435, 5e-5)]
    assert went(STANDS + back + further) is not None

"""The dead-man key: the motor moves while it is held, and stands soon after it is let go."""

import pytest

from epa_rt.experiments.jogging import DEAD_MAN_S
from epa_rt.experiments.speed_plan import RAMP_S
from tests.loop.one_rig import OneRig

PRESSED, REPEAT, LET_GO = 200, 40, 1200


def held(key: str, more: dict[int, str] | None = None) -> dict[int, str]:
    """A key held from PRESSED to LET_GO, repeated as a terminal does; then, later, q."""
    return dict.fromkeys(range(PRESSED, LET_GO, REPEAT), key) | (more or {}) | {3500: "q"}


@pytest.mark.parametrize(("key", "sign"), [("right", 1.0), ("left", -1.0)])
def test_a_held_key_moves_and_letting_go_stops(tmp_path, key, sign):
    one = OneRig(tmp_path)
    result, jog = one.keys(held(key))
    assert result.outcome == "completed"
    speed = [sign * v for v in one.measured("motor_speed_m_s")]
    assert all(abs(v) < 1e-3 for v in speed[:PRESSED])
    assert all(0.9 * jog.speed_max < v < 1.2 * jog.speed_max for v in speed[PRESSED + 200 : LET_GO])
    dead = LET_GO + round((DEAD_MAN_S + RAMP_S) / one.rig.period_s) + 50
    assert all(abs(v) < 1e-3 for v in speed[dead:])


def test_any_other_key_lets_go_at_once(tmp_path):
    one = OneRig(tmp_path)
    one.keys(held("right", {700: " "}) | {n: "x" for n in range(720, LET_GO, REPEAT)})
    assert all(abs(v) < 1e-3 for v in one.measured("motor_speed_m_s")[900:])


def test_a_held_key_stops_short_of_the_limit_without_a_trip(tmp_path):
    one = OneRig(tmp_path)
    assert one.jog("move 30 mm")[0].outcome == "completed"
    result, jog = one.keys(held("right"))
    assert result.outcome == "completed" and "at the end of what is allowed" in jog.note
    assert max(one.measured("motor_travel_m")) < 0.031


def test_air_comes_and_goes_in_steps(tmp_path):
    one = OneRig(tmp_path)
    result, _ = one.keys({200: "up", 2000: "up", 4500: "down", 6500: "v", 9000: "q"})
    pressure = one.measured("muscle_pressure_pa")
    assert result.outcome == "completed"
    assert [round(pressure[n] / 20e3) for n in (1900, 4400, 6400, 8900)] == [6, 7, 6, 5]

"""The dead-man key: the motor moves while it is held, and stands soon after it is let go."""

import os
import pty

import pytest

from epa_rt.cli.keys import KeyRequests, raw_keys
from epa_rt.experiments.jogging import DEAD_MAN_S, Keys
from epa_rt.experiments.speed_plan import RAMP_S
from epa_rt.loop.by_hand import assemble_jog
from epa_rt.loop.requests import STOP, STOP_AT_ONCE
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


def test_a_key_from_before_the_start_moves_nothing(tmp_path):
    """It waited in the terminal while the bus came up, and nobody holds it any more."""
    one = OneRig(tmp_path)
    result, _ = one.keys({5: "right", 6: "up", 3500: "q"})
    assert result.outcome == "completed"
    assert all(abs(v) < 1e-3 for v in one.measured("motor_speed_m_s"))
    assert max(one.measured("muscle_pressure_pa")) < 105e3


def test_the_end_asked_for_before_the_start_ends_it(tmp_path):
    result, _ = OneRig(tmp_path).keys({5: "q"})
    assert result.outcome == "completed" and result.cycles < 1000


@pytest.mark.parametrize("period_s", [0.001, 0.002])
def test_a_terminal_that_is_gone_stops_once(tmp_path, monkeypatch, period_s):
    one = OneRig(tmp_path)
    rig = one.rig.model_copy(update={"period_s": period_s})
    reading, writing = os.pipe()
    with os.fdopen(reading) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        keys = Keys()
        assembly, jog = assemble_jog(one.rig, keys)
        requests = KeyRequests(rig, keys, jog, assembly.decoder.measured)
        os.dup2(writing, reading)  # which cannot be read
        assert [requests.poll(cycle) for cycle in range(1000)] == [STOP] * 1000
        requests.ask("operator")
        assert requests.poll(1001) == STOP_AT_ONCE
    os.close(writing)


def test_a_terminal_that_is_gone_at_the_end_hides_no_result(monkeypatch):
    master, slave = pty.openpty()
    with os.fdopen(slave) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with raw_keys():
            os.close(master)


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


def test_a_jog_that_nobody_keys_ends_by_itself(tmp_path, monkeypatch):
    monkeypatch.setattr("epa_rt.experiments.jogging.IDLE_S", 2.0)
    one = OneRig(tmp_path)
    result, _ = one.keys({200: "up", 1500: "x"})
    assert result.outcome == "completed" and result.end.is_quiet
    assert 3500 <= result.cycles < 8000


def test_a_move_that_the_motor_does_not_follow_is_not_called_done(tmp_path):
    """By less than trips; a wired drive tells nobody that it has no torque."""
    one = OneRig(tmp_path, "bench_analog")
    one.break_it("sto")
    result, jog = one.jog("move 3 mm", "move -1 mm")
    assert result.outcome == "tripped" and one.travel_m == pytest.approx(0.0, abs=1e-4)
    assert "the motor did not follow: it stands at " in result.cause
    assert "asked for were 3.00 mm" in result.cause and jog.failure is not None


def test_a_move_that_the_motor_follows_goes_on(tmp_path):
    one = OneRig(tmp_path, "bench_analog")
    result, _ = one.jog("move 3 mm at 1 mm/s", "move -1 mm")
    assert result.outcome == "completed" and one.travel_m == pytest.approx(2e-3, abs=2e-4)

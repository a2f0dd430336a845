"""Homing mode: its handshake, what the count then says, and what the drive calls referenced."""

import math

import pytest
from sim_rigs import Driven, edited, rig

from sim_backend.drive_motion import INDEX_PHASE_TURNS

MODE, START = 6, 0x1F
REFERENCED, REACHED, ATTAINED, ERROR = 0x8000, 0x0400, 0x1000, 0x2000
AT = ("at: 10.27 mm", "at: 12 mm")


def word(driven: Driven) -> int:
    return int(driven.decoder.measured["drive_status_raw"])


def homing(on="bench", **more: int) -> Driven:
    """Enabled in homing mode."""
    driven = Driven(on, **({"referenced": False} | more)).enable(MODE)
    assert driven.decoder.measured["drive_mode_raw"] == MODE
    return driven


def test_the_simulation_starts_referenced_and_may_start_otherwise():
    assert Driven("bench").cycles(30)["drive_status_raw"] == 0x8250
    lost = Driven("bench", referenced=False, count_offset=9000).cycles(30)
    assert lost["drive_status_raw"] == 0x0250
    assert lost["motor_travel_m"] == pytest.approx(9000 * 62.83185307e-3 / 77824, abs=1e-6)


def test_a_drive_commanded_by_wires_never_calls_itself_referenced():
    driven = Driven("bench_analog")
    driven.cycles(30)
    assert not driven.model.machine["is_referenced"][0]


def test_an_offset_of_the_count_is_nothing_that_the_loops_notice():
    plain, off = Driven("bench").enable(8), Driven("bench", count_offset=9000).enable(8)
    zero = off.decoder.measured["motor_travel_m"]
    for driven, at in ((plain, 0.0), (off, zero)):
        driven.cycles(200, cmd_motor_travel_m=at + 2e-3)
    assert off.model.sensors["motor_angle_rad"] == pytest.approx(
        plain.model.sensors["motor_angle_rad"], abs=2e-3
    )


def test_homing_here_sets_the_count_to_the_home_position():
    driven = homing(edited("bench", AT), count_offset=-4321)
    assert word(driven) & (REFERENCED | REACHED | ATTAINED | ERROR) == REACHED  # not started
    driven.cycle(cmd_drive_control_raw=START)
    measured = driven.cycle()
    assert word(driven) & (REFERENCED | REACHED | ATTAINED | ERROR) == (
        REFERENCED | REACHED | ATTAINED
    )
    assert measured["motor_travel_m"] == pytest.approx(12e-3, abs=1e-6)
    driven.cycle(cmd_drive_mode_raw=8, cmd_motor_travel_m=12e-3, cmd_drive_control_raw=0x0F)
    measured = driven.cycles(100)
    assert word(driven) & (REFERENCED | ATTAINED | ERROR) == REFERENCED
    assert measured["motor_travel_m"] == pytest.approx(12e-3, abs=2e-6)


def test_it_starts_on_the_rising_edge_of_its_bit_and_only_when_enabled():
    driven = Driven("bench", referenced=False)
    driven.cycles(30, cmd_drive_mode_raw=MODE)
    for control in (0x16, 0x17, 0x1F, 0x1F):  # the bit is up before the drive is
        driven.cycles(3, cmd_drive_control_raw=control)
    assert not word(driven) & REFERENCED
    driven.cycles(2, cmd_drive_control_raw=0x0F)
    driven.cycles(2, cmd_drive_control_raw=START)
    assert word(driven) & REFERENCED


@pytest.mark.parametrize(("method", "way"), [(34, 1.0), (33, -1.0)])
def test_the_index_is_found_slowly_and_exactly(method, way):
    driven = homing()
    driven.model._drive["homing_method"], driven.model._drive["home_counts"] = method, 500
    driven.cycles(5, cmd_drive_control_raw=START)
    assert word(driven) & (REFERENCED | REACHED | ATTAINED | ERROR) == 0
    fastest = 0.0
    for _ in range(8000):
        driven.cycle()
        fastest = max(fastest, way * driven.model.sensors["motor_speed_rad_s"][0])
        if word(driven) & ATTAINED:
            break
    assert word(driven) & (REFERENCED | REACHED) == REFERENCED | REACHED
    assert 0.5 < fastest < 2.0  # 10 rpm are 1.05 rad/s
    driven.cycles(200)
    turns = driven.model.sensors["motor_angle_rad"][0] / (2.0 * math.pi)
    assert math.remainder(turns - INDEX_PHASE_TURNS, 1.0) == pytest.approx(0.0, abs=3e-3)
    assert driven.decoder.measured["motor_travel_m"] / (62.83185307e-3 / 77824) == pytest.approx(
        500, abs=2
    )


def test_homing_is_interrupted_by_its_bit_and_refused_for_an_unknown_method():
    driven = homing()
    driven.model._drive["homing_method"] = 34
    driven.cycles(50, cmd_drive_control_raw=START)
    driven.cycles(50, cmd_drive_control_raw=0x0F)
    assert word(driven) & (REFERENCED | REACHED | ATTAINED | ERROR) == REACHED
    assert abs(driven.model.sensors["motor_speed_rad_s"][0]) < 0.1
    driven.model._drive["homing_method"] = 17
    driven.cycles(3, cmd_drive_control_raw=START)
    assert word(driven) & (REACHED | ATTAINED | ERROR) == REACHED | ERROR


def test_a_quick_stop_ends_homing():
    driven = homing()
    driven.model._drive["homing_method"] = 34
    driven.cycles(100, cmd_drive_control_raw=START)
    driven.cycles(100, cmd_drive_control_raw=0x12)
    assert word(driven) & 0x6F == 0x07 and abs(driven.model.sensors["motor_speed_rad_s"][0]) < 0.1


def test_home_counts_are_those_of_the_rig_files_place():
    from sim_backend.wiring import wire_drive

    assert wire_drive(rig("knee"))["home_counts"][0] == 0
    assert wire_drive(edited("bench", AT))["home_counts"][0] == round(
        12e-3 * 77824 / 62.83185307e-3
    )

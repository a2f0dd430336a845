"""The drive commanded by a voltage and enabled by a wire."""

import math

import pytest
from sim_rigs import Driven, edited, rig

from epa_rt.config.source import ConfigError
from sim_backend.wiring import wire_drive

RPM = 2 * math.pi / 60


def test_the_wire_enables_and_the_voltage_turns():
    driven = Driven("bench_analog")
    driven.cycles(30)
    assert driven.plant_command["enabled"] == 0.0
    measured = driven.cycles(300, cmd_drive_enable=1.0, cmd_motor_speed_m_s=0.03)
    assert driven.plant_command["enabled"] == 1.0 and driven.plant_command["mode"] == 9
    assert measured["motor_speed_m_s"] == pytest.approx(0.03, abs=2e-3)
    driven.cycle(cmd_drive_enable=0.0)
    assert driven.plant_command["enabled"] == 0.0


def test_the_wire_does_nothing_while_the_drive_powers_up():
    driven = Driven("bench_analog")
    enabled = [
        driven.cycle(cmd_drive_enable=1.0) and float(driven.plant_command["enabled"])
        for _ in range(25)
    ]
    assert enabled == [0.0] * 20 + [1.0] * 5 or enabled == [0.0] * 21 + [1.0] * 4, enabled


@pytest.mark.parametrize("speed", [0.0, 0.01, -0.01, 0.08, -0.08])
def test_the_converter_has_twelve_bits(speed):
    driven = Driven("bench_analog")
    driven.cycles(30)
    driven.cycle(cmd_drive_enable=1.0, cmd_motor_speed_m_s=speed)
    volt = speed / 0.06283185307 * 4.56
    step_v = 20.0 / 4096
    turned = driven.plant_command["target_speed_rad_s"] / (250 * RPM)
    assert turned == pytest.approx(math.floor(round(volt / 10 * 32768) / 16) * step_v, abs=1e-9)
    assert volt - step_v - 1e-3 <= turned <= volt + 1e-3


def test_its_speed_voltage_and_travel_agree_with_the_gear():
    """4.56 V are 1140 rpm, and 1140 rpm are one turn of the spool a second."""
    assert 4.56 * 250 == 1140 == 19 * 60
    assert wire_drive(rig("bench_analog"))["analog_rad_s_per_count"][0] == pytest.approx(
        250 * RPM * 10 / 32768
    )


def test_over_the_bus_it_only_reports():
    driven = Driven("bench_analog")
    assert driven.cycles(30)["drive_status_raw"] == 0x0250
    assert driven.cycles(3, cmd_drive_enable=1.0)["drive_status_raw"] == 0x0237


def test_a_rig_without_a_drive_has_nothing_to_move():
    on = edited("bench_analog")
    on = on.model_copy(update={"bus": on.bus[:4]})
    on.__dict__.pop("slaves")  # computed once, for the whole bus
    with pytest.raises(ConfigError, match="no EPOS4"):
        wire_drive(on)

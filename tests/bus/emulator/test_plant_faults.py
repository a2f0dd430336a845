"""Faults of the plant, without any bus: what acts, what is seen, and that no fault means no
difference.
"""

import struct

import pytest

from epa_rt.config.rig import load_rig
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.image import image_of
from sim_backend.devices import ENABLED, FAULT, SWITCH_ON_DISABLED
from sim_backend.faults import PLANT_FAULTS, FaultyRigModel, make_fault
from sim_backend.rig_model import RigModel
from tests.bus.emulator.conftest import RIGS

FILL, VENT = 1, 0  # the exhaust is inverted: 0 lets it open


class Bench:
    def __init__(self, name="bench"):
        self.rig = load_rig(RIGS / f"{name}.yaml")
        self.plant = load_plant(RIGS / self.rig.plant)
        self.model = FaultyRigModel(self.rig, self.plant, 1)
        self.outs, self.ins = image_of(self.rig, outputs=True), image_of(self.rig, outputs=False)
        self.inputs = b""

    def fault(self, kind, where="", **more):
        self.model.faults.add(make_fault(PLANT_FAULTS, kind, where, **more))

    def clear(self):
        self.model.faults.clear(self.model)

    def run(self, cycles, valves=0b10, control=0, mode=8, position=0):
        for _ in range(cycles):
            outputs = bytearray(self.outs.size)
            outputs[0] = valves
            struct.pack_into(
                "<Hbiih",
                outputs,
                self.outs.places["drive.control_word"].byte,
                control,
                mode,
                position,
                0,
                0,
            )
            self.inputs = self.model.cycle(bytes(outputs))

    def enable(self):
        for control in (0x06, 0x07, 0x0F):
            self.run(30, control=control)
        assert self.model.machine["state"][0] == ENABLED

    def read(self, entry):
        place = self.ins.places[entry]
        return struct.unpack_from("<" + place.entry.code, self.inputs, place.byte)[0]

    @property
    def pressure_pa(self):
        return self.model.state["truth"]["pressure_pa"][0, 0]


@pytest.fixture
def bench():
    return Bench()


def test_without_a_fault_it_is_the_plain_model(bench):
    plain = RigModel(bench.rig, bench.plant, 1)
    for k in range(300):
        outputs = bytes([k // 50 & 3]) + bytes(bench.outs.size - 1)
        assert bench.model.cycle(outputs) == plain.cycle(outputs)


def test_a_fault_begins_at_its_cycle_and_ends(bench):
    bench.fault("wire_broken", "muscle_pressure_pa", at_cycle=5, cycles=3)
    seen = []
    for _ in range(10):
        bench.run(1)
        seen.append(bench.read("analog_in.ch1") == -32768)
    assert seen == [False] * 5 + [True] * 3 + [False] * 2


def test_a_broken_wire_shows_in_value_and_status(bench):
    bench.fault("wire_broken", "muscle_pressure_pa")
    bench.run(3)
    assert (
        bench.read("analog_in.ch1") == -32768 and bench.read("analog_in.ch1_status") & 0x41 == 0x41
    )
    bench.clear()
    bench.fault("wire_broken", "analog_in.ch1", value=0.0)
    bench.run(1)
    assert bench.read("analog_in.ch1") == 0 and bench.read("analog_in.ch1_status") & 0x41 == 0


def test_a_stuck_sensor_keeps_its_value_while_the_terminal_converts(bench):
    bench.run(5)
    bench.fault("sensor_stuck", "muscle_pressure_pa")
    values, toggles = set(), set()
    for _ in range(400):
        bench.run(1, valves=0b11)
        values.add(bench.read("analog_in.ch1"))
        toggles.add(bench.read("analog_in.ch1_status") >> 15)
    assert len(values) == 1 and toggles == {0, 1} and bench.pressure_pa > 250e3


def test_noise_has_the_size_that_was_asked_for_and_a_seed(bench):
    other = Bench()
    for one in (bench, other):
        one.fault("sensor_noisy", "muscle_force_n", value=0.2)
    volts = []
    for _ in range(2000):
        bench.run(1)
        other.run(1)
        assert bench.inputs == other.inputs
        volts.append(bench.read("analog_in.ch2") * 10 / 32768)
    mean = sum(volts) / len(volts)
    assert 0.18 < (sum((v - mean) ** 2 for v in volts) / len(volts)) ** 0.5 < 0.22


def test_a_frozen_terminal_gives_no_new_sample(bench):
    bench.run(5)
    bench.fault("toggle_frozen", "analog_in")
    bench.run(1)
    first = bench.inputs[:16]
    for _ in range(50):
        bench.run(1, valves=0b11)
        assert bench.inputs[:16] == first


def test_valves_stay_open_and_shut_whatever_is_asked(bench):
    bench.fault("valve_stuck_closed", "cmd_muscle_inlet_open")
    bench.run(400, valves=0b11)
    assert bench.pressure_pa < 110e3
    bench.clear()
    bench.run(400, valves=0b11)
    assert bench.pressure_pa > 250e3
    bench.fault("valve_stuck_open", "muscle0_exhaust")
    bench.run(2000, valves=0b10)
    assert bench.pressure_pa < 150e3


def test_a_leak_empties_the_muscle_and_is_mended(bench):
    bench.run(400, valves=0b11)
    full = bench.pressure_pa
    bench.run(200)
    assert bench.pressure_pa > 0.9 * full
    bench.fault("leak")
    bench.run(400)
    emptied = bench.pressure_pa
    assert emptied < 0.5 * full
    bench.clear()
    bench.run(200)
    assert abs(bench.pressure_pa - emptied) < 0.1 * emptied


def test_a_lost_supply_fills_nothing(bench):
    bench.fault("supply_lost")
    bench.run(400, valves=0b11)
    assert bench.pressure_pa < 110e3
    bench.clear()
    bench.run(400, valves=0b11)
    assert bench.pressure_pa > 250e3


@pytest.mark.parametrize(("kind", "code"), [("drive_fault", 0x2310), ("following_error", 0x8611)])
def test_a_drive_fault_can_be_reset(bench, kind, code):
    bench.enable()
    bench.fault(kind)
    bench.run(3, control=0x0F)
    assert bench.model.machine["state"][0] == FAULT and bench.read("drive.error_code") == code
    assert bench.model.command["enabled"][0] == 0.0
    bench.run(1, control=0x00)
    bench.run(2, control=0x80)
    assert bench.model.machine["state"][0] == SWITCH_ON_DISABLED
    bench.run(1, control=0x00)
    assert bench.read("drive.error_code") == 0


def test_sto_stays_until_it_is_released(bench):
    bench.enable()
    bench.fault("sto")
    for control in (0x0F, 0x00, 0x80, 0x06, 0x07, 0x0F):
        bench.run(5, control=control)
        assert bench.model.command["enabled"][0] == 0.0 and bench.read("drive.error_code") == 0x8A88
    bench.clear()
    for control in (0x00, 0x80):
        bench.run(2, control=control)
    bench.enable()


def test_the_drive_believes_a_jump_of_its_encoder(bench):
    bench.enable()
    bench.run(200, control=0x0F)
    bench.fault("encoder_jump", value=2000.0)
    bench.run(1, control=0x0F)
    assert bench.read("drive.position") > 1900
    bench.run(1500, control=0x0F)
    assert (
        abs(bench.read("drive.position")) < 100
    )  # it has gone back to where it believes to be right
    assert bench.model.sensors["motor_angle_rad"][0] * 4096 / 6.283185 < -1800


def test_an_analog_drive_falls_and_comes_back(bench):
    analog = Bench("bench_analog")
    place = analog.outs.places["valves.ch3"]
    enabled = bytearray(analog.outs.size)
    enabled[place.byte] = 1 << place.bit
    for _ in range(50):
        analog.model.cycle(bytes(enabled))
    assert analog.model.command["enabled"][0] == 1.0
    analog.fault("drive_fault", cycles=5)
    for _ in range(3):
        inputs = analog.model.cycle(bytes(enabled))
    place = analog.ins.places["drive.status_word"]
    assert analog.model.command["enabled"][0] == 0.0 and inputs[place.byte] & 0x4F == 0x08
    for _ in range(5):
        analog.model.cycle(bytes(enabled))
    assert analog.model.command["enabled"][0] == 1.0

"""Every terminal on the emulated bus in lock step, without a network: its bytes are the simulated
backend's, and each has a fault that shows.
"""

import random

import pytest

from epa_rt.config.terminals import TERMINALS
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.codec import Decoder, Encoder
from sim_backend.backend import SimBackend
from sim_backend.bus.emulated_bus import EmulatedBus
from tests.bus.emulator.bring_up import Wire
from tests.other_terminals import EDITS, ROOT, rig_of

CYCLES = 300
PLANT = ROOT / "config/plants/bench.yaml"
PASSIVE = {"EK1100", "EPOS4"}


class Bus:
    """A rig in OP; ``run`` sends what its rows say, and keeps what came back."""

    def __init__(self, name, *more):
        self.rig = rig_of(name, *more)
        self.bus = EmulatedBus(self.rig, load_plant(PLANT), seed=1, lock_step=True)
        self.wire = Wire(self.bus)
        self.decoder, self.encoder = Decoder(self.rig), Encoder(self.rig)
        self.command = dict(self.encoder.safe)

    def run(self, cycles=50):
        for _ in range(cycles):
            inputs, _counter = self.wire.exchange(self.encoder.encode(self.command))
            self.measured = self.decoder.decode(inputs)

    def fault(self, kind, where, **more):
        self.bus.faults.add(kind, where, **more)

    def reason(self, name):
        """Why a row is not believed; '' where it is."""
        i = self.decoder.names.index(name)
        return self.decoder.reason(i) if self.decoder.invalid >> i & 1 else ""


def test_the_two_rigs_hold_every_terminal():
    there = {slave.device for name in EDITS for slave in rig_of(name).slaves}
    delivered = {"EL2124", "EL3004", "EL4034"}  # on the delivered rigs
    assert there == (set(TERMINALS) - delivered) | {"generic"}


@pytest.mark.parametrize("name", EDITS)
def test_the_same_bytes_as_the_simulated_backend(name):
    rig = rig_of(name)
    bus = EmulatedBus(rig, load_plant(PLANT), seed=5, lock_step=True)
    wire, choice = Wire(bus), random.Random(3)
    reference = SimBackend(rig, load_plant(PLANT), 5)
    reference.open()
    wire.exchange(bytes(wire.output_size))
    bus.rewind()
    for k in range(CYCLES):
        if k % 7 == 0:
            outputs = bytearray(choice.randbytes(wire.output_size))
            outputs[0] &= 0x0F
        inputs, counter = wire.exchange(bytes(outputs))
        assert counter == wire.expected_counter
        assert inputs == reference.exchange(bytes(outputs)).inputs_raw, f"cycle {k}"


@pytest.mark.parametrize("name", EDITS)
def test_pressure_force_and_angle_are_what_the_plant_has(name):
    bench = Bus(name)
    bench.command |= {"cmd_muscle_inlet_open": 1.0, "cmd_muscle_exhaust_open": 0.0}
    bench.run(120)
    assert bench.decoder.invalid == bench.decoder.stale == 0
    ports = bench.bus.plant.sensors[0]
    assert ports["muscle0_gauge_pa"] > 30e3  # the valve terminal has let air in
    gauge = bench.measured["muscle_pressure_pa"] - bench.rig.atmosphere_pa
    assert gauge == pytest.approx(ports["muscle0_gauge_pa"], abs=5e3)
    assert bench.measured["muscle_force_n"] == pytest.approx(ports["force_n"], abs=2.0)
    if name == "others":
        step = 2 * 3.14159265 / 4096
        angle = bench.measured["spool_angle_rad"]
        assert angle == pytest.approx(ports["motor_angle_rad"], abs=step)


@pytest.mark.parametrize("name", EDITS)
def test_digital_outputs_go_off_with_their_state(name):
    bench = Bus(name)
    bench.command |= {"cmd_muscle_inlet_open": 1.0, "cmd_muscle_exhaust_open": 0.0}
    bench.run(100)
    full = bench.measured["muscle_pressure_pa"]
    bench.fault("slave_falls", "valves")
    bench.run(200)
    start, _size = bench.bus.coupling.outputs_image.slices["valves"]
    assert bench.bus.coupling.outputs[start] == 0  # shut inlet, open exhaust
    assert bench.measured["muscle_pressure_pa"] < full


@pytest.mark.parametrize("name", EDITS)
def test_an_analog_output_without_its_master_goes_to_its_default(name):
    bench = Bus(name)
    bench.command["cmd_spare_v"] = 5.0
    bench.run(10)
    place = bench.bus.coupling.outputs_image.places["analog_out.ch1"]

    def counts():
        sent = bench.bus.coupling.outputs[place.byte : place.byte + 2]
        return int.from_bytes(sent, "little", signed=True)

    assert counts() == 16384
    bench.fault("slave_falls", "analog_out")
    bench.run(5)
    assert counts() == 0


def test_0_to_10_v_over_range_is_told_and_a_quiet_wire_is_below_the_sensor():
    bench = Bus("others")
    bench.fault("wire_broken", "muscle_pressure_pa", value=11.0)
    bench.run(5)
    assert "terminal reports an error (status 0x" in bench.reason("muscle_pressure_pa")
    assert bench.decoder._fields and bench.measured["muscle_pressure_pa"] != bench.measured
    bench = Bus("others")
    bench.fault("wire_broken", "muscle_pressure_pa")
    bench.run(5)
    assert bench.reason("muscle_pressure_pa").startswith("below the sensor's range, broken wire")


@pytest.mark.parametrize(
    ("milliampere", "words"),
    [
        (None, "terminal reports an error"),  # a broken wire
        (3.45, "terminal reports an error"),
        (3.58, "below the sensor's range, broken wire"),
        (3.62, ""),
        (3.9, ""),
        (20.0, "terminal over-range"),  # one count above what sixteen bits hold
        (21.2, "terminal reports an error"),
        (19.99, ""),
    ],
)
def test_4_to_20_ma_is_believed_within_what_namur_says(milliampere, words):
    bench = Bus("others_ma")
    bench.fault("wire_broken", "muscle_pressure_pa", value=milliampere)
    bench.run(5)
    reason = bench.reason("muscle_pressure_pa")
    assert reason.startswith(words) and bool(reason) == bool(words), reason


def test_an_encoder_says_that_its_line_is_open():
    bench = Bus("others")
    bench.fault("wire_broken", "spool_angle_rad")
    bench.run(5)
    assert bench.reason("spool_angle_rad").startswith("terminal reports an error (status 0x")


def test_an_encoder_that_stops_is_stale():
    bench = Bus("others")
    bench.fault("toggle_frozen", "encoder")
    bench.run(30)
    assert bench.decoder.stale == 1 << bench.decoder.names.index("spool_angle_rad")


def test_a_generic_terminal_has_the_faults_of_its_kind():
    bench = Bus("others_ma")
    bench.fault("toggle_frozen", "analog_b")
    bench.run(30)
    assert bench.decoder.stale == 1 << bench.decoder.names.index("muscle_force_n")
    bench = Bus("others_ma")
    bench.fault("wire_broken", "muscle_force_n")
    bench.run(5)
    assert bench.reason("muscle_force_n").startswith("below the sensor's range, broken wire")

"""In lock step the emulated bus gives the simulated backend's bytes."""

import random

import pytest

from epa_rt.config.rig import rig_from
from epa_rt.config.source import parse_yaml
from epa_rt.models.plant_file import load_plant
from epa_rt.signals.image import image_of
from sim_backend.backend import SimBackend
from sim_backend.bus.emulated_bus import EmulatedBus
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.conftest import RIGS

CYCLES = 2000


def commands(rig, seed):
    """Output images that switch everything on the rig, the drive through its states too."""
    image, choice, outputs = image_of(rig, outputs=True), random.Random(seed), b""
    control = image.places.get("drive.control_word")
    for k in range(CYCLES):
        outputs = bytearray(choice.randbytes(image.size) if k % 7 == 0 else outputs)
        start, size = image.slices["valves"]
        outputs[start] &= 0x0F
        if control is not None:
            outputs[control.byte : control.byte + 2] = (0x06, 0x07, 0x0F, 0x0F, 0x0F, 0x80)[
                k // 40 % 6
            ].to_bytes(2, "little")
            outputs[image.places["drive.mode"].byte] = 10
        yield bytes(outputs)


@pytest.mark.parametrize("name", ["bench", "bench_analog", "mass", "knee"])
def test_same_bytes_as_the_simulated_backend(make_bus, name):
    bus = make_bus(name, lock_step=True, seed=5)
    wire = Wire(bus)
    reference = SimBackend(bus.rig, load_plant(RIGS / bus.rig.plant), 5)
    reference.open()
    wire.exchange(bytes(wire.output_size))
    bus.rewind()
    for k, outputs in enumerate(commands(bus.rig, 3)):
        inputs, counter = wire.exchange(outputs)
        assert counter == wire.expected_counter
        assert inputs == reference.exchange(outputs).inputs_raw, f"cycle {k}"
    assert bus.cycle == CYCLES


@pytest.mark.parametrize("period_ms", [2, 0.5, 0.25])
def test_so_it_does_at_every_period(period_ms):
    text = (RIGS / "bench.yaml").read_text(encoding="utf-8")
    rig = rig_from(
        parse_yaml(text.replace("period: 1 ms", f"period: {period_ms} ms"), "bench.yaml")
    )
    plant = load_plant(RIGS / rig.plant)
    wire = Wire(EmulatedBus(rig, plant, seed=5, lock_step=True))
    reference = SimBackend(rig, plant, 5)
    reference.open()
    wire.exchange(bytes(wire.output_size))
    wire.bus.rewind()
    for k, outputs in enumerate(commands(rig, 3)):
        assert wire.exchange(outputs)[0] == reference.exchange(outputs).inputs_raw, f"cycle {k}"


def test_only_frames_with_all_outputs_move_the_plant(wire):
    wire.exchange(bytes(wire.output_size))
    before = wire.bus.cycle
    wire.master.one(10, wire.logical, bytes(wire.output_size + wire.input_size))  # LRD
    wire.master.one(12, wire.logical, bytes(1))  # the valves only
    wire.master.number(0x1001, 0x0130)
    wire.master.wait(100)
    assert wire.bus.cycle == before
    wire.exchange(bytes(wire.output_size))
    assert wire.bus.cycle == before + 1


def test_nothing_moves_before_all_are_in_op(make_bus):
    wire = Wire(make_bus("bench", lock_step=True), states=(2, 4))
    for _ in range(5):
        wire.exchange(bytes(wire.output_size))
    assert wire.bus.cycle == 0


def test_inputs_are_there_before_the_first_cycle(make_bus):
    """A master must be able to read the actual position before it lets a drive go."""
    wire = Wire(make_bus("bench", lock_step=True), states=(2, 4))
    inputs, counter = wire.exchange(bytes(wire.output_size))
    assert counter == wire.expected_counter
    assert int.from_bytes(inputs[2:4], "little", signed=True) > 3000  # 1 V: zero gauge pressure


def test_in_real_time_the_plant_runs_without_a_master(make_bus):
    bus = make_bus("bench")
    bus.advance_to(1_000_000_000)
    for ms in range(1, 101):
        bus.advance_to(1_000_000_000 + 1_000_000 * ms)
    assert bus.cycle == 100


@pytest.mark.parametrize("phase_ns", [0, 60_000, 500_000, 940_000])
def test_in_real_time_the_plant_keeps_away_from_the_frames_of_a_master_without_sync(
    make_bus, phase_ns
):
    """A step beside a frame would hold its answer up; a step half a period away does not, and none
    is lost by that.
    """
    wire = Wire(make_bus("bench"))
    bus, period_ns = wire.bus, 1_000_000
    wire.master.write(wire.at["coupler"], 0x0920, bytes(8))
    began_ns = wire.master.now_ns // period_ns * period_ns + 2 * period_ns + phase_ns
    bus.advance_to(began_ns)
    before = bus.cycle
    for k in range(1, 1001):
        wire.master.now_ns = began_ns + k * period_ns - wire.master.step_ns
        wire.exchange(bytes(wire.output_size))
        if k > 2:
            assert 0.12 * period_ns < bus.next_due_ns() - wire.master.now_ns < 0.88 * period_ns
        bus.advance_to(began_ns + k * period_ns + period_ns // 2 + 20_000)
    assert abs(bus.cycle - before - 1000) <= 1

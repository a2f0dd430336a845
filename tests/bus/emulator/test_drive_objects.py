"""The drive's option codes, ramps and homing through its objects, and what it loses with its
supply.
"""

import struct

import pytest

from epa_rt.config.rig import load_rig
from epa_rt.models.plant_file import load_plant
from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.devices import ENABLED, FAULT, NOT_READY, QUICK_STOP, SWITCH_ON_DISABLED
from sim_backend.faults import PLANT_FAULTS, FaultyRigModel, make_fault
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.conftest import RIGS
from tests.bus.emulator.small_master import Abort

ANALOG_IN, DRIVE = 0x1003, 0x1005
REFERENCED, ATTAINED = 0x8000, 0x1000
DEFAULTS = {
    0x6007: 3,
    0x605A: 6,
    0x605B: 0,
    0x605C: 1,
    0x605D: 1,
    0x605E: 2,
    0x6065: 2000,
    0x6084: 10_000,
    0x6085: 10_000,
    0x6098: 7,
    0x609A: 1000,
    0x30B0: 0,
}


class Driven:
    """The bench in lock step in OP, with the drive's entries of its frame."""

    def __init__(self, **more):
        rig = load_rig(RIGS / "bench.yaml")
        self.bus = EmulatedBus(rig, load_plant(RIGS / rig.plant), lock_step=True, **more)
        self.wire = Wire(self.bus)
        self.master = self.wire.master

    def run(self, cycles, control=0, mode=9, speed=0, position=0):
        for _ in range(cycles):
            inputs, _ = self.wire.exchange(
                bytes(9) + struct.pack("<Hbiih", control, mode, position, speed, 0)
            )
        self.status, self.shown, self.position = struct.unpack_from("<Hbi", inputs, 16)
        return self

    def enable(self, mode=9):
        for control in (0x06, 0x07, 0x0F):
            self.run(30, control, mode)
        assert self.state == ENABLED
        return self

    @property
    def state(self):
        return int(self.bus.plant.machine["state"][0])

    @property
    def powered(self):
        return bool(self.bus.plant.command["enabled"][0])

    def write(self, index, code, value, subindex=0):
        self.master.download(DRIVE, index, subindex, struct.pack("<" + code, value))

    def read(self, index, subindex=0):
        data = self.master.upload(DRIVE, index, subindex)
        return int.from_bytes(data, "little", signed=True)


def test_they_have_their_values_after_power_up_and_again_after_the_next():
    bus = EmulatedBus(
        load_rig(RIGS / "bench.yaml"), load_plant(RIGS / "../plants/bench.yaml"), lock_step=True
    )
    items = bus.slaves["drive"].dictionary
    assert {index: items.item(index, 0).number for index in DEFAULTS} == DEFAULTS
    items.download(0x605A, 0, b"\2\0", 2)
    items.download(0x6085, 0, struct.pack("<I", 500), 2)
    assert bus.plant._drive["quick_stop"][0] == 2
    assert bus.plant._drive["quick_stop_rad_s2"][0] == pytest.approx(52.36, abs=0.01)
    motor = items.item(0x3001, 1).number
    bus.slaves["drive"].power_up()
    assert {index: items.item(index, 0).number for index in DEFAULTS} == DEFAULTS
    assert bus.plant._drive["quick_stop"][0] == 6 and items.item(0x3001, 1).number == motor > 0


@pytest.mark.parametrize(
    ("index", "code", "value"),
    [
        (0x6007, "h", 4),
        (0x605A, "h", 3),
        (0x605B, "h", 2),
        (0x605C, "h", -1),
        (0x605E, "h", 3),
        (0x6085, "I", 0),
        (0x6098, "b", 99),
    ],
)
def test_a_value_that_the_drive_does_not_know_is_refused(index, code, value):
    driven = Driven()
    before = driven.read(index)
    with pytest.raises(Abort, match="0x0609003[02]"):
        driven.write(index, code, value)
    assert driven.read(index) == before


@pytest.mark.parametrize(
    ("index", "value", "word", "ends"),
    [
        (0x605A, 2, 0x02, SWITCH_ON_DISABLED),
        (0x605A, 6, 0x02, QUICK_STOP),
        (0x605C, 1, 0x07, 3),
        (0x605B, 1, 0x06, 2),
    ],
)
def test_the_ramp_is_that_of_the_object(index, value, word, ends):
    driven = Driven()
    driven.write(index, "h", value)
    for ramp in (0x6084, 0x6085):
        driven.write(ramp, "I", 10_000)
    driven.enable().run(200, 0x0F, speed=1000)
    driven.run(50, word, speed=1000)
    speed = driven.bus.plant.sensors["motor_speed_rad_s"][0] * 60 / 6.283185
    assert 400 < speed < 600 and driven.powered  # 10 rpm less in every millisecond
    driven.run(150, word, speed=1000)
    assert driven.state == ends and driven.powered == (ends == QUICK_STOP)


def test_off_at_once_is_off_at_once():
    for index, word in ((0x605B, 0x06), (0x605C, 0x07)):
        driven = Driven()
        driven.write(index, "h", 0)
        driven.enable().run(200, 0x0F, speed=1000)
        assert not driven.run(1, word).powered


@pytest.mark.parametrize("how", ["slave_falls", "frames_lost"])
def test_a_dead_master_leaves_a_drive_that_brakes_and_holds(how):
    driven = Driven()
    driven.enable().run(200, 0x0F, speed=1000)
    if how == "slave_falls":
        driven.bus.faults.add("slave_falls", "drive", value=0x1B)
        driven.run(400, 0x0F, speed=1000)
    else:
        driven.bus.faults.add("frames_lost", cycles=400)
        for _ in range(400):
            driven.wire.exchange(bytes(9) + struct.pack("<Hbiih", 0x0F, 9, 0, 1000, 0))
    assert driven.state == QUICK_STOP and driven.powered
    assert abs(driven.bus.plant.sensors["motor_speed_rad_s"][0]) < 0.5


def test_homing_over_the_bus_and_its_loss_with_the_supply():
    driven = Driven(referenced=False, count_offset=4000)
    assert not driven.run(30).status & REFERENCED and driven.position == 4000
    driven.write(0x6098, "b", 37)
    driven.write(0x30B0, "i", -1500)
    driven.enable(6)
    assert driven.shown == 6
    driven.run(3, 0x1F, 6)
    assert driven.status & (REFERENCED | ATTAINED) == REFERENCED | ATTAINED
    assert driven.position == driven.read(0x6064) == -1500
    driven.run(3, 0x0F, 8, position=-1500)
    assert driven.read(0x6041) & REFERENCED
    driven.bus.faults.add("drive_supply_lost", cycles=5)
    driven.wire.exchange(bytes(driven.wire.output_size))
    assert driven.state == NOT_READY and not driven.powered
    for _ in range(10):
        driven.wire.exchange(bytes(driven.wire.output_size))
    machine = driven.bus.plant.machine[0]
    assert not machine["is_referenced"] and driven.bus.slaves["drive"].al.state == 1
    turned = driven.bus.plant.sensors["motor_angle_rad"][0] * 4096 / 6.283185307
    assert turned + machine["offset_counts"] == pytest.approx(0.0, abs=2.0)


def test_the_plain_simulation_loses_its_drives_supply_too():
    rig = load_rig(RIGS / "bench.yaml")
    model = FaultyRigModel(rig, load_plant(RIGS / rig.plant), 1, count_offset=700)
    model.faults.add(make_fault(PLANT_FAULTS, "count_offset", value=9000.0))
    model.faults.add(make_fault(PLANT_FAULTS, "drive_supply_lost", at_cycle=50, cycles=20))
    words = []
    for _ in range(120):
        inputs = model.cycle(bytes(len(model._outputs)))
        words.append(struct.unpack_from("<Hbi", inputs, 16))
    assert words[40] == (0x8250, 0, 9700)
    assert words[60] == (0x0200, 0, 0) and words[-1] == (0x0250, 0, 0)


def test_the_filter_follows_its_objects():
    driven = Driven()  # its master has switched it off
    rows = driven.bus.plant._analog
    assert (rows["window_cycles"] == 0.0).all()
    driven.master.download(ANALOG_IN, 0x8000, 0x15, b"\1\0")
    assert (rows["window_cycles"] == 0.0).all()
    driven.master.download(ANALOG_IN, 0x8000, 0x06, b"\1")
    assert rows["window_cycles"] == pytest.approx(1000 / 60)
    driven.bus.rewind()
    rows = driven.bus.plant._analog
    assert rows["window_cycles"] == pytest.approx(1000 / 60)
    driven.master.download(ANALOG_IN, 0x8000, 0x15, b"\2\0")
    assert (rows["window_cycles"] == 0.0).all() and (rows["smoothing"] < 1.0).all()
    assert set(rows["conversion_ns"]) == {500_000}


def test_as_delivered_it_is_a_fifty_hertz_mean():
    rig = load_rig(RIGS / "bench.yaml")
    bus = EmulatedBus(rig, load_plant(RIGS / rig.plant))
    assert bus.plant._analog["window_cycles"] == pytest.approx(20.0)


def test_a_fault_of_the_drive_is_braked_and_shown_with_its_code():
    driven = Driven()
    driven.enable().run(200, 0x0F, speed=1000)
    driven.bus.faults.add("following_error")
    driven.run(20, 0x0F, speed=1000)
    assert driven.powered and driven.status & 0x4F == 0x0F
    driven.run(200, 0x0F, speed=1000)
    assert driven.state == FAULT and not driven.powered
    assert driven.bus.plant.machine["error_code"][0] == 0x8611

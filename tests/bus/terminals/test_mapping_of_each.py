"""The driver's mapping against the object dictionaries of the emulated terminals, without a wire:
each comes up, and one that is not as described is named.
"""

import pytest

from drivers.bring_up import objects_at_start
from drivers.identity import Found, device_of, differences
from drivers.mapping import assignment_steps, described_pdos, set_up_mapping
from epa_rt.backend import BackendError
from epa_rt.config.generic_terminal import GenericTerminal
from epa_rt.config.rig import Slave
from epa_rt.config.terminals import TERMINALS
from epa_rt.models.plant_file import load_plant
from sim_backend.bus import registers as reg
from sim_backend.bus.emulated_bus import EmulatedBus
from tests.other_terminals import EDITS, ROOT, rig_of


class Served:
    """The objects of an emulated slave in PREOP, asked as the driver's mailbox asks."""

    def __init__(self, slave, label):
        self.dictionary, self.label = slave.dictionary, label

    def number(self, index, subindex=0):
        return int.from_bytes(self.dictionary.upload(index, subindex, reg.PREOP), "little")

    def write(self, index, subindex, data):
        self.dictionary.download(index, subindex, data, reg.PREOP)

    def steps_to_set(self, index, subindex, data):
        return [lambda: self.write(index, subindex, data)]


def terminals():
    return [
        pytest.param(name, slave.name, id=f"{slave.device}-{name}")
        for name in EDITS
        for slave in rig_of(name).slaves
        if slave.description.serves_objects and not slave.description.is_drive
    ]


def served(name, of):
    rig = rig_of(name)
    bus = EmulatedBus(rig, load_plant(ROOT / "config/plants/bench.yaml"))
    slave = next(slave for slave in rig.slaves if slave.name == of)
    return slave, bus.slaves[of], Served(bus.slaves[of], f"{of} (slave, {slave.device})")


@pytest.mark.parametrize(("name", "of"), terminals())
def test_each_comes_up_and_carries_what_the_image_has(name, of):
    slave, emulated, mailbox = served(name, of)
    for place, data in objects_at_start(slave):
        mailbox.write(*place, data)
    set_up_mapping(mailbox, slave)
    for outputs, entries in ((True, slave.description.outputs), (False, slave.description.inputs)):
        bits = sum(entry.bits for entry in entries)
        assert emulated.process_bytes(outputs) == (bits + 7) // 8
    for step in assignment_steps(mailbox, slave):  # again, as after a lost supply
        step()
    set_up_mapping(mailbox, slave)


@pytest.mark.parametrize(("name", "of"), terminals())
def test_a_value_at_another_object_is_named(name, of):
    slave, emulated, mailbox = served(name, of)
    entry = (slave.description.outputs or slave.description.inputs)[-1]
    changed = []
    for pdo in emulated.pdos.values():
        for item in emulated.dictionary.objects[pdo.index].items.values():
            if item.number >> 16 == entry.index and item.number & 0xFF == entry.bits:
                item.value = (item.number ^ 0x2000).to_bytes(4, "little")
                changed.append(pdo.index)
    assert changed
    with pytest.raises(BackendError) as found:
        set_up_mapping(mailbox, slave)
    assert str(found.value).startswith("found ") and mailbox.label in str(found.value)


def test_the_encoder_takes_its_wide_counter_and_looks_for_open_lines():
    slave = Slave(name="encoder", device="EL5101")
    assert [pdo.index for pdo in described_pdos(slave, True)] == [0x1603]
    assert [pdo.index for pdo in described_pdos(slave, False)] == [0x1A04]
    assert objects_at_start(slave) == [
        ((0x8010, 0x0B), b"\1"),
        ((0x8010, 0x0C), b"\1"),
        ((0x8010, 0x0D), b"\0"),
    ]
    less = Slave(name="encoder", device="EL5101", inputs=("counter",))
    with pytest.raises(BackendError, match="found inputs of encoder that no process data of"):
        described_pdos(less, False)


def test_what_the_rig_file_writes_goes_before_what_its_kind_needs():
    startup = [{"object": "0x8010:0B", "type": "u8", "value": 0}]
    slave = Slave(name="encoder", device="EL5101", startup=startup)
    assert dict(objects_at_start(slave))[0x8010, 0x0B] == b"\0"
    assert len(objects_at_start(slave)) == 3


@pytest.mark.parametrize("name", EDITS)
def test_identities_are_compared_with_each_description(name):
    slaves = rig_of(name).slaves
    sound = [
        Found(s.description.vendor, s.description.products[0], s.description.revisions[1])
        for s in slaves
    ]
    assert differences(slaves, sound) == []
    for i, slave in enumerate(slaves):
        other = sound.copy()
        newer = slave.description.revisions[1] + 0x10000
        other[i] = other[i]._replace(revision=newer)
        (sentence,) = differences(slaves, other)
        assert f"found revision 0x{newer:08X}" in sentence and slave.name in sentence
        other[i] = Found(0x2, 0x12345678, 0)
        (sentence,) = differences(slaves, other)
        assert "an unknown device (vendor 0x00000002, product 0x12345678)" in sentence
    missing = [found for i, found in enumerate(sound) if i != 2]
    assert "it is missing" in " ".join(differences(slaves, missing))


def test_a_generic_terminal_whose_product_is_known_is_known_by_its_name():
    known = TERMINALS["EL3004"]
    slave = rig_of("others_ma").slaves[4]
    described = GenericTerminal(
        product=known.products[0], revisions=known.revisions, inputs=slave.terminal.inputs
    )
    twin = Slave(name="twin", device="generic", terminal=described)
    found = Found(known.vendor, known.products[0], 0x00130000)
    assert device_of(found, [twin]) == "EL3004" and differences([twin], [found]) == []

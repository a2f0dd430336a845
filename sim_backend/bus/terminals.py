"""Any terminal as a slave, out of its description in epa_rt/config/terminals/ or in the rig file:
identity, sync managers, PDOs, object dictionary, what it does without its master.

Sources: those of each description; ETG.1000.6. docs/emulated-bus.md says what is stored only.
"""

from collections.abc import Callable
from dataclasses import replace
from struct import pack

from epa_rt.config.rig import Slave as RigSlave
from epa_rt.config.terminal import (
    INPUTS,
    MAILBOX_IN,
    MAILBOX_OUT,
    OUTPUTS,
    UNASSIGNED,
    Alone,
    Device,
    Mapped,
    Setting,
)
from epa_rt.signals.image import Place
from sim_backend.bus import dictionary as od
from sim_backend.bus import sii
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.pdo_objects import add_assignment, add_identity, add_mapping, add_sync_objects
from sim_backend.bus.sii import Pdo, PdoEntry
from sim_backend.bus.slave import Controller, Settings, Slave
from sim_backend.input_filter import ENABLE_OBJECT, NO_FILTER, SELECT_OBJECT

_COUPLER = Controller(0x11, 8, 8, 0x00F0, is_copper=True, has_clock=True, is_emulated=True)
_BARE = Controller(0x12, 2, 4, 0x0030, is_emulated=True)
_WITH_OBJECTS = Controller(0x12, 3, 4, 0x0030)
_EBUS_PORTS, _COPPER_PORTS = 0x0033, 0x0131
_TYPES = {
    "?": od.BOOLEAN,
    "BIT2": od.BIT2,
    "b": od.INT8,
    "B": od.UINT8,
    "h": od.INT16,
    "H": od.UINT16,
    "i": od.INT32,
    "I": od.UINT32,
}
_STARTUP_TYPES = {
    "u8": od.UINT8,
    "i8": od.INT8,
    "u16": od.UINT16,
    "i16": od.INT16,
    "u32": od.UINT32,
    "i32": od.INT32,
}
_PROCESS_OBJECTS = 0x6000
_TX_STATE, _TX_TOGGLE = (0x0F, 7, "TxPDO State"), (0x10, 9, "TxPDO Toggle")  # in 0x60n0, 0x180n
_SIZE = 2  # bytes of an analog output
_RAMP, _HOLD = 1, 2  # what an analog output does without its master; 0: its default value


class Terminal(Slave):
    """A terminal as its description says. ``on_filter`` is told when the objects of an input filter
    are written.
    """

    def __init__(self, slave: RigSlave, agenda: Agenda, settings: Settings):
        self.described = slave.description
        revision = self.described.emulated_revision if slave.revision is None else slave.revision
        content = _content(self.described, slave.product, revision)
        super().__init__(slave.name, _controller(self.described), content, agenda, settings)
        self.on_filter: Callable[[], None] = lambda: None
        self._assignments: dict[bool, Callable[[], list[int]]] = {}
        if self.described.serves_objects:
            self._add_objects(content)
            self._add_startup(slave)
        if self.has_filter:
            for place in (ENABLE_OBJECT, SELECT_OBJECT):
                self.dictionary.item(*place).written = lambda: self.on_filter()

    @property
    def has_filter(self) -> bool:
        sampling = self.described.sampling
        return sampling is not None and sampling.has_filter

    @property
    def filter_selection(self) -> int:
        """0x8000:15, or NO_FILTER where 0x8000:06 switches it off, or there is none."""
        if not self.has_filter:
            return NO_FILTER
        is_on = self.dictionary.item(*ENABLE_OBJECT).number
        return self.dictionary.item(*SELECT_OBJECT).number if is_on else NO_FILTER

    def key(self, index: int, subindex: int, bits: int) -> tuple[int, int]:
        """How an object of the process data is known in the image."""
        return index, 0x11 if self.described.at_one is not None and bits == 16 else subindex

    def assigned(self, outputs: bool) -> list[Pdo]:
        if outputs not in self._assignments:
            return super().assigned(outputs)
        return [self.pdos[index] for index in self._assignments[outputs]()]

    def safe_outputs(self, image: bytearray, places: list[Place]) -> None:
        alone = self.described.alone
        if alone is None:
            super().safe_outputs(image, places)
            return
        for place in places:
            end = place.byte + _SIZE
            present = int.from_bytes(image[place.byte : end], "little", signed=True)
            value = self._safe_value(alone, (place.entry.index - 0x7000) >> 4, present)
            image[place.byte : end] = pack("<h", value)

    def _safe_value(self, alone: Alone, n: int, present: int) -> int:
        behaviour, default, ramp = (
            self.dictionary.item(0x8000 + 0x10 * n, subindex).number
            for subindex in (alone.reaction, alone.default, alone.ramp)
        )
        if behaviour == _HOLD and self.is_present:
            return present
        if behaviour == _RAMP and self.is_present:
            # digits per millisecond, once per plant period
            return present + min(max(default - present, -ramp), ramp)
        return default if self.is_present else 0

    def _add_objects(self, content: sii.SiiContent) -> None:
        add_identity(self.dictionary, content, self.described.device_type)
        for pdo in content.pdos:
            add_mapping(self.dictionary, pdo)
        numbers = {
            outputs: tuple(pdo.index for pdo in content.pdos if (pdo.index < 0x1A00) == outputs)
            for outputs in (True, False)
        }
        add_sync_objects(self.dictionary, numbers[True], numbers[False])
        for outputs, index in ((True, 0x1C12), (False, 0x1C13)):
            if numbers[outputs]:
                self._add_assignment(outputs, index, numbers[outputs])
        self._add_process_objects(content)

    def _add_assignment(self, outputs: bool, index: int, numbers: tuple[int, ...]) -> None:
        """Which PDOs travel: to be chosen, or as it is."""
        default = [pdo.index for pdo in super().assigned(outputs)]
        if self.described.chooses:
            self._assignments[outputs] = add_assignment(
                self.dictionary,
                index,
                default,
                lambda chosen: 0 if set(chosen) <= set(numbers) else od.VALUE_RANGE,
                lambda: self.on_change(),
            )
            return
        items = {
            n: od.number(f"SubIndex {n:03d}", od.UINT16, number)
            for n, number in enumerate(default, 1)
        }
        self.dictionary.record(index, "PDO assign", items, od.ARRAY)

    def _add_process_objects(self, content: sii.SiiContent) -> None:
        """What travels, to be read, and what may be set, channel by channel."""
        records = {record.index: record for record in self.described.records}
        objects: dict[int, dict[int, od.Item]] = {}
        for pdo in content.pdos:
            for entry in pdo.entries:
                if entry.index >= _PROCESS_OBJECTS:
                    item = self._live(entry.name, entry.data_type, entry.index, entry.subindex)
                    objects.setdefault(entry.index, {}).setdefault(entry.subindex, item)
                elif entry.subindex == _TX_TOGGLE[1] and entry.index >= 0x1800:
                    channel = 0x6000 + 0x10 * ((entry.index - 0x1800) // 2)
                    for subindex, at, name in (_TX_STATE, _TX_TOGGLE):
                        item = self._live(name, od.BOOLEAN, entry.index, at)
                        objects[channel][subindex] = item
        for n, (index, items) in enumerate(objects.items()):
            name = f"{self.described.process_name}{n + 1}"
            self.dictionary.record(index, name, dict(sorted(items.items())))
            if record := records.pop(0x8000 + (index & 0xFFF), None):
                self._add_settings(record.index, record.name, record.settings)
        for record in records.values():
            self._add_settings(record.index, record.name, record.settings)

    def _add_settings(self, index: int, name: str, settings: tuple[Setting, ...]) -> None:
        writable = od.READ | od.WRITE
        items = {
            setting.subindex: od.number(
                setting.name, _TYPES[setting.code], setting.value, writable, high=setting.high
            )
            for setting in settings
        }
        self.dictionary.record(index, name, items)

    def _add_startup(self, slave: RigSlave) -> None:
        """What a rig file writes into a terminal that it describes itself: these are there."""
        if not self.described.is_generic:
            return
        for sdo in slave.startup:
            index, subindex = sdo.place
            item = od.number(sdo.object, _STARTUP_TYPES[sdo.type], 0, od.READ | od.WRITE)
            if index not in self.dictionary.objects:
                items = {subindex: item} if subindex else {0: item}
                self.dictionary.record(index, "Settings", items)
            elif subindex not in self.dictionary.objects[index].items:
                items = self.dictionary.objects[index].items
                items[subindex] = item
                if 0 in items and subindex:
                    items[0].value = bytes([max(items)])

    def _live(self, name: str, data_type: int, index: int, subindex: int) -> od.Item:
        """An item that reads what travels now."""
        access = od.READ | (od.RX_PDO if index >> 12 == 7 else od.TX_PDO)
        read = lambda: self._travelling(index, subindex, data_type)  # noqa: E731
        return od.number(name, data_type, access=access, read=read)

    def _travelling(self, index: int, subindex: int, data_type: int) -> bytes:
        """An object's value out of the process data, zero where it is not assigned."""
        bits = od.BITS[data_type]
        size = (bits + 7) // 8
        outputs = index >> 12 == 7
        number = self.sync_manager_for(OUTPUTS if outputs else INPUTS)
        if number is None:
            return bytes(size)
        position = 8 * self.esc.sync_managers.settings(number)[0]
        for pdo in self.assigned(outputs):
            for entry in pdo.entries:
                if (entry.index, entry.subindex) == (index, subindex):
                    first, shift = position >> 3, position & 7
                    raw = int.from_bytes(self.esc.memory[first : first + size + 1], "little")
                    return (raw >> shift & ((1 << bits) - 1)).to_bytes(size, "little")
                position += entry.bits
        return bytes(size)


def _controller(described: Device) -> Controller:
    if described.is_coupler:
        return _COUPLER
    return _WITH_OBJECTS if described.serves_objects else _BARE


def _content(described: Device, product: int | None, revision: int) -> sii.SiiContent:
    """What its EEPROM says."""
    managers = {manager.use: manager for manager in described.sync_managers}
    details = mailbox = 0
    sizes = (0, 0, 0, 0)
    uses = tuple(use - 2 for use in sorted(managers) if use in (OUTPUTS, INPUTS))
    if described.serves_objects:
        out, back = managers[MAILBOX_OUT], managers[MAILBOX_IN]
        sizes = (out.start, out.length, back.start, back.length)
        details = sii.SDO | sii.SDO_INFO | (sii.PDO_ASSIGN if described.chooses else 0)
        mailbox, uses = sii.COE_PROTOCOL, (1, 2, 3)
    pdos = tuple(
        Pdo(
            pdo.index,
            pdo.sync_manager if pdo.sync_manager != UNASSIGNED else 0xFF,
            tuple(_pdo_entry(described, mapped, revision) for mapped in pdo.entries),
            pdo.name,
        )
        for pdo in described.pdos
    )
    return sii.SiiContent(
        described.name,
        described.vendor,
        product or described.products[0],
        revision,
        mailbox=sizes,
        protocols=mailbox,
        coe_details=details,
        sync_managers=described.sync_managers,
        fmmu_uses=uses,
        pdos=pdos,
        ebus_ma=described.ebus_ma,
        ports=_COPPER_PORTS if described.is_coupler else _EBUS_PORTS,
    )


def _pdo_entry(described: Device, mapped: Mapped, revision: int) -> PdoEntry:
    if described.at_one is not None and revision in described.at_one:
        mapped = replace(mapped, subindex=1)
    data_type = _TYPES.get(mapped.code, 0)
    return PdoEntry(mapped.index, mapped.subindex, mapped.bits, data_type, mapped.name)

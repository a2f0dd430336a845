"""EPOS4 as a slave: PDO mapping written by the master, live objects out of the plant, emergencies,
loss of the bus.

Sources: maxon EPOS4 firmware specification (object dictionary, EtherCAT), CiA 402. The CiA 402
machine itself is sim_backend/devices.py.
"""

from epa_rt.config.devices import DEVICES
from epa_rt.config.terminal import INPUTS, MAILBOX_IN, MAILBOX_OUT, OUTPUTS, SyncManager
from epa_rt.signals.image import Place
from sim_backend.bus import dictionary as od
from sim_backend.bus import registers as reg
from sim_backend.bus import sii
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.coe import emergency
from sim_backend.bus.epos4_objects import DEFAULT_MAPPING, add_axis_objects
from sim_backend.bus.pdo_objects import add_assignment, add_identity, add_sync_objects
from sim_backend.bus.sii import Pdo, PdoEntry
from sim_backend.bus.slave import Controller, Settings, Slave

_CONTROLLER = Controller(0x11, 8, 8, 0x00F0, is_copper=True, has_clock=True)
_DEFAULT_PRODUCT, _DEFAULT_REVISION = 0x65520000, 0x01600000
_PDOS = tuple(range(0x1600, 0x1604)) + tuple(range(0x1A00, 0x1A04))
_ENTRIES_MAX = 12
_BYTES_MAX = 0x10F0 - 0x1060  # room of sync manager 2


class Epos4(Slave):
    """The drive's slave. ``axis`` holds the live objects; the bus binds it to the plant."""

    def __init__(
        self,
        name: str,
        agenda: Agenda,
        settings: Settings,
        product: int | None = None,
        revision: int | None = None,
    ):
        self._maps: dict[int, dict[int, od.Item]] = {}
        pdos = tuple(
            Pdo(
                index,
                (2 if index < 0x1A00 else 3) if index in (0x1600, 0x1A00) else 0xFF,
                self._default(index),
                f"PDO 0x{index:04X}",
            )
            for index in _PDOS
        )
        content = sii.SiiContent(
            "EPOS4",
            DEVICES["EPOS4"].vendor,
            product or _DEFAULT_PRODUCT,
            _DEFAULT_REVISION if revision is None else revision,
            mailbox=(0x1000, 48, 0x1030, 48),
            protocols=sii.COE_PROTOCOL,
            pdos=pdos,
            ports=0x0011,
            coe_details=sii.SDO | sii.SDO_INFO | sii.PDO_ASSIGN | sii.PDO_CONFIG,
            fmmu_uses=(1, 2, 3),
            dc_modes=(sii.DcMode("FreeRun", 0x0000), sii.DcMode("DC sync", 0x0300)),
            sync_managers=(
                SyncManager(0x1000, 48, 0x26, 0x01, MAILBOX_OUT),
                SyncManager(0x1030, 48, 0x22, 0x01, MAILBOX_IN),
                SyncManager(0x1060, 6, 0x64, 0x01, OUTPUTS),
                SyncManager(0x10F0, 6, 0x20, 0x01, INPUTS),
            ),
        )
        super().__init__(name, _CONTROLLER, content, agenda, settings)
        add_identity(self.dictionary, content, 0x00020192)
        add_sync_objects(self.dictionary, (0x1600,), (0x1A00,))
        self.axis = add_axis_objects(self.dictionary)
        for index in _PDOS:
            self._add_mapping(index)
        changed = lambda: self.on_change()  # noqa: E731
        self._rx = add_assignment(
            self.dictionary,
            0x1C12,
            [0x1600],
            lambda chosen: self._assignable(chosen, 0x1600),
            changed,
        )
        self._tx = add_assignment(
            self.dictionary,
            0x1C13,
            [0x1A00],
            lambda chosen: self._assignable(chosen, 0x1A00),
            changed,
        )

    @staticmethod
    def _default(index: int) -> tuple[PdoEntry, ...]:
        return tuple(PdoEntry(*entry) for entry in DEFAULT_MAPPING.get(index, ()))

    def _add_mapping(self, index: int) -> None:
        """0x160n / 0x1A0n: up to twelve entries, written while the count is zero."""
        default = [
            entry.index << 16 | entry.subindex << 8 | entry.bits
            for entry in self.pdos[index].entries
        ]
        access, direction = od.READ | od.WRITE_PREOP, od.RX_PDO if index < 0x1A00 else od.TX_PDO
        items: dict[int, od.Item] = {}

        def entry_check(data: bytes) -> None:
            if items[0].number:
                raise od.SdoAbort(od.COUNT_NOT_ZERO)
            self._mappable(int.from_bytes(data, "little"), direction)

        def count_check(data: bytes) -> None:
            if data[0] > _ENTRIES_MAX:
                raise od.SdoAbort(od.VALUE_HIGH)
            entries = [items[n + 1].number for n in range(data[0])]
            for entry in entries:
                self._mappable(entry, direction)
            if sum(entry & 0xFF for entry in entries) > 8 * _BYTES_MAX:
                raise od.SdoAbort(od.MAPPING_TOO_LONG)

        items[0] = od.number(
            "Number of mapped objects",
            od.UINT8,
            len(default),
            access,
            check=count_check,
            written=lambda: self.on_change(),
        )
        for n in range(_ENTRIES_MAX):
            value = default[n] if n < len(default) else 0
            items[n + 1] = od.number(
                f"Mapped object {n + 1}", od.UINT32, value, access, check=entry_check
            )
        self._maps[index] = items
        self.dictionary.record(
            index, "Receive PDO mapping" if index < 0x1A00 else "Transmit PDO mapping", items
        )

    def _mappable(self, entry: int, direction: int) -> None:
        try:
            item = self.dictionary.item(entry >> 16, entry >> 8 & 0xFF)
        except od.SdoAbort:
            raise od.SdoAbort(od.NO_OBJECT) from None
        if not item.access & direction or item.bits != entry & 0xFF:
            raise od.SdoAbort(od.NOT_MAPPABLE)

    def _assignable(self, chosen: list[int], first: int) -> int:
        return 0 if all(first <= index < first + 4 for index in chosen) else od.VALUE_RANGE

    def assigned(self, outputs: bool) -> list[Pdo]:
        result = []
        for index in self._rx() if outputs else self._tx():
            items = self._maps[index]
            words = [items[n + 1].number for n in range(items[0].number)]
            entries = tuple(PdoEntry(word >> 16, word >> 8 & 0xFF, word & 0xFF) for word in words)
            result.append(Pdo(index, 2 if outputs else 3, entries))
        return result

    def entered(self, previous: int, state: int) -> None:
        super().entered(previous, state)
        if previous == reg.OP:
            self.axis.bus_lost()

    def safe_outputs(self, image: bytearray, places: list[Place]) -> None:
        """Keeps them: what the drive does without its master stands in 0x6007."""

    def report(self, code: int) -> None:
        """An emergency message for a new error code (zero: error reset)."""
        if self.al.state != reg.INIT:
            self.mailbox.send(
                emergency(code, 0x00 if code == 0 else 0x01 if code >= 0x8000 else 0x21)
            )

    def power_up(self) -> None:
        for index, items in self._maps.items():
            entries = self.pdos[index].entries
            items[0].value = bytes([len(entries)])
            for n, entry in enumerate(entries):
                items[n + 1].value = (
                    entry.index << 16 | entry.subindex << 8 | entry.bits
                ).to_bytes(4, "little")
        for index, pdo in ((0x1C12, 0x1600), (0x1C13, 0x1A00)):
            items = self.dictionary.objects[index].items
            items[0].value, items[1].value = b"\x01", pdo.to_bytes(2, "little")
        self.axis.power_up()
        super().power_up()

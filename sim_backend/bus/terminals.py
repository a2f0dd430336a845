"""The terminals EK1100, EL2124, EL3004 and EL4034 as slaves: identity, sync managers, PDOs, object
dictionaries.

Sources: Beckhoff documentation of EL2124, EL30xx and EL40xx (CoE objects, process data, watchdog),
identity as in epa_rt/config/devices.py. docs/emulated-bus.md has the addresses, and says what is
stored only.
"""

from collections.abc import Callable
from struct import pack

from epa_rt.config.devices import DEVICES
from epa_rt.signals.image import Place
from sim_backend.bus import dictionary as od
from sim_backend.bus import registers as reg
from sim_backend.bus import sii
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.pdo_objects import add_assignment, add_identity, add_mapping, add_sync_objects
from sim_backend.bus.sii import Pdo, PdoEntry, SyncManagerSetting
from sim_backend.bus.slave import Controller, Settings, Slave
from sim_backend.input_filter import ENABLE_OBJECT, NO_FILTER, SELECT_OBJECT

_COUPLER = Controller(0x11, 8, 8, 0x00F0, is_copper=True, has_clock=True, is_emulated=True)
_DIGITAL = Controller(0x12, 2, 4, 0x0030, is_emulated=True)
_ANALOG = Controller(0x12, 3, 4, 0x0030)
_MAILBOX = (
    SyncManagerSetting(0x1000, 128, 0x26, 0x01, sii.MAILBOX_OUT),
    SyncManagerSetting(0x1080, 128, 0x22, 0x01, sii.MAILBOX_IN),
)
_EBUS_PORTS = 0x0033
_COPPER_PORTS = 0x0131


def _identity(
    kind: str, product: int | None, revision: int | None, default_revision: int
) -> tuple[int, int, int]:
    device = DEVICES[kind]
    return (
        device.vendor,
        product or device.products[0],
        default_revision if revision is None else revision,
    )


class Coupler(Slave):
    """EK1100: no process data, the reference clock."""

    def __init__(
        self,
        name: str,
        agenda: Agenda,
        settings: Settings,
        product: int | None = None,
        revision: int | None = None,
    ):
        content = sii.SiiContent(
            "EK1100",
            *_identity("EK1100", product, revision, 0x00120000),
            ports=_COPPER_PORTS,
            ebus_ma=-2000,
        )
        super().__init__(name, _COUPLER, content, agenda, settings)


class DigitalOutputs(Slave):
    """EL2124: four bits, no mailbox, no processor: after its watchdog the outputs are off until
    data come again.
    """

    def __init__(
        self,
        name: str,
        agenda: Agenda,
        settings: Settings,
        product: int | None = None,
        revision: int | None = None,
    ):
        pdos = tuple(
            Pdo(
                0x1600 + n,
                0,
                (PdoEntry(0x7000 + 0x10 * n, 1, 1, od.BOOLEAN, "Output"),),
                f"Channel {n + 1}",
            )
            for n in range(4)
        )
        content = sii.SiiContent(
            "EL2124",
            *_identity("EL2124", product, revision, 0x00120000),
            ports=_EBUS_PORTS,
            ebus_ma=130,
            pdos=pdos,
            fmmu_uses=(1,),
            sync_managers=(SyncManagerSetting(reg.DIGITAL_OUTPUTS, 0, 0x44, 0x09, sii.OUTPUTS),),
        )
        super().__init__(name, _DIGITAL, content, agenda, settings)


def _input_pdos() -> tuple[Pdo, ...]:
    pdos = []
    for n in range(4):
        index = 0x6000 + 0x10 * n
        value = PdoEntry(index, 0x11, 16, od.INT16, "Value")
        status = (
            PdoEntry(index, 1, 1, od.BOOLEAN, "Underrange"),
            PdoEntry(index, 2, 1, od.BOOLEAN, "Overrange"),
            PdoEntry(index, 3, 2, od.BIT2, "Limit 1"),
            PdoEntry(index, 5, 2, od.BIT2, "Limit 2"),
            PdoEntry(index, 7, 1, od.BOOLEAN, "Error"),
            PdoEntry(0, 0, 7),
            PdoEntry(0x1800 + 2 * n, 7, 1, od.BOOLEAN, "TxPDO State"),
            PdoEntry(0x1800 + 2 * n, 9, 1, od.BOOLEAN, "TxPDO Toggle"),
        )
        pdos.append(Pdo(0x1A00 + 2 * n, 3, (*status, value), f"AI TxPDO-Map Standard Ch.{n + 1}"))
        pdos.append(Pdo(0x1A01 + 2 * n, 0xFF, (value,), f"AI TxPDO-Map Compact Ch.{n + 1}"))
    return tuple(pdos)


class AnalogInputs(Slave):
    """EL3004: four inputs of +-10 V, 12 bits presented in 16. Its filter is on, 50 Hz FIR, until
    channel 1's objects say otherwise, for all channels.
    """

    def __init__(
        self,
        name: str,
        agenda: Agenda,
        settings: Settings,
        product: int | None = None,
        revision: int | None = None,
    ):
        content = sii.SiiContent(
            "EL3004",
            *_identity("EL3004", product, revision, 0x00150000),
            mailbox=(0x1000, 128, 0x1080, 128),
            ports=_EBUS_PORTS,
            ebus_ma=130,
            protocols=sii.COE_PROTOCOL,
            coe_details=sii.SDO | sii.SDO_INFO | sii.PDO_ASSIGN,
            pdos=_input_pdos(),
            fmmu_uses=(1, 2, 3),
            sync_managers=(
                *_MAILBOX,
                SyncManagerSetting(0x1100, 0, 0x04, 0x00, sii.OUTPUTS),
                SyncManagerSetting(0x1180, 16, 0x20, 0x01, sii.INPUTS),
            ),
        )
        super().__init__(name, _ANALOG, content, agenda, settings)
        self.on_filter: Callable[[], None] = lambda: None
        add_identity(self.dictionary, content, 0x012C1389)
        for pdo in content.pdos:
            add_mapping(self.dictionary, pdo)
        add_sync_objects(self.dictionary, (), tuple(range(0x1A00, 0x1A08)))
        self._assignment = add_assignment(
            self.dictionary,
            0x1C13,
            [0x1A00, 0x1A02, 0x1A04, 0x1A06],
            self._assignable,
            self._assigned,
        )
        for n in range(4):
            self._add_channel(n)
        for place in (ENABLE_OBJECT, SELECT_OBJECT):
            self.dictionary.item(*place).written = lambda: self.on_filter()

    @property
    def filter_selection(self) -> int:
        """0x8000:15, or NO_FILTER where 0x8000:06 switches it off."""
        is_on = self.dictionary.item(*ENABLE_OBJECT).number
        return self.dictionary.item(*SELECT_OBJECT).number if is_on else NO_FILTER

    def _add_channel(self, n: int) -> None:
        value = lambda: self._channel_bytes(n, 0x11)  # noqa: E731
        status = lambda bit, mask: lambda: bytes([self._status(n) >> bit & mask])  # noqa: E731
        access = od.READ | od.TX_PDO
        self.dictionary.record(
            0x6000 + 0x10 * n,
            f"AI Inputs Ch.{n + 1}",
            {
                1: od.number("Underrange", od.BOOLEAN, access=access, read=status(0, 1)),
                2: od.number("Overrange", od.BOOLEAN, access=access, read=status(1, 1)),
                3: od.number("Limit 1", od.BIT2, access=access, read=status(2, 3)),
                5: od.number("Limit 2", od.BIT2, access=access, read=status(4, 3)),
                7: od.number("Error", od.BOOLEAN, access=access, read=status(6, 1)),
                0x0F: od.number("TxPDO State", od.BOOLEAN, access=access, read=status(14, 1)),
                0x10: od.number("TxPDO Toggle", od.BOOLEAN, access=access, read=status(15, 1)),
                0x11: od.number("Value", od.INT16, access=access, read=value),
            },
        )
        writable = od.READ | od.WRITE
        self.dictionary.record(
            0x8000 + 0x10 * n,
            f"AI Settings Ch.{n + 1}",
            {
                1: od.number("Enable user scale", od.BOOLEAN, 0, writable, high=1),
                2: od.number("Presentation", od.UINT8, 0, writable, high=2),
                5: od.number("Siemens bits", od.BOOLEAN, 0, writable, high=1),
                6: od.number("Enable filter", od.BOOLEAN, 1, writable, high=1),
                7: od.number("Enable limit 1", od.BOOLEAN, 0, writable, high=1),
                8: od.number("Enable limit 2", od.BOOLEAN, 0, writable, high=1),
                0x0A: od.number("Enable user calibration", od.BOOLEAN, 0, writable, high=1),
                0x0B: od.number("Enable vendor calibration", od.BOOLEAN, 1, writable, high=1),
                0x0E: od.number("Swap limit bits", od.BOOLEAN, 0, writable, high=1),
                0x11: od.number("User scale offset", od.INT16, 0, writable),
                0x12: od.number("User scale gain", od.INT32, 65536, writable),
                0x13: od.number("Limit 1", od.INT16, 0, writable),
                0x14: od.number("Limit 2", od.INT16, 0, writable),
                0x15: od.number("Filter settings", od.UINT16, 0, writable, high=9),
                0x17: od.number("User calibration offset", od.INT16, 0, writable),
                0x18: od.number("User calibration gain", od.INT16, 16384, writable),
            },
        )

    def _assignable(self, chosen: list[int]) -> int:
        return 0 if all(0x1A00 <= index <= 0x1A07 for index in chosen) else od.VALUE_RANGE

    def _assigned(self) -> None:
        self.on_change()

    def assigned(self, outputs: bool) -> list[Pdo]:
        return [] if outputs else [self.pdos[index] for index in self._assignment()]

    def _channel_bytes(self, n: int, subindex: int) -> bytes:
        """A channel's value (16 bits) out of the process data, zero where it is not assigned."""
        position = 0
        start = self.esc.sync_managers.settings(3)[0]
        for pdo in self.assigned(False):
            for entry in pdo.entries:
                if (entry.index, entry.subindex) == (0x6000 + 0x10 * n, subindex):
                    return bytes(self.esc.memory[start + position // 8 : start + position // 8 + 2])
                position += entry.bits
        return b"\0\0"

    def _status(self, n: int) -> int:
        return int.from_bytes(self._channel_bytes(n, 1), "little")


class AnalogOutputs(Slave):
    """EL4034: four outputs of +-10 V. Without its master each goes where 0x80n0:05 says: default
    value, ramp, or held.
    """

    _DEFAULT, _RAMP, _HOLD = 0, 1, 2

    def __init__(
        self,
        name: str,
        agenda: Agenda,
        settings: Settings,
        product: int | None = None,
        revision: int | None = None,
    ):
        identity = _identity("EL4034", product, revision, 0x00140000)
        subindex = 0x01 if identity[2] == 0x00120000 else 0x11
        pdos = tuple(
            Pdo(
                0x1600 + n,
                2,
                (PdoEntry(0x7000 + 0x10 * n, subindex, 16, od.INT16, "Analog output"),),
                f"AO RxPDO-Map Ch.{n + 1}",
            )
            for n in range(4)
        )
        content = sii.SiiContent(
            "EL4034",
            *identity,
            mailbox=(0x1000, 128, 0x1080, 128),
            ports=_EBUS_PORTS,
            ebus_ma=130,
            protocols=sii.COE_PROTOCOL,
            coe_details=sii.SDO | sii.SDO_INFO,
            pdos=pdos,
            fmmu_uses=(1, 2, 3),
            sync_managers=(
                *_MAILBOX,
                SyncManagerSetting(
                    0x1100, 8, 0x24, 0x01, sii.OUTPUTS
                ),  # its watchdog is the master's to arm
                SyncManagerSetting(0x1180, 0, 0x00, 0x00, sii.INPUTS),
            ),
        )
        super().__init__(name, _ANALOG, content, agenda, settings)
        add_identity(self.dictionary, content, 0x01901389)
        for pdo in content.pdos:
            add_mapping(self.dictionary, pdo)
        add_sync_objects(self.dictionary, tuple(range(0x1600, 0x1604)), ())
        assigned = {
            n + 1: od.number(f"SubIndex {n + 1:03d}", od.UINT16, pdo.index)
            for n, pdo in enumerate(pdos)
        }
        self.dictionary.record(
            0x1C12, "PDO assign", assigned, od.ARRAY
        )  # fixed: no channel can be left out
        writable = od.READ | od.WRITE
        for n in range(4):
            read = lambda n=n: bytes(self.esc.memory[self._place(n) : self._place(n) + 2])  # noqa: E731
            self.dictionary.record(
                0x7000 + 0x10 * n,
                f"AO Outputs Ch.{n + 1}",
                {
                    subindex: od.number(
                        "Analog output", od.INT16, access=od.READ | od.RX_PDO, read=read
                    )
                },
            )
            self.dictionary.record(
                0x8000 + 0x10 * n,
                f"AO Settings Ch.{n + 1}",
                {
                    1: od.number("Enable user scale", od.BOOLEAN, 0, writable, high=1),
                    2: od.number("Presentation", od.UINT8, 0, writable, high=3),
                    5: od.number("Watchdog", od.UINT8, 0, writable, high=2),
                    7: od.number("Enable user calibration", od.BOOLEAN, 0, writable, high=1),
                    8: od.number("Enable vendor calibration", od.BOOLEAN, 1, writable, high=1),
                    0x11: od.number("Offset", od.INT16, 0, writable),
                    0x12: od.number("Gain", od.INT32, 65536, writable),
                    0x13: od.number("Default output", od.INT16, 0, writable),
                    0x14: od.number("Default output ramp", od.UINT16, 0xFFFF, writable),
                    0x15: od.number("User calibration offset", od.INT16, 0, writable),
                    0x16: od.number("User calibration gain", od.UINT16, 0xFFFF, writable),
                },
            )

    def _place(self, n: int) -> int:
        return self.esc.sync_managers.settings(2)[0] + 2 * n

    def safe_outputs(self, image: bytearray, places: list[Place]) -> None:
        for place in places:
            present = int.from_bytes(image[place.byte : place.byte + 2], "little", signed=True)
            value = self._safe_value((place.entry.index - 0x7000) >> 4, present)
            image[place.byte : place.byte + 2] = pack("<h", value)

    def _safe_value(self, n: int, present: int) -> int:
        behaviour, default, ramp = (
            self.dictionary.item(0x8000 + 0x10 * n, sub).number for sub in (5, 0x13, 0x14)
        )
        if behaviour == self._HOLD and self.is_present:
            return present
        if (
            behaviour == self._RAMP and self.is_present
        ):  # digits per millisecond, once per plant period
            return present + min(max(default - present, -ramp), ramp)
        return default if self.is_present else 0

"""SII images: identity, mailbox, and the categories that describe sync managers and process data.

Sources: ETG.1000.6 (SII area), ETG.2010 (categories and their layouts).
"""

from dataclasses import dataclass, field
from struct import pack

from epa_rt.config.terminal import SyncManager
from sim_backend.bus.eeprom import checksum

STRINGS, GENERAL, FMMU, SYNC_MANAGERS, TX_PDO, RX_PDO, DC, END = 10, 30, 40, 41, 50, 51, 60, 0xFFFF
COE_PROTOCOL = 0x0004
SDO, SDO_INFO, PDO_ASSIGN, PDO_CONFIG = 0x01, 0x02, 0x04, 0x08  # CoE details
_SIZE_BYTES = 2048


@dataclass(frozen=True)
class PdoEntry:
    """One entry of a PDO: object, bits, CANopen data type, name. Index 0 is a gap."""

    index: int
    subindex: int
    bits: int
    data_type: int = 0
    name: str = ""


@dataclass(frozen=True)
class Pdo:
    """A PDO: index, its sync manager (0xFF: not assigned by default), entries."""

    index: int
    sync_manager: int
    entries: tuple[PdoEntry, ...]
    name: str = ""

    @property
    def bits(self) -> int:
        return sum(entry.bits for entry in self.entries)


@dataclass(frozen=True)
class DcMode:
    """A mode of the distributed clocks that a slave offers: name and AssignActivate word (registers
    0x0980/0x0981).
    """

    name: str
    assign_activate: int


@dataclass(frozen=True)
class SiiContent:
    """What a slave's EEPROM says."""

    name: str
    vendor: int
    product: int
    revision: int
    serial: int = 0
    mailbox: tuple[int, int, int, int] = (0, 0, 0, 0)  # receive start and size, send start and size
    protocols: int = 0
    coe_details: int = 0
    sync_managers: tuple[SyncManager, ...] = ()
    fmmu_uses: tuple[int, ...] = ()  # 1 outputs, 2 inputs, 3 mailbox state
    pdos: tuple[Pdo, ...] = ()
    dc_modes: tuple[DcMode, ...] = ()
    ebus_ma: int = 0
    ports: int = 0x0000


@dataclass
class _Strings:
    texts: list[str] = field(default_factory=list)

    def number(self, text: str) -> int:
        """Index of a text, from 1; 0 for none."""
        if not text:
            return 0
        if text not in self.texts:
            self.texts.append(text)
        return self.texts.index(text) + 1

    def data(self) -> bytes:
        encoded = [text.encode("latin-1")[:255] for text in self.texts]
        return bytes([len(encoded)]) + b"".join(bytes([len(text)]) + text for text in encoded)


def sii_image(content: SiiContent) -> bytes:
    """The whole EEPROM of a slave, 2 KiB."""
    strings = _Strings([content.name])  # masters show the first text as the slave's name
    categories = _categories(content, strings)
    head = pack("<HHHHHHH", 0x0005 if content.protocols else 0x0004, 0, 0, 0, 0, 0, 0)
    head += bytes([checksum(head), 0])
    head += pack("<IIII", content.vendor, content.product, content.revision, content.serial)
    head += bytes(8) + pack("<HHHH", 0, 0, 0, 0)  # reserved, bootstrap mailbox
    head += pack("<HHHHH", *content.mailbox, content.protocols)
    head = head.ljust(2 * 0x3E, b"\0") + pack("<HH", _SIZE_BYTES * 8 // 1024 - 1, 1)
    body = _category(STRINGS, strings.data()) + categories + pack("<H", END)
    return (head + body).ljust(_SIZE_BYTES, b"\xff")


def _category(number: int, data: bytes) -> bytes:
    data += b"\0" * (len(data) % 2)
    return pack("<HH", number, len(data) // 2) + data


def _categories(content: SiiContent, strings: _Strings) -> bytes:
    group, name = strings.number("Emulated"), strings.number(content.name)
    general = pack(
        "<BBBBBBBBBBBBhBBHH",
        group,
        0,
        name,
        name,
        0,
        content.coe_details,
        0,
        0,
        0,
        0,
        0,
        0,
        content.ebus_ma,
        group,
        0,
        content.ports,
        0,
    )
    result = _category(GENERAL, general.ljust(32, b"\0"))
    if content.fmmu_uses:
        result += _category(FMMU, bytes(content.fmmu_uses))
    if content.sync_managers:
        result += _category(
            SYNC_MANAGERS,
            b"".join(
                pack("<HHBBBB", sm.start, sm.length, sm.control, 0, sm.enable, sm.use)
                for sm in content.sync_managers
            ),
        )
    for number, is_kind in (
        (TX_PDO, lambda pdo: pdo.index >= 0x1A00),
        (RX_PDO, lambda pdo: pdo.index < 0x1A00),
    ):
        chosen = [pdo for pdo in content.pdos if is_kind(pdo)]
        if chosen:
            result += _category(number, b"".join(_pdo(pdo, strings) for pdo in chosen))
    if content.dc_modes:
        result += _category(
            DC,
            b"".join(
                pack(
                    "<IIIhHhBB4x", 0, 0, 0, 0, mode.assign_activate, 0, strings.number(mode.name), 0
                )
                for mode in content.dc_modes
            ),
        )
    return result


def _pdo(pdo: Pdo, strings: _Strings) -> bytes:
    result = pack(
        "<HBBBBH", pdo.index, len(pdo.entries), pdo.sync_manager, 0, strings.number(pdo.name), 0
    )
    for entry in pdo.entries:
        result += pack(
            "<HBBBBH",
            entry.index,
            entry.subindex,
            strings.number(entry.name),
            entry.data_type,
            entry.bits,
            0,
        )
    return result

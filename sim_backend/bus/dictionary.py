"""Object dictionaries: typed values by index and subindex, with access rights by state.

Sources: ETG.1000.6 (CoE, data types, SDO abort codes, access bits), ETG.1020.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from sim_backend.bus.registers import OP, PREOP, SAFEOP

BOOLEAN, INT8, INT16, INT32, UINT8, UINT16, UINT32, STRING, UINT64 = (
    0x01,
    0x02,
    0x03,
    0x04,
    0x05,
    0x06,
    0x07,
    0x09,
    0x1B,
)
BIT2 = 0x31
BITS = {
    BOOLEAN: 1,
    INT8: 8,
    INT16: 16,
    INT32: 32,
    UINT8: 8,
    UINT16: 16,
    UINT32: 32,
    UINT64: 64,
    BIT2: 2,
}
SIGNED = {INT8, INT16, INT32}
VARIABLE, ARRAY, RECORD = 7, 8, 9

READ, WRITE_PREOP, WRITE, RX_PDO, TX_PDO = 0x07, 0x08, 0x38, 0x40, 0x80
_WRITE_BIT = {PREOP: 0x08, SAFEOP: 0x10, OP: 0x20}
_READ_BIT = {PREOP: 0x01, SAFEOP: 0x02, OP: 0x04}

TOGGLE, COMMAND_UNKNOWN = 0x05030000, 0x05040001
UNSUPPORTED_ACCESS, WRITE_ONLY, READ_ONLY = 0x06010000, 0x06010001, 0x06010002
COUNT_NOT_ZERO, NO_COMPLETE_ACCESS = 0x06010003, 0x06010004
NO_OBJECT, NOT_MAPPABLE, MAPPING_TOO_LONG = 0x06020000, 0x06040041, 0x06040042
TOO_LONG, TOO_SHORT, NO_SUBINDEX = 0x06070012, 0x06070013, 0x06090011
GENERAL_ERROR = 0x08000000
VALUE_RANGE, VALUE_HIGH, VALUE_LOW, WRONG_STATE = 0x06090030, 0x06090031, 0x06090032, 0x08000022


class SdoAbort(Exception):
    """An access that the slave refuses, with its abort code."""

    def __init__(self, code: int):
        super().__init__(f"SDO abort 0x{code:08X}")
        self.code = code


@dataclass
class Item:
    """One entry: type, access bits, present value. ``read`` gives a live value; ``check`` may raise
    SdoAbort before a value is taken; ``written`` is told after it has been.
    """

    name: str
    data_type: int
    value: bytes
    access: int = READ
    low: int | None = None
    high: int | None = None
    read: Callable[[], bytes] | None = None
    check: Callable[[bytes], None] | None = None
    written: Callable[[], None] | None = None

    @property
    def bits(self) -> int:
        return BITS.get(self.data_type, 8 * len(self.value))

    @property
    def number(self) -> int:
        return int.from_bytes(self.value, "little", signed=self.data_type in SIGNED)

    def get(self) -> bytes:
        return self.value if self.read is None else self.read()


@dataclass
class OdObject:
    """An object: name, code (variable, array, record), its entries by subindex."""

    name: str
    code: int
    items: dict[int, Item] = field(default_factory=dict)


def number(name: str, data_type: int, value: int = 0, access: int = READ, **more: object) -> Item:
    """An entry that holds a number."""
    size = (BITS[data_type] + 7) // 8
    return Item(name, data_type, value.to_bytes(size, "little", signed=value < 0), access, **more)


def text(name: str, value: str) -> Item:
    """An entry that holds a read-only string."""
    return Item(name, STRING, value.encode("latin-1"))


class Dictionary:
    """All objects of one slave."""

    def __init__(self):
        self.objects: dict[int, OdObject] = {}

    def variable(self, index: int, item: Item) -> Item:
        self.objects[index] = OdObject(item.name, VARIABLE, {0: item})
        return item

    def record(
        self,
        index: int,
        name: str,
        items: dict[int, Item],
        code: int = RECORD,
        count_access: int = READ,
    ) -> OdObject:
        """An object with subindices; entry 0 (the highest one) is added where it is not given."""
        if 0 not in items:
            items = {0: number("SubIndex 000", UINT8, max(items, default=0), count_access), **items}
        self.objects[index] = OdObject(name, code, items)
        return self.objects[index]

    def item(self, index: int, subindex: int) -> Item:
        """Raises SdoAbort where there is none."""
        entry = self.objects.get(index)
        if entry is None:
            raise SdoAbort(NO_OBJECT)
        if subindex not in entry.items:
            raise SdoAbort(NO_SUBINDEX)
        return entry.items[subindex]

    def upload(self, index: int, subindex: int, state: int) -> bytes:
        """The value for a master. Raises SdoAbort."""
        item = self.item(index, subindex)
        if not item.access & READ:
            raise SdoAbort(WRITE_ONLY)
        if not item.access & _READ_BIT.get(state, 0):
            raise SdoAbort(WRONG_STATE)
        return item.get()

    def download(self, index: int, subindex: int, data: bytes, state: int) -> None:
        """A master's value. Raises SdoAbort and leaves the old value where it cannot be taken."""
        item = self.item(index, subindex)
        if not item.access & WRITE:
            raise SdoAbort(READ_ONLY)
        if not item.access & _WRITE_BIT.get(state, 0):
            raise SdoAbort(WRONG_STATE)
        if item.data_type != STRING and len(data) != len(item.value):
            raise SdoAbort(TOO_LONG if len(data) > len(item.value) else TOO_SHORT)
        if item.data_type != STRING:
            value = int.from_bytes(data, "little", signed=item.data_type in SIGNED)
            if item.high is not None and value > item.high:
                raise SdoAbort(VALUE_HIGH)
            if item.low is not None and value < item.low:
                raise SdoAbort(VALUE_LOW)
        if item.check is not None:
            item.check(data)
        item.value = bytes(data)
        if item.written is not None:
            item.written()

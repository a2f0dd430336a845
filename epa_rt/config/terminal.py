"""What describes a terminal on the bus: identity, process data, conversion, limits, start-up
objects and how it is emulated. Pure data, read by config, signals, drivers and sim_backend alike.

A terminal is one file of `epa_rt/config/terminals/`; what a family has in common stands in
terminal_families.py. How to add one: docs/terminals.md.
"""

from dataclasses import dataclass
from typing import Literal

BECKHOFF = 0x00000002
MAILBOX_OUT, MAILBOX_IN, OUTPUTS, INPUTS = 1, 2, 3, 4  # what a sync manager is for (ETG.2010)
UNASSIGNED = 0xFF  # sync manager of a PDO that does not travel by default
GAP = "x"  # type of bits that travel and mean nothing here

# status word of an analog input: under- and over-range, error, invalid, toggle (Beckhoff AI)
STATUS_UNDER_RANGE = 1 << 0
STATUS_OVER_RANGE = 1 << 1
STATUS_ERROR = 1 << 6
STATUS_INVALID = 1 << 14
STATUS_TOGGLE = 1 << 15
ANALOG_FAULTS = STATUS_UNDER_RANGE | STATUS_OVER_RANGE | STATUS_ERROR | STATUS_INVALID

BITS = {"?": 1, "BIT2": 2, "b": 8, "B": 8, "h": 16, "H": 16, "i": 32, "I": 32}


@dataclass(frozen=True)
class Entry:
    """One value in the process image: type as in struct ('H', 'b', ...; '?' = one bit; GAP), native
    unit, unit per count.

    Native value = ``offset`` + ``per_count`` x count. ``low`` and ``high``: what the terminal
    shows, where that is less than the type holds. ``faults``: the bits of a status word that say
    that its value is not to be believed. ``gap``: bits of a GAP.
    """

    name: str
    code: str
    unit: str = "1"
    per_count: float = 1.0
    index: int = 0
    subindex: int = 0
    offset: float = 0.0
    low: int | None = None
    high: int | None = None
    faults: int = 0
    gap: int = 0

    @property
    def bits(self) -> int:
        return self.gap if self.code == GAP else BITS[self.code]

    @property
    def counts(self) -> tuple[int, int]:
        """Lowest and highest count."""
        if self.code.islower():
            low, high = -(1 << self.bits - 1), (1 << self.bits - 1) - 1
        else:
            low, high = 0, (1 << self.bits) - 1
        return low if self.low is None else self.low, high if self.high is None else self.high

    @property
    def native_ends(self) -> tuple[float, float]:
        """Lowest and highest native value."""
        low, high = (self.to_native(count) for count in self.counts)
        return min(low, high), max(low, high)

    def to_native(self, count: float) -> float:
        native = count * self.per_count
        return native + self.offset if self.offset else native

    def to_counts(self, native: float) -> float:
        """Counts of a native value, not yet rounded."""
        return (native - self.offset) / self.per_count if self.offset else native / self.per_count


@dataclass(frozen=True)
class Mapped:
    """An object in a PDO as it travels: type as in BITS; index 0 is a gap of ``gap`` bits."""

    index: int
    subindex: int
    code: str
    name: str = ""
    gap: int = 0

    @property
    def bits(self) -> int:
        return self.gap if self.code == GAP else BITS[self.code]


@dataclass(frozen=True)
class Pdo:
    """A process data object: its number, name, objects, the sync manager that carries it."""

    index: int
    name: str
    entries: tuple[Mapped, ...]
    sync_manager: int

    @property
    def is_output(self) -> bool:
        return self.index < 0x1A00


@dataclass(frozen=True)
class SyncManager:
    """Default of one sync manager: start, bytes, control and enable byte, what it is for."""

    start: int
    length: int
    control: int
    enable: int
    use: int


@dataclass(frozen=True)
class Setting:
    """An object that may be written: place, type, name, its value as delivered, its highest."""

    subindex: int
    name: str
    code: str
    value: int = 0
    high: int | None = None


@dataclass(frozen=True)
class Record:
    """An object with its settings."""

    index: int
    name: str
    settings: tuple[Setting, ...]


@dataclass(frozen=True)
class Startup:
    """An object that the driver writes into every terminal of this kind before it runs."""

    index: int
    subindex: int
    type: Literal["u8", "i8", "u16", "i16", "u32", "i32"]
    value: int


@dataclass(frozen=True)
class Sampling:
    """How an input comes about: counts per step of the converter, seconds between two samples (0:
    one for each bus cycle).

    Below ``under`` counts a value is ``floor`` and the status word tells under-range and error;
    above ``over`` it is the highest count and over-range, above ``over_error`` an error too. None:
    the ends of the entry. ``broken_wire``: native value of an input whose wire is broken.
    """

    step: int = 1
    conversion_s: float = 0.0
    under: int | None = None
    floor: int | None = None
    over: int | None = None
    over_error: int | None = None
    broken_wire: float | None = None
    has_filter: bool = False  # 0x8000:06 and 0x8000:15 as in EL30xx


@dataclass(frozen=True)
class Alone:
    """What an analog output does without its master, as subindices of 0x80n0: reaction (0 default
    value, 1 ramp, 2 hold), default value, ramp in digits per millisecond.
    """

    reaction: int = 0x05
    default: int = 0x13
    ramp: int = 0x14


@dataclass(frozen=True)
class Device:
    """A slave type. ``outputs``: master to slave, ``inputs``: slave to master, as the image has
    them. ``revisions``: lowest and highest that were described; ``emulated``: the emulated one's.

    ``chooses``: which PDOs travel may be written (0x1C12, 0x1C13). ``neutral``: settings of a
    channel (subindex of 0x80n0, words) that must be zero, or a count means something else.
    ``output_step``: counts per step of an analog output's converter. ``at_one``: revisions whose
    value stands at subindex 1 instead; None where there is no doubt. ``process_name``: of the
    objects of process data, before the channel's number.
    """

    name: str
    vendor: int
    products: tuple[int, ...]
    revisions: tuple[int, int]
    outputs: tuple[Entry, ...] = ()
    inputs: tuple[Entry, ...] = ()
    emulated: int | None = None
    pdos: tuple[Pdo, ...] = ()
    sync_managers: tuple[SyncManager, ...] = ()
    records: tuple[Record, ...] = ()
    startup: tuple[Startup, ...] = ()
    device_type: int = 0  # 0x1000
    ebus_ma: int = 0
    channels: int = 0
    chooses: bool = False
    neutral: tuple[tuple[int, str], ...] = ()
    output_step: int = 1
    at_one: tuple[int, ...] | None = None
    process_name: str = ""
    sampling: Sampling | None = None
    alone: Alone | None = None
    is_drive: bool = False
    is_coupler: bool = False
    is_generic: bool = False

    @property
    def serves_objects(self) -> bool:
        return self.is_drive or any(manager.use == MAILBOX_OUT for manager in self.sync_managers)

    @property
    def emulated_revision(self) -> int:
        return self.revisions[1] if self.emulated is None else self.emulated

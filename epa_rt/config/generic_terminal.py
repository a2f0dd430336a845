"""A terminal that no file of terminals/ knows, described in the rig file itself: identity, process
data as they travel, conversion.
"""

from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, WithJsonSchema, field_validator

from epa_rt.config.fields import Frozen, quantity
from epa_rt.config.rig_rows import NativePair
from epa_rt.config.terminal import (
    ANALOG_FAULTS,
    BECKHOFF,
    GAP,
    INPUTS,
    OUTPUTS,
    Device,
    Entry,
    Mapped,
    Pdo,
    Sampling,
    SyncManager,
)
from epa_rt.config.terminal_families import DIGITAL_INPUTS, DIGITAL_OUTPUTS, MAILBOX
from epa_rt.config.units import UnitError, unit

GENERIC = "generic"
STATUS = "_status"  # ending of the name of an analog input's status word
CODES = {"bit": "?", "u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i"}
_SM_BYTES = 128  # of process data in one direction: what the emulated sync managers hold
_EMULATED_PDOS = 8  # in one assignment
_OUTPUT_REGISTER, _OUTPUT_RAM = 4, 0x1100  # bytes of 0x0F00; where more of them are emulated
Word = Annotated[int, Field(ge=0, le=0xFFFFFFFF)]


def _pair_of_counts(value: Any) -> tuple[int, int]:
    if (
        not isinstance(value, (list, tuple))
        or len(value) != 2
        or not all(isinstance(end, int) and not isinstance(end, bool) for end in value)
        or not value[0] < value[1]
    ):
        raise UnitError(f"found {value!r}, expected two whole numbers [low, high]")
    return tuple(value)


Counts = Annotated[
    tuple[int, int],
    BeforeValidator(_pair_of_counts),
    WithJsonSchema({"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2}),
]


class GenericEntry(Frozen):
    """One object of a PDO, or ``gap`` bits without meaning. ``native`` at ``counts``: two points of
    its conversion; ``shows``: the counts that it takes, where its type holds more.

    The name of an analog input's status word is its value's with '_status' behind; its bits are
    those of Beckhoff's AI status. It begins at ``object``, however many objects it is made of.
    """

    object: Annotated[str, Field(pattern=r"^0x[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2}$")] | None = None
    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=40)] | None = None
    type: Literal["bit", "u8", "i8", "u16", "i16", "u32", "i32"] | None = None
    gap: Annotated[int, Field(ge=1, le=64)] | None = None
    native: NativePair | None = None
    counts: Counts | None = None
    shows: Counts | None = None

    @field_validator("native")
    @classmethod
    def _one_unit(cls, value: NativePair | None) -> NativePair | None:
        if value is not None:
            if value[1] != value[3] or not value[1]:
                raise UnitError(
                    f"found '{value[0]:g} {value[1]}' and '{value[2]:g} {value[3]}', expected two"
                    " quantities with the same unit"
                )
            unit(value[1])
            if value[0] == value[2]:
                raise UnitError("found two points that coincide, expected two different ones")
        return value

    @field_validator("shows")
    @classmethod
    def _fits(cls, value: tuple[int, int] | None, info: ValidationInfo) -> tuple[int, int] | None:
        kind = info.data.get("type")
        if value is not None and kind is not None:
            low, high = Entry("", CODES[kind]).counts
            if not low <= value[0] < value[1] <= high:
                raise UnitError(f"found {list(value)}, expected counts within {low} to {high}")
        return value

    @property
    def place(self) -> tuple[int, int]:
        """Index and subindex."""
        index, subindex = (self.object or "0x0000:00").split(":")
        return int(index, 16), int(subindex, 16)

    @property
    def mapped(self) -> Mapped:
        if self.gap is not None:
            return Mapped(0, 0, GAP, gap=self.gap)
        return Mapped(*self.place, CODES[self.type or "bit"], self.name or "")

    def entry(self, number: int) -> Entry:
        """As the process image has it; ``number`` names what has no name."""
        mapped = self.mapped
        if self.name is None:
            return Entry(f"_{number}", GAP, index=0, gap=mapped.bits)
        per_count, offset, native_unit = 1.0, 0.0, "1" if mapped.code == "?" else "count"
        if self.native is not None and self.counts is not None:
            first, native_unit, last, _ = self.native
            per_count = (last - first) / (self.counts[1] - self.counts[0])
            offset = first - per_count * self.counts[0]
        low, high = self.shows or (None, None)
        faults = ANALOG_FAULTS if self.name.endswith(STATUS) else 0
        return Entry(
            self.name,
            mapped.code,
            native_unit,
            per_count,
            *self.place,
            offset=offset,
            low=low,
            high=high,
            faults=faults,
        )


class GenericPdo(Frozen):
    """A PDO: its number, and all that it carries, bit by bit."""

    pdo: Annotated[int, Field(ge=0x1600, le=0x1BFF)]
    entries: Annotated[tuple[GenericEntry, ...], Field(min_length=1, max_length=32)]

    @field_validator("entries")
    @classmethod
    def _whole(cls, entries: tuple[GenericEntry, ...]) -> tuple[GenericEntry, ...]:
        for entry in entries:
            _check_entry(entry)
        return entries


def _check_entry(entry: GenericEntry) -> None:
    """Raises UnitError for keys that do not go together."""
    words = entry.name or entry.object or "an entry"
    if entry.gap is not None:
        if entry.model_fields_set - {"gap"}:
            raise UnitError("found 'gap' beside other keys, expected it alone")
        return
    if entry.object is None or entry.type is None:
        raise UnitError(f"found {words} without 'object' and 'type', expected both, or 'gap'")
    if entry.place[0] == 0:
        raise UnitError(f"found object {entry.object} at {words}, expected an index above zero")
    if (entry.native is None) != (entry.counts is None):
        raise UnitError(
            f"found one of 'native' and 'counts' at {words}, expected both: native: [0 V, 10 V],"
            " counts: [0, 32767]"
        )
    if entry.type == "bit" and entry.model_fields_set & {"native", "shows"}:
        raise UnitError(f"found a conversion at {words}, expected none at a bit")
    if entry.name is not None and entry.name.endswith(STATUS) and entry.type != "u16":
        raise UnitError(f"found '{words}' of type {entry.type}, expected u16 for a status word")


class GenericTerminal(Frozen):
    """A whole terminal. ``objects``: it serves objects (CoE), as analog terminals do.
    ``conversion``: the time between two samples, where they do not come once per cycle.
    """

    vendor: Word = BECKHOFF
    product: Word
    revisions: tuple[Word, Word]
    objects: bool = True
    conversion: quantity("s", 1e-6, 1.0) | None = None
    outputs: Annotated[tuple[GenericPdo, ...], Field(max_length=_EMULATED_PDOS)] = ()
    inputs: Annotated[tuple[GenericPdo, ...], Field(max_length=_EMULATED_PDOS)] = ()

    @field_validator("revisions")
    @classmethod
    def _in_order(cls, value: tuple[int, int]) -> tuple[int, int]:
        if value[0] > value[1]:
            raise UnitError(f"found {value[0]:#010x} before {value[1]:#010x}, expected low, high")
        return value

    @field_validator("outputs", "inputs")
    @classmethod
    def _direction(
        cls, pdos: tuple[GenericPdo, ...], info: ValidationInfo
    ) -> tuple[GenericPdo, ...]:
        outputs = info.field_name == "outputs"
        seen: set[str] = set()
        numbers: set[int] = set()
        places: set[tuple[int, int]] = set()
        for pdo in pdos:
            if (pdo.pdo < 0x1A00) != outputs:
                wanted = "0x1600 to 0x19FF" if outputs else "0x1A00 to 0x1BFF"
                raise UnitError(
                    f"found PDO 0x{pdo.pdo:04X} in the {info.field_name}, expected {wanted}"
                )
            if pdo.pdo in numbers:
                raise UnitError(f"found PDO 0x{pdo.pdo:04X} twice, expected each once")
            numbers.add(pdo.pdo)
            for entry in pdo.entries:
                if entry.name in seen and entry.name is not None:
                    raise UnitError(f"found the entry '{entry.name}' twice, expected each once")
                seen.add(entry.name or "")
                if entry.object is not None and entry.place in places:
                    raise UnitError(f"found {entry.object} twice, expected each object once")
                places.add(entry.place)
        _check_places(pdos)
        return pdos

    @cached_property
    def device(self) -> Device:
        """As a file of terminals/ would describe it."""
        outputs, inputs = _entries(self.outputs), _entries(self.inputs)
        pdos = [
            Pdo(pdo.pdo, "", tuple(entry.mapped for entry in pdo.entries), number)
            for number, group in (
                (self._number(True), self.outputs),
                (self._number(False), self.inputs),
            )
            for pdo in group
        ]
        return Device(
            GENERIC,
            self.vendor,
            (self.product,),
            self.revisions,
            outputs=outputs,
            inputs=inputs,
            pdos=tuple(pdos),
            sync_managers=self._sync_managers(_bytes(outputs), _bytes(inputs)),
            chooses=self.objects,
            sampling=Sampling(conversion_s=self.conversion or 0.0) if inputs else None,
            is_generic=True,
        )

    def _number(self, outputs: bool) -> int:
        """The sync manager that carries a direction."""
        if self.objects:
            return 2 if outputs else 3
        return 0 if outputs or not self.outputs else 1

    def _sync_managers(self, outputs: int, inputs: int) -> tuple[SyncManager, ...]:
        if self.objects:
            return (
                *MAILBOX,
                SyncManager(0x1100, outputs, 0x24 if outputs else 0, int(outputs > 0), OUTPUTS),
                SyncManager(0x1180, inputs, 0x20 if inputs else 0, int(inputs > 0), INPUTS),
            )
        managers = []
        if outputs:
            start = DIGITAL_OUTPUTS if outputs <= _OUTPUT_REGISTER else _OUTPUT_RAM
            managers.append(SyncManager(start, 0, 0x44, 0x09, OUTPUTS))
        if inputs:
            managers.append(SyncManager(DIGITAL_INPUTS, inputs, 0x00, 0x01, INPUTS))
        return tuple(managers)


def _check_places(pdos: tuple[GenericPdo, ...]) -> None:
    """Numbers of more than a bit must begin at a whole byte of the slave's data, each status word
    has its value. Raises UnitError.
    """
    entries = _entries(pdos)
    names = {entry.name for entry in entries}
    bit = 0
    for entry in entries:
        if entry.code not in ("?", GAP) and bit % 8:
            raise UnitError(
                f"found '{entry.name}' at bit {bit} of the process data, expected a whole byte (put"
                " a gap before it)"
            )
        if entry.faults and entry.name.removesuffix(STATUS) not in names:
            raise UnitError(
                f"found '{entry.name}' without '{entry.name.removesuffix(STATUS)}', expected the"
                " value that it tells of"
            )
        bit += entry.bits
    if bit > 8 * _SM_BYTES:
        raise UnitError(f"found {bit} bits in one direction, expected {8 * _SM_BYTES} at most")


def _entries(pdos: tuple[GenericPdo, ...]) -> tuple[Entry, ...]:
    every = [entry for pdo in pdos for entry in pdo.entries]
    return tuple(entry.entry(number) for number, entry in enumerate(every))


def _bytes(entries: tuple[Entry, ...]) -> int:
    return (sum(entry.bits for entry in entries) + 7) // 8

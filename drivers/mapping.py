"""Process-data mapping: written where the slave lets us choose, read and compared where it is
fixed. In PREOP only.

Sources: ETG.1000.6 (0x1C12, 0x1C13), maxon EPOS4 communication guide (order of writing), Beckhoff
EL30xx and EL40x4 documentation (PDO assignment, entries).
"""

from collections.abc import Callable, Sequence

from drivers.mailbox import Mailbox, u8, u16, u32
from epa_rt.backend import BackendError
from epa_rt.config.devices import Entry
from epa_rt.config.rig import Slave
from epa_rt.config.rig_checks import entries_of
from epa_rt.config.terminal import GAP, Mapped, Pdo

OUTPUT_ASSIGNMENT, INPUT_ASSIGNMENT = 0x1C12, 0x1C13
_DIRECTIONS = ((OUTPUT_ASSIGNMENT, True), (INPUT_ASSIGNMENT, False))
_TOGGLE_BIT = 15  # where the decoder reads an EL3004's toggle
_ANALOG_OUT_SUBINDEXES = (0x11, 0x01)  # :01 in one revision


def mapped_object(entry: Entry) -> int:
    """An entry as a mapping object holds it: index, subindex, bits."""
    return entry.index << 16 | entry.subindex << 8 | entry.bits


def set_up_mapping(mailbox: Mailbox, slave: Slave) -> None:
    """Writes and verifies the process data of a slave with a mailbox. Raises BackendError."""
    if slave.device == "EPOS4":
        for assignment, pdo, outputs in (
            (OUTPUT_ASSIGNMENT, 0x1600, True),
            (INPUT_ASSIGNMENT, 0x1A00, False),
        ):
            _write(
                mailbox,
                assignment,
                pdo,
                [mapped_object(entry) for entry in entries_of(slave, outputs)],
            )
    elif slave.description.alone is not None:
        _check_analog_out(mailbox, slave)
    elif _is_analog_in(slave):
        _assign_analog_in(mailbox, slave)
    else:
        _assign_described(mailbox, slave)


def _is_analog_in(slave: Slave) -> bool:
    """Channels that travel with their status or without (families: analog_inputs)."""
    return bool(slave.description.neutral) and slave.description.chooses


def _write(mailbox: Mailbox, assignment: int, pdo: int, objects: Sequence[int]) -> None:
    """Assignment off, mapping off, entries, count, assignment on; then all of it read back."""
    mailbox.write(assignment, 0, u8(0))
    if objects:
        mailbox.write(pdo, 0, u8(0))
        for i, mapped in enumerate(objects, 1):
            mailbox.write(pdo, i, u32(mapped))
        mailbox.write(pdo, 0, u8(len(objects)))
        mailbox.write(assignment, 1, u16(pdo))
        mailbox.write(assignment, 0, u8(1))
        mailbox.expect(pdo, 0, u8(len(objects)))
        for i, mapped in enumerate(objects, 1):
            mailbox.expect(pdo, i, u32(mapped))
        mailbox.expect(assignment, 1, u16(pdo))
    mailbox.expect(assignment, 0, u8(1 if objects else 0))


def _assign(mailbox: Mailbox, assignment: int, pdos: Sequence[int]) -> None:
    """Leaves an assignment alone that is as wanted, else writes it; verified either way."""
    if _assigned(mailbox, assignment) != list(pdos):
        mailbox.write(assignment, 0, u8(0))
        for i, pdo in enumerate(pdos, 1):
            mailbox.write(assignment, i, u16(pdo))
        mailbox.write(assignment, 0, u8(len(pdos)))
    found = _assigned(mailbox, assignment)
    if found != list(pdos):
        raise BackendError(
            f"found the process data {_words(found)} assigned in {mailbox.label}, expected"
            f" {_words(pdos)}"
        )


def assignment_steps(mailbox: Mailbox, slave: Slave) -> list[Callable[[], object]]:
    """The assignment of a terminal that chooses its PDOs written anew, in short steps; others have
    a fixed one.
    """
    if slave.description.is_drive or not slave.description.chooses:
        return []
    if _is_analog_in(slave):
        wanted = {INPUT_ASSIGNMENT: analog_in_pdos(slave)}
    else:
        wanted = {
            assignment: [pdo.index for pdo in described_pdos(slave, outputs)]
            for assignment, outputs in _DIRECTIONS
            if entries_of(slave, outputs)
        }
    steps: list[Callable[[], object]] = []
    for assignment, pdos in wanted.items():
        writes = [(0, u8(0)), *((i, u16(pdo)) for i, pdo in enumerate(pdos, 1)), (0, u8(len(pdos)))]
        for subindex, data in writes:
            steps += mailbox.steps_to_set(assignment, subindex, data)
    return steps


def described_pdos(slave: Slave, outputs: bool) -> list[Pdo]:
    """The PDOs that give the rig's entries of one direction, in order, out of those that the
    terminal's description lists. Raises BackendError where none of them give just these.
    """
    wanted = [(entry.index, entry.subindex, entry.bits) for entry in entries_of(slave, outputs)]
    chosen: list[Pdo] = []
    choices = [pdo for pdo in slave.description.pdos if pdo.is_output == outputs]
    while wanted:
        pdo = next((pdo for pdo in choices if pdo not in chosen and _begins(pdo, wanted)), None)
        if pdo is None:
            break
        chosen.append(pdo)
        wanted = wanted[_taken(pdo, wanted) :]
    if wanted:
        kind = "outputs" if outputs else "inputs"
        raise BackendError(
            f"found {kind} of {slave.name} that no process data of {slave.device} carry, expected"
            " all of them, in their order"
        )
    return chosen


def _taken(pdo: Pdo, wanted: Sequence[tuple[int, int, int]]) -> int:
    """How many of the wanted entries a PDO carries, from the first on; 0 where they do not fit.
    A word may be made of single bits.
    """
    starts: dict[int, Mapped] = {}
    bit = 0
    for mapped in pdo.entries:
        starts[bit] = mapped
        bit += mapped.bits
    end, taken, at = bit, 0, 0
    for index, subindex, bits in wanted:
        if at == end:
            break
        if at + bits > end or index and not _carries(starts.get(at), index, subindex, bits):
            return 0
        at, taken = at + bits, taken + 1
    return taken if at == end else 0


def _carries(mapped: Mapped | None, index: int, subindex: int, bits: int) -> bool:
    if mapped is None or (mapped.index, mapped.subindex) != (index, subindex):
        return False
    return mapped.bits == bits or mapped.bits < 8


def _begins(pdo: Pdo, wanted: Sequence[tuple[int, int, int]]) -> bool:
    return _taken(pdo, wanted) > 0


def _assign_described(mailbox: Mailbox, slave: Slave) -> None:
    """Assigns the PDOs of a terminal that is described object by object, and holds its own mapping
    against the description. Raises BackendError.
    """
    for assignment, outputs in _DIRECTIONS:
        pdos = described_pdos(slave, outputs)
        if not pdos:
            continue
        _assign(mailbox, assignment, [pdo.index for pdo in pdos])
        for pdo in pdos:
            _check_described(mailbox, pdo, entries_of(slave, outputs))


def _check_described(mailbox: Mailbox, pdo: Pdo, entries: Sequence[Entry]) -> None:
    """Every object that the image has must stand at its bit, in its size; what a status word is
    made of is not asked.
    """
    words = {(entry.index, entry.subindex): entry for entry in entries if entry.code != GAP}
    found: dict[int, int] = {}
    bit = 0
    for i in range(1, mailbox.number(pdo.index) + 1):
        found[bit] = mailbox.number(pdo.index, i)
        bit += found[bit] & 0xFF
    bits = sum(mapped.bits for mapped in pdo.entries)
    if bit != bits:
        raise BackendError(
            f"found {bit} bits in 0x{pdo.index:04X} of {mailbox.label}, expected {bits}"
        )
    at = 0
    for mapped in pdo.entries:
        entry = words.get((mapped.index, mapped.subindex))
        if entry is not None and (wrong := _misplaced(found.get(at, 0), entry, mapped.bits)):
            raise BackendError(
                f"found {wrong} at bit {at} of 0x{pdo.index:04X} of {mailbox.label}, expected"
                f" '{entry.name}' there, object 0x{entry.index:04X}:{entry.subindex:02X}"
            )
        at += mapped.bits


def _misplaced(found: int, entry: Entry, bits: int) -> str:
    """What stands where an entry should; '' where it is right."""
    is_there = found >> 8 == entry.index << 8 | entry.subindex
    is_whole = entry.faults or entry.bits != bits or found & 0xFF == bits
    return "" if is_there and is_whole else f"0x{found:08X}"


def _assigned(mailbox: Mailbox, assignment: int) -> list[int]:
    return [mailbox.number(assignment, i) for i in range(1, mailbox.number(assignment) + 1)]


def _words(pdos: Sequence[int]) -> str:
    return ", ".join(f"0x{pdo:04X}" for pdo in pdos) or "none"


def analog_in_pdos(slave: Slave) -> list[int]:
    """PDOs of an analog input that give the rig's inputs: 0x1A00 + 2n with status, 0x1A01 + 2n
    without. Raises BackendError.
    """
    names = [entry.name for entry in entries_of(slave, outputs=False)]
    pdos, i = [], 0
    while i < len(names):
        channel, with_status = names[i].removesuffix("_status"), names[i].endswith("_status")
        if with_status and names[i + 1 : i + 2] != [channel]:
            raise BackendError(
                f"found '{names[i]}' without '{channel}' behind it in the inputs of {slave.name}, "
                "expected both or the value alone"
            )
        pdos.append(0x1A00 + 2 * (int(channel[2:]) - 1) + (not with_status))
        i += 1 + with_status
    return pdos


def _assign_analog_in(mailbox: Mailbox, slave: Slave) -> None:
    pdos = analog_in_pdos(slave)
    _assign(mailbox, INPUT_ASSIGNMENT, pdos)
    for pdo in pdos:
        channel = (pdo - 0x1A00) // 2
        value = 0x6000 + 0x10 * channel << 16 | 0x11 << 8 | 16
        toggles = (
            0x6000 + 0x10 * channel << 8 | 0x10,
            0x1800 + 2 * channel << 8 | 0x09,
        )  # the second in older descriptions
        bit, with_status = 0, pdo % 2 == 0
        for i in range(1, mailbox.number(pdo) + 1):
            mapped = mailbox.number(pdo, i)
            if mapped >> 8 in toggles and bit != _TOGGLE_BIT:
                raise BackendError(
                    f"found the toggle bit of {mailbox.label} at bit {bit} of channel"
                    f" {channel + 1}'s status, expected bit {_TOGGLE_BIT}"
                )
            if mapped == value:
                break
            bit += mapped & 0xFF
        else:
            raise BackendError(
                f"found no entry 0x{value:08X} in 0x{pdo:04X} of {mailbox.label}, "
                f"expected channel {channel + 1}'s value there"
            )
        if bit != (16 if with_status else 0):
            raise BackendError(
                f"found {bit} bits of status before the value in 0x{pdo:04X} of {mailbox.label}, "
                f"expected {16 if with_status else 0}"
            )


def _check_analog_out(mailbox: Mailbox, slave: Slave) -> None:
    """An analog output's process data are fixed: its values, whose subindex differs between
    revisions.
    """
    wanted = slave.description.outputs
    if entries_of(slave, outputs=True) != wanted:
        raise BackendError(
            f"found 'outputs' at {slave.name}, expected none: the process data of an"
            f" {slave.device} are its {len(wanted)} channels"
        )
    _assign(mailbox, OUTPUT_ASSIGNMENT, [0x1600 + channel for channel in range(len(wanted))])
    for channel in range(len(wanted)):
        pdo, index = 0x1600 + channel, wanted[channel].index
        found = mailbox.number(pdo, 1)
        if mailbox.number(pdo) != 1 or found not in [
            index << 16 | subindex << 8 | 16 for subindex in _ANALOG_OUT_SUBINDEXES
        ]:
            raise BackendError(
                f"found 0x{found:08X} in 0x{pdo:04X} of {mailbox.label}, "
                f"expected one value of 16 bits of object 0x{index:04X}"
            )

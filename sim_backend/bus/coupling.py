"""Between the slaves' memories and the rig's process image: which bits of whose sync managers are
which entry.

Entries are matched by object (index, subindex), so that another PDO mapping, or a part of it, works
as well.
"""

from epa_rt.config.devices import Entry
from epa_rt.config.rig import Rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.config.terminal import GAP, INPUTS, OUTPUTS
from epa_rt.signals.image import Image, Place, image_of
from sim_backend.bus.logical import BitCopy, ByteCopy
from sim_backend.bus.registers import DIGITAL_OUTPUTS, MEMORY_SIZE
from sim_backend.bus.slave import Slave

Copy = ByteCopy | BitCopy


def copies_of(
    slave: Slave, entries: tuple[Entry, ...], image: Image, outputs: bool
) -> tuple[list[Copy], list[tuple[int, int, int, int]]]:
    """Copies between a slave's memory (as ``place``) and the image (as ``at``), and what the image
    does not have: (index, subindex, place in bits, bits).
    """
    number = slave.sync_manager_for(OUTPUTS if outputs else INPUTS)
    if number is None or not slave.esc.sync_managers.is_enabled(number):
        return [], []
    first, length = slave.esc.sync_managers.settings(number)[:2]
    if (
        first < DIGITAL_OUTPUTS
        or first + length > MEMORY_SIZE
        or length < slave.process_bytes(outputs)
    ):
        return (
            [],
            [],
        )  # not configured for this mapping: the slave's processor leaves its memory alone
    start = 8 * first
    known = {
        slave.key(entry.index, entry.subindex, entry.bits): entry
        for entry in entries
        if entry.code != GAP
    }
    runs: list[list[int]] = []  # place, at, bits
    missing = []
    position = covered = 0
    for pdo in slave.assigned(outputs):
        for mapped in pdo.entries:
            entry = known.get(slave.key(mapped.index, mapped.subindex, mapped.bits))
            if entry is not None:
                place = image.places[f"{slave.name}.{entry.name}"]
                at = 8 * place.byte + place.bit
                if (
                    runs
                    and runs[-1][0] + runs[-1][2] == start + position
                    and runs[-1][1] + runs[-1][2] == at
                ):
                    runs[-1][2] += entry.bits
                else:
                    runs.append([start + position, at, entry.bits])
                covered = (
                    position + entry.bits
                )  # EL3004's status is one entry of the image and eight of the PDO
            elif mapped.index and position >= covered:
                missing.append((mapped.index, mapped.subindex, start + position, mapped.bits))
            position += mapped.bits
    return [_copy(slave.esc.memory, *run) for run in runs], missing


def _copy(memory: bytearray, place: int, at: int, bits: int) -> Copy:
    if place & 7 or at & 7 or bits & 7:
        return BitCopy(memory, at, place, bits)
    return ByteCopy(memory, at >> 3, (at + bits) >> 3, place >> 3, (place + bits) >> 3)


class Coupling:
    """The process image in both directions, and the slaves it is cut into. ``stale()`` after any
    change of state, mapping, sync manager or presence; the copies are made again when they are next
    needed.
    """

    def __init__(self, rig: Rig, slaves: dict[str, Slave]):
        self.outputs_image, self.inputs_image = (
            image_of(rig, outputs=True),
            image_of(rig, outputs=False),
        )
        self.outputs, self.inputs = (
            bytearray(self.outputs_image.size),
            bytearray(self.inputs_image.size),
        )
        self._slaves = slaves
        self._entries = {
            slave.name: (entries_of(slave, False), entries_of(slave, True)) for slave in rig.slaves
        }
        self._places: dict[str, list[Place]] = {name: [] for name in slaves}
        for place in self.outputs_image.places.values():
            self._places[place.slave].append(place)
        self._is_stale = True
        self._take: list[Copy] = []
        self._safe: list[tuple[Slave, list[Place]]] = []
        self._give: list[Copy] = []
        self._give_others: list[tuple[Slave, int, int, int, int]] = []

    def stale(self) -> None:
        self._is_stale = True

    def _rebuild(self) -> None:
        self._is_stale = False
        self._take, self._safe, self._give, self._give_others = [], [], [], []
        for name, slave in self._slaves.items():
            inputs, outputs = self._entries[name]
            if slave.drives_outputs:
                self._take += copies_of(slave, outputs, self.outputs_image, True)[0]
            elif self._places[name]:
                self._safe.append((slave, self._places[name]))
            copies, missing = copies_of(slave, inputs, self.inputs_image, False)
            if slave.is_present:
                self._give += copies
                self._give_others += [(slave, *row) for row in missing]

    def take(self) -> bytearray:
        """The output image as it acts: from slaves in OP what the master sent, from the others
        their safe values.
        """
        if self._is_stale:
            self._rebuild()
        outputs = self.outputs
        for copy in self._take:
            copy.read(outputs, 0)
        for slave, places in self._safe:
            slave.safe_outputs(outputs, places)
        return outputs

    def give(self, inputs: bytes) -> None:
        """Puts an input image into the slaves' sync managers."""
        if self._is_stale:
            self._rebuild()
        image = self.inputs
        image[:] = inputs
        for copy in self._give:
            copy.write(image, 0)
        for slave, index, subindex, place, bits in self._give_others:
            self._give_object(slave, index, subindex, place, bits)

    def _give_object(self, slave: Slave, index: int, subindex: int, place: int, bits: int) -> None:
        """An object that is mapped but not in the rig's image: its value out of the dictionary."""
        entry = slave.dictionary.objects.get(index) if slave.dictionary is not None else None
        if entry is None or subindex not in entry.items or place & 7 or bits & 7:
            return  # EL3004's status bits where the rig reads values only
        slave.esc.memory[place >> 3 : (place + bits) >> 3] = entry.items[subindex].get()

    def field(
        self, slave: str, index: int, subindex: int, outputs: bool
    ) -> tuple[bytearray, int, int] | None:
        """Image, first byte and one past the last of an object; None where the rig's image does not
        carry it.
        """
        for entry in self._entries[slave][outputs]:
            if (entry.index, entry.subindex) == (index, subindex):
                places = self.outputs_image if outputs else self.inputs_image
                place = places.places[f"{slave}.{entry.name}"]
                return (
                    (self.outputs if outputs else self.inputs),
                    place.byte,
                    place.byte + entry.bits // 8,
                )
        return None

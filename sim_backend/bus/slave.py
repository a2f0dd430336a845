"""One slave on the emulated wire: controller, EEPROM, state machine, watchdog, clock, mailbox,
process data.

What a kind of slave adds (dictionary, checks, safe outputs) stands in terminals.py and epos4.py.
"""

from collections.abc import Callable
from dataclasses import dataclass

from epa_rt.config.terminal import INPUTS, MAILBOX_IN, MAILBOX_OUT, OUTPUTS
from epa_rt.signals.image import Place
from sim_backend.bus import registers as reg
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.al_machine import DELAYS_NS, AlMachine
from sim_backend.bus.clock import Clock
from sim_backend.bus.coe import CoeServer
from sim_backend.bus.dictionary import Dictionary
from sim_backend.bus.eeprom import Eeprom
from sim_backend.bus.esc import Esc
from sim_backend.bus.mailbox import Mailbox
from sim_backend.bus.sii import Pdo, SiiContent, sii_image
from sim_backend.bus.watchdog import Watchdog


@dataclass(frozen=True)
class Controller:
    """The slave controller of a kind: type, counts, feature bits (0x0008), copper ports or internal
    bus, clocks.
    """

    esc_type: int
    fmmus: int
    sync_managers: int
    features: int = 0x0000
    is_copper: bool = False
    has_clock: bool = False
    is_emulated: bool = (
        False  # no processor behind the controller: it copies AL control to AL status
    )


@dataclass
class Settings:
    """How this bus behaves in time. ``drift_ppm`` and ``offset_ns`` of the clocks, by slave
    name.
    """

    delays_ns: dict[int, int]
    response_ns: int
    drift_ppm: dict[str, float]
    offset_ns: dict[str, int]


class Slave:
    """Base of all kinds. Registers live in ``esc``; ``al.state`` is what 0x0130 shows."""

    def __init__(
        self,
        name: str,
        controller: Controller,
        content: SiiContent,
        agenda: Agenda,
        settings: Settings | None = None,
    ):
        settings = settings or Settings(DELAYS_NS, 0, {}, {})
        self.name, self.controller, self.content = name, controller, content
        self.is_present = True  # it has its supply
        self.is_bypassed = False  # absent, but the wire goes on to the next one
        self.pdos: dict[int, Pdo] = {pdo.index: pdo for pdo in content.pdos}
        self.esc = Esc(controller.fmmus, controller.sync_managers, controller.has_clock)
        self.dictionary: Dictionary | None = None
        self.on_change: Callable[[], None] = lambda: None
        self._agenda = agenda
        self.watchdog = Watchdog(self.esc)
        self.eeprom = Eeprom(self.esc, sii_image(content))
        self.al = AlMachine(self.esc, agenda, self, controller.is_emulated, settings.delays_ns)
        self.al.on_change = lambda: self.on_change()
        self.clock = (
            Clock(
                self.esc, agenda, settings.drift_ppm.get(name, 0.0), settings.offset_ns.get(name, 0)
            )
            if controller.has_clock
            else None
        )
        self._sync_runs = False
        if self.clock is not None:
            self.esc.on_write.append((reg.DC_ACTIVATION, reg.DC_ACTIVATION + 1, self._start_sync))
        self.coe: CoeServer | None = None
        self.mailbox: Mailbox | None = None
        if content.protocols:
            self.dictionary = Dictionary()
            self.coe = CoeServer(self.dictionary, lambda: self.al.state)
            self.mailbox = Mailbox(
                self.esc,
                agenda,
                self.coe.serve,
                lambda: self.al.state != reg.INIT,
                settings.response_ns,
            )
        self._identify()
        self._close_process_data(True)

    def _identify(self) -> None:
        esc, controller = self.esc, self.controller
        esc.put(reg.TYPE, 1, controller.esc_type)
        esc.put(reg.BUILD, 2, 0x0002)
        esc.put(reg.FMMU_COUNT, 1, controller.fmmus)
        esc.put(reg.SM_COUNT, 1, controller.sync_managers)
        esc.put(reg.RAM_KB, 1, 60)
        esc.put(reg.PORTS, 1, 0x3F if controller.is_copper else 0x0A)
        esc.put(reg.FEATURES, 2, controller.features | (0x000C if controller.has_clock else 0))
        esc.put(reg.PDI_CONTROL, 2, 0x0104 if controller.is_emulated else 0x0005)
        esc.put(reg.STATION_ALIAS, 2, 0)

    @property
    def station_address(self) -> int:
        return self.esc.memory[0x10] | self.esc.memory[0x11] << 8

    def sync_manager_for(self, use: int) -> int | None:
        """Number of the sync manager for a use (MAILBOX_OUT ...); None where this kind has
        none.
        """
        return next(
            (n for n, setting in enumerate(self.content.sync_managers) if setting.use == use), None
        )

    def assigned(self, outputs: bool) -> list[Pdo]:
        """The PDOs that travel now, in order."""
        return [
            pdo
            for pdo in self.content.pdos
            if pdo.sync_manager != 0xFF and (pdo.index < 0x1A00) == outputs
        ]

    def key(self, index: int, subindex: int, bits: int) -> tuple[int, int]:
        """How an object of the process data is known in the rig's image."""
        return index, subindex

    def process_bytes(self, outputs: bool) -> int:
        """Length of the process data in one direction."""
        return (sum(pdo.bits for pdo in self.assigned(outputs)) + 7) // 8

    def refuses(self, current: int, wanted: int) -> int:
        """AL status code that speaks against a step up; 0 for none."""
        if wanted == reg.PREOP:
            return 0 if self._mailbox_is_sound() else reg.INVALID_MAILBOX_PREOP
        if wanted == reg.SAFEOP:
            for outputs, code in (
                (True, reg.INVALID_OUTPUT_CONFIG),
                (False, reg.INVALID_INPUT_CONFIG),
            ):
                if not self._process_data_is_sound(outputs):
                    return code
            return self._clock_refuses()
        if (
            wanted == reg.OP
            and self.clock is not None
            and self.esc.memory[reg.DC_ACTIVATION] & 0x02
            and not self._sync_runs
        ):
            return reg.NO_SYNC
        return 0

    def _start_sync(self, address: int, length: int) -> None:
        """SYNC0 begins at its start time; where that has passed already it does not begin (as good
        as never).
        """
        starts = self.esc.get(reg.DC_START_TIME, 8) - (self.clock.system_ns() & 0xFFFFFFFFFFFFFFFF)
        self._sync_runs = bool(self.esc.memory[reg.DC_ACTIVATION] & 0x01) and starts > 0

    def _mailbox_is_sound(self) -> bool:
        if self.mailbox is None:
            return True
        managers = self.esc.sync_managers
        for number, master_writes in ((0, True), (1, False)):
            start, length, control, _, activate, _ = managers.settings(number)
            is_right = (
                control & 0x03 == 0x02 and bool(control & 0x0C) == master_writes and activate & 1
            )
            if (
                not is_right
                or length < 16
                or start < reg.PROCESS_RAM
                or start + length > reg.MEMORY_SIZE
            ):
                return False
        return True

    def _process_data_is_sound(self, outputs: bool) -> bool:
        wanted = self.process_bytes(outputs)
        number = self.sync_manager_for(OUTPUTS if outputs else INPUTS)
        if number is None:
            return wanted == 0
        _, length, control, _, activate, _ = self.esc.sync_managers.settings(number)
        if not activate & 1 or length == 0:
            return wanted == 0
        return length == wanted and bool(control & 0x0C) == outputs and control & 0x03 == 0

    def _clock_refuses(self) -> int:
        activation = self.esc.memory[reg.DC_ACTIVATION]
        if self.clock is None or not activation & 0x06:
            return 0
        if not activation & 0x01:
            return reg.INVALID_DC_SYNC
        return (
            0
            if self.esc.get(reg.DC_SYNC0_CYCLE, 4) or not activation & 0x02
            else reg.INVALID_DC_CYCLE
        )

    def entered(self, previous: int, state: int) -> None:
        """Told after every change of state."""
        if state == reg.INIT and self.mailbox is not None:
            self.mailbox.reset()
            self.coe.reset()
        self._close_process_data(state not in (reg.SAFEOP, reg.OP))

    def _close_process_data(self, closed: bool) -> None:
        if self.controller.is_emulated:
            return
        for use in (OUTPUTS, INPUTS):
            number = self.sync_manager_for(use)
            if number is not None:
                self.esc.sync_managers.close(number, closed)
        self.esc.on_mapping()

    @property
    def drives_outputs(self) -> bool:
        """Do the outputs that the master sends act now?"""
        return self.is_present and self.al.state == reg.OP and not self.watchdog.expired

    @property
    def is_guarded(self) -> bool:
        """Does the watchdog guard outputs here: is a sync manager on that feeds it?"""
        return any(
            area.triggers_watchdog and not area.is_mailbox for area in self.esc.sync_managers.areas
        )

    def watchdog_expired(self) -> None:
        """The controller's watchdog ran out. With a processor the state falls to SAFEOP with its
        error.
        """
        if not self.controller.is_emulated and self.al.state == reg.OP:
            self.al.fail(reg.SAFEOP, reg.SYNC_MANAGER_WATCHDOG)
        self.on_change()

    def safe_outputs(self, image: bytearray, places: list[Place]) -> None:
        """Writes what the outputs become when the master no longer drives them; ``places``: of
        this slave's entries in the image.
        """
        for place in places:
            if place.entry.bits < 8:
                image[place.byte] &= ~(((1 << place.entry.bits) - 1) << place.bit)
            else:
                image[place.byte : place.byte + place.entry.bits // 8] = bytes(
                    place.entry.bits // 8
                )

    def power_up(self) -> None:
        """As after its supply came back: everything volatile is gone."""
        memory = self.esc.memory
        memory[:] = bytes(len(memory))
        self._identify()
        self.watchdog.power_up()
        self.watchdog.expired = False
        self.eeprom.power_up()
        self.esc.sync_managers.reload()
        self.al.power_up()
        self._close_process_data(True)
        self.esc.on_mapping()
        self.on_change()


__all__ = ["Controller", "MAILBOX_IN", "MAILBOX_OUT", "Settings", "Slave"]

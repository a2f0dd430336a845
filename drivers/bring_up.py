"""From a bus just found to a bus in SAFEOP: identity, objects, mapping, watchdogs, clocks. No
output is written here.

Everything is checked before anything is changed that matters: a bus that is not the rig file's is
left in PREOP.
"""

from collections.abc import Callable

import pysoem

from drivers.alone import check_alone
from drivers.bus import Bus, State
from drivers.channels import check_channels
from drivers.epos4 import check_drive
from drivers.filters import filter_steps, set_filter
from drivers.identity import Found, differences, label
from drivers.mailbox import Mailbox
from drivers.mapping import assignment_steps, set_up_mapping
from drivers.reactions import set_homing, set_reactions, set_window
from drivers.registers import (
    INPUTS,
    OUTPUTS,
    OUTPUTS_BARE,
    arm_watchdog,
    set_watchdog,
    set_watchdog_once,
    switch_off,
)
from drivers.wire import WireImage
from drivers.words import ERROR, PREOP, SAFEOP, abort_words, error_class_words, state_words
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig, Slave, StartupSdo
from epa_rt.config.rig_checks import entries_of
from epa_rt.config.rig_homing import HomingOptions
from epa_rt.control.drive_errors import drive_error_words

_STATE_S = 5.0


class Unclear(BackendError):
    """Answers got lost on the way; another try may go well."""


def identify(bus: Bus, rig: Rig) -> None:
    """Finds the slaves and compares every one with the rig file. Raises BackendError: each
    difference named.
    """
    count = bus.find()
    if count == 0:
        raise BackendError(
            f"found no slave on {bus.interface}, expected {len(rig.slaves)}: is"
            f" {rig.slaves[0].name} powered, and is this its cable?"
        )
    found = [Found(slave.man, slave.id, slave.rev, slave.name) for slave in bus.slaves]
    sentences = differences(rig.slaves, found)
    if sentences:
        raise BackendError(f"the bus is not the rig {rig.name}: {'; '.join(sentences)}")


def reached(states: list[State], wanted: int, labels: tuple[str, ...]) -> None:
    """Raises BackendError naming the first slave that is not in the wanted state, with its AL
    status code.
    """
    for name, state in zip(labels, states, strict=True):
        if state.state != wanted:
            verb = "refused" if state.state & ERROR else "did not reach"
            raise BackendError(f"{name} {verb} {state_words(wanted)}: it is in {state.words()}")


def objects_at_start(slave: Slave) -> list[tuple[tuple[int, int], bytes]]:
    """Place and value of what is written before anything else: what its kind of terminal needs,
    then what the rig file says.
    """
    given = {sdo.place for sdo in slave.startup}
    own = [
        StartupSdo(
            object=f"0x{startup.index:04X}:{startup.subindex:02X}",
            type=startup.type,
            value=startup.value,
        )
        for startup in slave.description.startup
        if (startup.index, startup.subindex) not in given
    ]
    return [(sdo.place, sdo.data) for sdo in (*own, *slave.startup)]


def set_up_slave(
    bus: Bus, rig: Rig, index: int, mailbox: Mailbox | None, homing: HomingOptions | None = None
) -> list[str]:
    """All that a slave loses with its power: start-up objects, mapping, watchdog. In PREOP; gives
    notes. ``homing`` of the drive; None: one that moves nothing.
    """
    slave = rig.slaves[index]
    notes: list[str] = []
    if mailbox is not None:
        for place, data in objects_at_start(slave):
            mailbox.set(*place, data)
        set_up_mapping(mailbox, slave)
        check_channels(mailbox, slave, rig)
        notes = [*set_filter(mailbox, slave), *check_alone(mailbox, slave)]
        if slave.device == "EPOS4":
            notes += check_drive(mailbox, slave, rig)
            if entries_of(slave, outputs=True):
                notes += set_reactions(mailbox, slave, rig)
                notes += set_window(mailbox, slave, rig)
                notes += set_homing(mailbox, rig, homing)
    if entries_of(slave, outputs=True):
        set_watchdog(bus.slaves[index], label(index + 1, slave), rig.safety.watchdog)
    return notes


def set_up_again(
    bus: Bus, rig: Rig, index: int, mailbox: Mailbox | None
) -> list[Callable[[], object]]:
    """What a terminal needs in PREOP after it lost its supply, one short step each; its mapping has
    been seen before. A step raises pysoem.WkcError where the terminal is gone again.
    """
    slave = rig.slaves[index]
    steps: list[Callable[[], object]] = []
    if mailbox is not None:
        steps += [
            step
            for place, data in objects_at_start(slave)
            for step in mailbox.steps_to_set(*place, data)
        ]
        steps += assignment_steps(mailbox, slave)
        steps += filter_steps(mailbox, slave)
    if entries_of(slave, outputs=True):
        steps.append(
            lambda: set_watchdog_once(
                bus.slaves[index], label(index + 1, slave), rig.safety.watchdog
            )
        )
    return steps


def configure(
    bus: Bus, rig: Rig, wire: WireImage, synchronise: bool, homing: HomingOptions | None = None
) -> tuple[dict[int, Mailbox], bool, list[str]]:
    """Sets every slave up and takes the bus to SAFEOP. Gives mailboxes, whether there is a
    reference clock, and notes.
    """
    bus.master.manual_state_change = 1  # mapping must not ask for SAFEOP before the clocks are set
    reached(bus.wait_for(PREOP, _STATE_S), PREOP, wire.labels)
    mailboxes = {
        i: Mailbox(
            bus.slaves[i],
            wire.labels[i],
            drive_error_words if slave.device == "EPOS4" else error_class_words,
        )
        for i, slave in enumerate(rig.slaves)
        if slave.description.serves_objects
    }
    notes = [
        note
        for i in range(len(rig.slaves))
        for note in set_up_slave(bus, rig, i, mailboxes.get(i), homing)
    ]
    _map(bus, wire)
    _arm_watchdogs(bus, rig, wire)
    _switch_off_unused(bus, rig, wire)
    has_clock = synchronise and _synchronise(bus, rig)
    bus.use(wire)
    bus.ask(SAFEOP)
    reached(bus.wait_for(SAFEOP, _STATE_S), SAFEOP, wire.labels)
    bus.be_patient(False)
    return mailboxes, has_clock, notes


def _map(bus: Bus, wire: WireImage) -> None:
    """Slaves narrower than a byte need the overlapping map: the plain one makes neighbours
    overwrite each other.
    """
    try:
        bus.master.config_overlap_map()
    except pysoem.ConfigMapError as error:
        kind = (
            BackendError
            if any(isinstance(e, pysoem.SdoError) for e in error.error_list)
            else Unclear
        )
        raise kind(
            "the slaves' process data could not be read: "
            + "; ".join(map(_map_words, error.error_list))
        ) from None
    wire.check(
        [(len(slave.output), len(slave.input)) for slave in bus.slaves], bus.master.expected_wkc
    )


def _arm_watchdogs(bus: Bus, rig: Rig, wire: WireImage) -> None:
    """After the mapping, which writes the sync managers; what is taken back later is written as it
    stands then (Shape).
    """
    for i, slave in enumerate(rig.slaves):
        if entries_of(slave, outputs=True):
            arm_watchdog(
                bus.slaves[i],
                wire.labels[i],
                OUTPUTS if slave.description.serves_objects else OUTPUTS_BARE,
            )


def _switch_off_unused(bus: Bus, rig: Rig, wire: WireImage) -> None:
    """A drive that only reports has no outputs, or only takes commands."""
    for i, slave in enumerate(rig.slaves):
        for outputs, sync_manager in ((True, OUTPUTS), (False, INPUTS)):
            if slave.device == "EPOS4" and not entries_of(slave, outputs):
                switch_off(bus.slaves[i], wire.labels[i], sync_manager)


def _map_words(error: Exception) -> str:
    position = getattr(error, "slave_pos", 0)
    if isinstance(error, pysoem.SdoError):
        return (
            f"slave {position}, object 0x{error.index:04X}:{error.subindex:02X}:"
            f" {abort_words(error.abort_code & 0xFFFFFFFF)}"
        )
    return f"slave {position}: {type(error).__name__}"


def driven(rig: Rig) -> list[tuple[int, Slave]]:
    """The drives that take commands over the bus, by index."""
    return [
        (i, slave)
        for i, slave in enumerate(rig.slaves)
        if slave.device == "EPOS4" and entries_of(slave, outputs=True)
    ]


def _synchronise(bus: Bus, rig: Rig) -> bool:
    """Measures the delays between the slaves' clocks and starts SYNC0 of each drive once per
    cycle.
    """
    has_clock = bool(bus.master.config_dc())
    drives = driven(rig)
    if drives and not has_clock:
        raise BackendError(
            "found no slave with a distributed clock, expected one for the drive's SYNC0 "
            "(or 'master: {clock: free}' in the rig file)"
        )
    for index, _slave in drives:
        bus.slaves[index].dc_sync(True, round(rig.period_s * 1e9), 0)
    return has_clock


def stop_clocks(bus: Bus, rig: Rig) -> None:
    """SYNC0 off, so that the drive does not wait for targets that no longer come."""
    for index, _slave in driven(rig):
        bus.slaves[index].dc_sync(False, 0, 0)

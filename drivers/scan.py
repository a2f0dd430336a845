"""Looking at a bus without driving it: slaves are addressed and taken to PREOP, nothing further,
then back to INIT.
"""

from collections.abc import Sequence
from typing import NamedTuple

from drivers.bus import Bus
from drivers.claim import Claim
from drivers.identity import Found, device_of
from drivers.interface import choose
from drivers.mailbox import Mailbox
from drivers.other_master import expect_no_master
from drivers.words import INIT, PREOP
from epa_rt.backend import BackendError
from epa_rt.config.devices import DEVICES
from epa_rt.config.rig import Slave

_PREOP_S = 3.0
_WATCHDOG_S = 0.1  # of slaves as they leave the maker
_FIRMWARE = 0x100A


class Seen(NamedTuple):
    """One slave: what its SII says, the device we know it as, its state, its firmware where it
    tells it.
    """

    found: Found
    device: str
    state: str
    firmware: str


def scan(
    interface: str | None, take_over: bool = False, expected: Sequence[Slave] = ()
) -> tuple[str, list[Seen]]:
    """The interface that was used and every slave on it, in order. ``expected``: of a rig file,
    whose generic terminals are known then. Raises BackendError where the bus cannot be looked at,
    or where a master drives it (unless ``take_over``).
    """
    chosen = choose(interface)
    claim = Claim(chosen)
    try:
        expect_no_master(chosen, _WATCHDOG_S, take_over)
        return chosen, _slaves(chosen, expected)
    finally:
        claim.release()


def _slaves(chosen: str, expected: Sequence[Slave]) -> list[Seen]:
    bus = Bus(chosen, 0.01)
    try:
        if bus.find() == 0:
            return []
        states = bus.wait_for(PREOP, _PREOP_S)
        seen = []
        for position, (slave, state) in enumerate(zip(bus.slaves, states, strict=True), 1):
            found = Found(slave.man, slave.id, slave.rev, slave.name)
            device = device_of(found, expected)
            known = DEVICES.get(device)
            has_objects = state.state == PREOP and (known is None or known.serves_objects)
            seen.append(
                Seen(
                    found, device, state.words(), _firmware(slave, position) if has_objects else ""
                )
            )
        bus.ask(INIT)
        return seen
    finally:
        bus.close()


def _firmware(slave: object, position: int) -> str:
    try:
        text = (
            Mailbox(slave, f"slave {position}")
            .read(_FIRMWARE)
            .split(b"\0")[0]
            .decode("ascii", "replace")
        )
    except BackendError:
        return ""
    return text if text.isprintable() else ""

"""The AL state machine of a slave: requests by the master, errors by the slave, each change a
little late.

Sources: ETG.1000.6 (state machine, AL control and status), ETG.1020 (status codes).
"""

from collections.abc import Callable
from typing import Protocol

from sim_backend.bus import registers as reg
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.esc import Esc

DELAYS_NS = {reg.INIT: 1_000_000, reg.PREOP: 2_000_000, reg.SAFEOP: 3_000_000, reg.OP: 2_000_000}
_UP = {(reg.INIT, reg.PREOP), (reg.PREOP, reg.SAFEOP), (reg.SAFEOP, reg.OP)}
_LEVEL = {reg.INIT: 0, reg.PREOP: 1, reg.SAFEOP: 2, reg.OP: 3}


class StateUser(Protocol):
    """Who is asked before a step up, and told after any change."""

    def refuses(self, current: int, wanted: int) -> int: ...  # AL status code, 0 to allow

    def entered(self, previous: int, state: int) -> None: ...


class AlMachine:
    """State and error of one slave, shown in registers 0x0130 and 0x0134.

    A slave whose ``is_emulated`` has no processor: the controller itself copies what the master
    asks for, unchecked.
    """

    def __init__(
        self,
        esc: Esc,
        agenda: Agenda,
        user: StateUser,
        is_emulated: bool,
        delays_ns: dict[int, int] = DELAYS_NS,
    ):
        self._esc, self._agenda, self._user = esc, agenda, user
        self._is_emulated, self._delays_ns = is_emulated, delays_ns
        self.state, self.has_error, self.code = reg.INIT, False, 0
        self._request = 0
        self.on_change: Callable[[], None] = lambda: None
        esc.on_write.append(
            (reg.AL_CONTROL, reg.AL_CONTROL + 1, lambda address, length: self._requested())
        )
        self._show()

    def _show(self) -> None:
        self._esc.put(reg.AL_STATUS, 2, self.state | (reg.ERROR_FLAG if self.has_error else 0))
        self._esc.put(reg.AL_STATUS_CODE, 2, self.code)

    def _requested(self) -> None:
        control = self._esc.get(reg.AL_CONTROL, 2)
        wanted = control & 0x0F
        self._request += 1
        if self._is_emulated:
            self._change(
                wanted if wanted in _LEVEL else self.state,
                self.has_error and not control & reg.ACKNOWLEDGE,
                self.code,
            )
            return
        if self.has_error and not control & reg.ACKNOWLEDGE:
            return  # an error stands until it is acknowledged
        if self.has_error:
            self.has_error, self.code = False, 0
            self._show()
        request = self._request
        self._agenda.after(
            self._delays_ns.get(wanted, 1_000_000),
            lambda: request == self._request and self._try(wanted),
        )

    def _try(self, wanted: int) -> None:
        if wanted == reg.BOOT:
            self.fail(self.state, reg.BOOT_NOT_SUPPORTED)
        elif wanted not in _LEVEL:
            self.fail(self.state, reg.UNKNOWN_STATE)
        elif _LEVEL[wanted] > _LEVEL[self.state]:
            code = (
                self._user.refuses(self.state, wanted)
                if (self.state, wanted) in _UP
                else reg.INVALID_STATE_CHANGE
            )
            if code:
                self.fail(self.state, code)
            else:
                self._change(wanted, False, 0)
        else:
            self._change(wanted, False, 0)

    def fail(self, state: int, code: int) -> None:
        """The slave itself reports an error, in ``state`` (the present one, or a lower one that it
        drops to).
        """
        self._request += 1
        self._change(state, True, code)

    def power_up(self) -> None:
        self._request += 1
        self._change(reg.INIT, False, 0)

    def _change(self, state: int, has_error: bool, code: int) -> None:
        previous, self.state = self.state, state
        self.has_error, self.code = has_error, code if has_error else 0
        self._show()
        if previous != state:
            self._user.entered(previous, state)
        self.on_change()

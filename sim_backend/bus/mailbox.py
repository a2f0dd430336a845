"""The mailbox of a slave: messages in by sync manager 0, out by sync manager 1, one at a time,
repeated on request.

Sources: ETG.1000.4 (mailbox header, repeat), ETG.1000.6 (mailbox protocols).
"""

from collections import deque
from collections.abc import Callable
from struct import pack, unpack_from

from sim_backend.bus import registers as reg
from sim_backend.bus.agenda import Agenda
from sim_backend.bus.esc import Esc
from sim_backend.bus.sync_manager import REPEAT

ERROR_PROTOCOL, COE = 0x00, 0x03
_UNSUPPORTED, _INVALID_HEADER, _TOO_SHORT, _INVALID_SIZE = 0x02, 0x04, 0x05, 0x08
_HEADER = 6
_QUEUE = 16
_REPEAT_REQUEST, _REPEAT_DONE = reg.SYNC_MANAGER + 8 + 6, reg.SYNC_MANAGER + 8 + 7
RESPONSE_NS = 100_000

Service = Callable[[bytes, int], list[bytes]]  # message and room for an answer -> answers


class Mailbox:
    """``serve`` answers a CoE message. ``is_up`` says whether the state machine lets mailboxes
    work.
    """

    def __init__(
        self,
        esc: Esc,
        agenda: Agenda,
        serve: Service,
        is_up: Callable[[], bool],
        response_ns: int = RESPONSE_NS,
    ):
        self._esc, self._agenda, self._serve, self._is_up = esc, agenda, serve, is_up
        self._response_ns = response_ns
        self._queue: deque[bytes] = deque(maxlen=_QUEUE)
        self._counter = 0
        self._round = 0
        esc.on_mailbox = self._touched
        esc.on_write.append((_REPEAT_REQUEST, _REPEAT_REQUEST + 1, self._repeat))

    def reset(self) -> None:
        """The mailbox goes down: nothing waits in it any more."""
        self._queue.clear()
        self._round += 1
        self._counter = 0
        for number in (0, 1):
            self._esc.sync_managers.set_full(number, False)

    def room(self) -> int:
        """Bytes that one answer may have."""
        return max(0, self._esc.sync_managers.settings(1)[1] - _HEADER)

    def send(self, message: bytes, protocol: int = COE) -> None:
        """Queues a message for the master: an answer, or an emergency."""
        if len(message) > self.room():
            return
        self._counter = self._counter % 7 + 1
        self._queue.append(
            pack("<HHBB", len(message), 0, 0, protocol | self._counter << 4) + message
        )
        self._post()

    def _post(self) -> None:
        managers = self._esc.sync_managers
        if self._queue and managers.is_enabled(1) and not managers.is_full(1):
            start, length = managers.settings(1)[:2]
            message = self._queue.popleft()
            if len(message) <= length and start + length <= reg.MEMORY_SIZE:
                self._esc.memory[start : start + length] = message.ljust(length, b"\0")
                managers.set_full(1, True)

    def _touched(self, number: int, written: bool) -> None:
        if number == 0 and written:
            current = self._round
            self._agenda.after(
                self._response_ns, lambda: current == self._round and self._receive()
            )
        elif number == 1 and not written:
            self._post()

    def _receive(self) -> None:
        start, length = self._esc.sync_managers.settings(0)[:2]
        message = bytes(self._esc.memory[start : start + length])
        self._esc.sync_managers.set_full(0, False)
        if not self._is_up() or len(message) < _HEADER:
            return
        size, _, _, kind = unpack_from("<HHBB", message)
        if size > length - _HEADER:
            self.send(pack("<HH", 1, _INVALID_SIZE), ERROR_PROTOCOL)
        elif kind & 0x0F != COE:
            self.send(pack("<HH", 1, _UNSUPPORTED), ERROR_PROTOCOL)
        elif size < 2:
            self.send(pack("<HH", 1, _TOO_SHORT), ERROR_PROTOCOL)
        else:
            for answer in self._serve(message[_HEADER : _HEADER + size], self.room()):
                self.send(answer)

    def _repeat(self, address: int, length: int) -> None:
        """The master has toggled the repeat bit: show the last message again, then toggle the
        answer.
        """
        memory = self._esc.memory
        if (memory[_REPEAT_REQUEST] ^ memory[_REPEAT_DONE]) & REPEAT:
            memory[_REPEAT_DONE] = memory[_REPEAT_DONE] & ~REPEAT | memory[_REPEAT_REQUEST] & REPEAT
            if (
                self._esc.sync_managers.is_enabled(1)
                and memory[self._esc.sync_managers.settings(1)[0]]
            ):
                self._esc.sync_managers.set_full(1, True)

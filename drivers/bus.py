"""One open network interface with the slaves behind it: process data out and in, states asked for
and read.
"""

import os
import select
import socket
import time
from typing import NamedTuple

import pysoem

from drivers.wire import WireImage
from drivers.words import ERROR, al_status_words, state_words
from epa_rt.backend import BackendError

pysoem.settings.always_release_gil = True  # read by Master() when it is made

LOST = -1  # no frame came back
_TRIES = 3
_PATIENT_US, _BRISK_US = (
    50_000,
    2_000,
)  # how long SOEM waits for an answer before it sends again; the second is its own
_PATIENT_SDO_US, _PATIENT_SEND_US = (
    700_000,
    20_000,
)  # SOEM's own: for an object's answer, and for a mailbox to be free


class State(NamedTuple):
    """A slave's application-layer state and status code; state 0 is a slave that does not
    answer.
    """

    state: int
    al_status: int

    def words(self) -> str:
        text = state_words(self.state)
        return (
            f"{text} ({al_status_words(self.al_status)})"
            if self.state & ERROR or self.al_status
            else text
        )


class Bus:
    """A pysoem master and its socket. ``swap`` is the one exchange of process data, for bring-up
    and cycle alike; ``sent_ns`` (monotonic clock) and ``round_trip_ns`` tell of the last one.
    """

    def __init__(
        self, interface: str, frame_timeout_s: float, answer_s: float = 1e-6 * _PATIENT_SDO_US
    ):
        """``answer_s``: how long a slave's mailbox is waited for while others run."""
        self.interface = interface
        self.master = pysoem.Master()
        self.slaves: list[pysoem.CdefSlave] = []
        self._timeout_s = frame_timeout_s
        self._timeout_us = round(frame_timeout_s * 1e6)
        self._answer_us = round(answer_s * 1e6)
        self._socket = self._open(interface)
        self._wire: WireImage | None = None
        self.sent_ns = self.round_trip_ns = 0

    def _open(self, interface: str) -> "socket.socket | None":
        """Opens the master and finds its socket among our own files, so that a lost frame can be
        waited for exactly.

        SOEM waits in ``recv`` with a time-out that the kernel rounds up to whole jiffies, about 8
        ms at 250 Hz.
        """
        before = set(os.listdir("/proc/self/fd"))
        try:
            self.master.open(interface)
        except ConnectionError:
            raise BackendError(
                f"the network interface {interface} could not be opened for EtherCAT"
            ) from None
        for name in sorted(set(os.listdir("/proc/self/fd")) - before, key=int):
            try:
                candidate = socket.socket(fileno=os.dup(int(name)))
            except OSError:
                continue
            if candidate.family == socket.AF_PACKET:
                return candidate
            candidate.close()
        return None

    def find(self) -> int:
        """Counts and addresses the slaves and takes them to PREOP. Gives how many there are."""
        self.be_patient(True)
        self.master.manual_state_change = 0
        for _ in range(_TRIES):  # SOEM takes one frame that stayed away for an empty wire
            count: int = max(0, self.master.config_init())
            if count:
                break
        self.slaves = list(self.master.slaves) if count else []
        return count

    def be_patient(self, patient: bool) -> None:
        """Patient while nothing runs: a frame that is late, and sent again too early, confuses
        mailboxes. Afterwards no answer may hold up the process data.
        """
        timeouts, answer_us = (
            pysoem.settings.timeouts,
            (_PATIENT_SDO_US if patient else self._answer_us),
        )
        timeouts.ret = _PATIENT_US if patient else _BRISK_US
        timeouts.tx_mailbox = min(_PATIENT_SEND_US, answer_us)
        self.master.sdo_read_timeout = self.master.sdo_write_timeout = answer_us

    def use(self, wire: WireImage) -> None:
        """The layout by which ``swap`` cuts the image up."""
        self._wire = wire

    def swap(self, outputs_raw: bytes) -> tuple[int, bytes]:
        """One frame: outputs to the slaves, inputs back. Gives the working counter (LOST: no frame)
        and the inputs.

        Where no frame came back the inputs are the last ones.
        """
        slaves, master, wire = self.slaves, self.master, self._wire
        if wire is None:
            raise BackendError("found no layout of the process data, expected one")
        for index, start, end, _length in wire.writers:
            slaves[index].output = outputs_raw[
                start:end
            ]  # lengths were checked once, in WireImage.check
        self.sent_ns = sent_ns = time.monotonic_ns()
        master.send_overlap_processdata(release_gil=True)
        counter = self._receive(master)
        self.round_trip_ns = time.monotonic_ns() - sent_ns
        return counter, b"".join([slaves[index].input for index in wire.readers])

    def _receive(self, master: pysoem.Master) -> int:
        if self._socket is None or select.select([self._socket], [], [], self._timeout_s)[0]:
            counter: int = master.receive_processdata(self._timeout_us)
            return counter
        self._socket.setblocking(
            False
        )  # the socket is empty: SOEM gives the frame up without waiting for it
        try:
            given_up: int = master.receive_processdata(0)
            return min(LOST, given_up)
        finally:
            self._socket.setblocking(True)

    def states(self) -> list[State]:
        """Every slave's state, by one broadcast datagram as long as all are well."""
        self.master.read_state()
        return [State(slave.state, slave.al_status) for slave in self.slaves]

    def ask(self, state: int) -> None:
        """Asks all slaves for a state, without waiting; an error that stands is acknowledged."""
        self.master.state = state
        self.master.write_state()

    def wait_for(self, state: int, seconds: float) -> list[State]:
        """Polls until every slave is in ``state`` or refuses or the time is over. Gives the states
        then.
        """
        deadline = time.monotonic() + seconds
        while True:
            states = self.states()
            if (
                all(s.state == state for s in states)
                or any(s.state & ERROR for s in states)
                or time.monotonic() > deadline
            ):
                return states
            time.sleep(0.001)

    def close(self) -> None:
        """Closes the socket; may be called twice."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        if self.master.context_initialized:
            self.master.close()

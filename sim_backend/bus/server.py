"""The emulated bus on a network interface: an AF_PACKET loop that answers frames and lets the plant
run.

It binds to EtherType 0x88A4 only, so that it never reads its own frames.
"""

import gc
import os
import select
import socket
import time
from collections.abc import Callable

from sim_backend.bus.arrivals import Arrivals
from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.bus.frame import ETHERTYPE

_BUFFER = 2048
_IDLE_S = 0.1
# of the plant, when it has to catch up: frames that have come meanwhile are answered in between
_STEPS_AT_ONCE = 10
_IGNORE_OUTGOING = 23  # PACKET_IGNORE_OUTGOING
_SOL_PACKET = 263


def open_interface(interface: str) -> socket.socket:
    """A raw socket on an interface. Raises OSError (no such interface, no right to)."""
    packets = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)
    try:
        packets.setsockopt(_SOL_PACKET, _IGNORE_OUTGOING, 1)
        packets.bind((interface, ETHERTYPE))
        packets.setblocking(False)
    except OSError:
        packets.close()
        raise
    return packets


class Server:
    """Runs a bus on a socket until ``stop``. ``handlers``: what else to wait for, by file
    descriptor.
    """

    def __init__(self, bus: EmulatedBus, packets: socket.socket):
        self.bus = bus
        self.handlers: dict[int, Callable[[], None]] = {}
        self._packets = packets
        self._is_stopped = self._is_warm = False

    def stop(self) -> None:
        self._is_stopped = True

    def warm_up(self) -> None:
        """Everything that the first frame would have to wait for: compiled code, and garbage
        collection, which is frozen until ``run`` ends.
        """
        self.bus.plant.warm_up()
        gc.collect()
        gc.freeze()
        gc.disable()
        self._is_warm = True

    def run(self) -> None:
        """Answers frames until stopped."""
        if not self._is_warm:
            self.warm_up()
        try:
            self._loop()
        finally:
            self._is_warm = False
            gc.enable()
            gc.unfreeze()

    def _loop(self) -> None:
        """Whoever shares the core with us waits until this goes to sleep again: nothing is done
        twice, least after a frame.

        A frame is answered as of when it arrived, and time passes only once no older frame waits:
        what the slaves see does not depend on when this process is let run.
        """
        bus, packets, clock, wait = self.bus, self._packets, time.monotonic_ns, select.select
        bus.transmit = self._send
        arrivals = None if bus.lock_step else Arrivals(packets)
        buffer = bytearray(_BUFFER)
        waiting = [packets, *self.handlers]
        while not self._is_stopped:
            due_ns = bus.next_due_ns()
            wait_s = _IDLE_S if due_ns is None else (due_ns - clock()) * 1e-9
            ready = wait(waiting, (), (), min(wait_s, _IDLE_S) if wait_s > 0.0 else 0.0)[0]
            now_ns = clock()
            size = self._receive(buffer)
            if size:
                frame = buffer[:size]
                if bus.receive(frame, now_ns if arrivals is None else arrivals.of_last(now_ns)):
                    self._send(frame)
            else:
                bus.advance_to(now_ns, _STEPS_AT_ONCE)
            for one in ready:
                if one is not packets:
                    self.handlers[one]()
                    waiting = [packets, *self.handlers]

    def _receive(self, buffer: bytearray) -> int:
        try:
            return self._packets.recv_into(buffer)
        except OSError:
            return 0  # the interface went down, or the frame was not meant for us after all

    def _send(self, frame: bytes | bytearray) -> None:
        try:
            self._packets.send(frame)
        except (BlockingIOError, OSError):
            pass  # the interface is full or down: a frame lost, as on a wire


def prefer(priority: int | None) -> str:
    """Asks for SCHED_FIFO; returns one sentence about what came of it."""
    if priority is None:
        return "ordinary scheduling"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        return f"SCHED_FIFO not granted ({error.strerror})"
    return f"SCHED_FIFO priority {priority}"

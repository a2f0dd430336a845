"""The emulated bus on a network interface: an AF_PACKET loop that answers frames and lets the plant run.

It binds to EtherType 0x88A4 only, so that it never reads its own frames.
"""

import gc
import os
import select
import socket
import time
from collections.abc import Callable

from sim_backend.bus.emulated_bus import EmulatedBus
from sim_backend.bus.frame import ETHERTYPE

_BUFFER = 2048
_IDLE_S = 0.1
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
    """Runs a bus on a socket until ``stop``. ``handlers``: what else to wait for, by file descriptor."""

    def __init__(self, bus: EmulatedBus, packets: socket.socket):
        self.bus = bus
        self.handlers: dict[int, Callable[[], None]] = {}
        self._packets = packets
        self._is_stopped = False

    def stop(self) -> None:
        self._is_stopped = True

    def run(self) -> None:
        """Answers frames until stopped. Garbage collection is frozen meanwhile."""
        gc.collect()
        gc.freeze()
        gc.disable()
        try:
            self._loop()
        finally:
            gc.enable()
            gc.unfreeze()

    def _loop(self) -> None:
        """Whoever shares the core with us waits until this goes to sleep again: nothing is done twice, least after a frame."""
        bus, packets, clock, wait = self.bus, self._packets, time.monotonic_ns, select.select
        bus.transmit = self._send
        buffer = bytearray(_BUFFER)
        waiting = [packets, *self.handlers]
        while not self._is_stopped:
            due_ns = bus.next_due_ns()
            wait_s = _IDLE_S if due_ns is None else (due_ns - clock()) * 1e-9
            ready = wait(waiting, (), (), min(wait_s, _IDLE_S) if wait_s > 0.0 else 0.0)[0]
            if not ready:
                bus.advance_to(clock())
            for one in ready:
                if one is packets:
                    size = self._receive(buffer)
                    frame = buffer[:size]
                    if size and bus.receive(frame, clock()):
                        self._send(frame)
                else:
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

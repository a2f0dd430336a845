"""Writes the frames of an interface, both ways, to a pcap file until SIGTERM or SIGINT. Needs
CAP_NET_RAW there.

The kernel stamps each frame; what it had to drop is said at the end. Beside an emulated bus, in its
network:

    epa bus run --rig config/rigs/bench.yaml -- python scripts/bus_capture.py --out bus.pcap --
    python master.py
"""

import argparse
import os
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from pathlib import Path

_ETH_P_ALL, _SOL_PACKET, _PACKET_STATISTICS, _SO_TIMESTAMPNS = 0x0003, 263, 6, 35
_NANOSECOND_PCAP, _ETHERNET, _LARGEST = 0xA1B23C4D, 1, 65535
_BUFFER_BYTES = 64 << 20


class Capture:
    """A raw socket on an interface. ``drain`` writes what has come; ``frames`` counts it."""

    def __init__(self, interface: str, path: Path):
        self.frames = 0
        self._file = path.open("wb")
        self._file.write(struct.pack("<IHHiIII", _NANOSECOND_PCAP, 2, 4, 0, 0, _LARGEST, _ETHERNET))
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ETH_P_ALL))
        self._socket.setsockopt(
            socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES
        )  # the kernel gives what it allows
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._socket.bind((interface, _ETH_P_ALL))
        self._socket.setblocking(False)

    def fileno(self) -> int:
        return self._socket.fileno()

    def drain(self) -> None:
        while True:
            try:
                frame, stamps, _flags, _address = self._socket.recvmsg(_LARGEST, 64)
            except BlockingIOError:
                return
            seconds, nanoseconds = (
                struct.unpack("qq", stamps[0][2])
                if stamps
                else divmod(time.time_ns(), 1_000_000_000)
            )
            self._file.write(
                struct.pack("<IIII", seconds, nanoseconds, len(frame), len(frame)) + frame
            )
            self.frames += 1

    def close(self) -> int:
        """Gives the number of frames that the kernel dropped."""
        self.drain()
        dropped = struct.unpack("II", self._socket.getsockopt(_SOL_PACKET, _PACKET_STATISTICS, 8))[
            1
        ]
        self._socket.close()
        self._file.close()
        return dropped


def capture(interface: str, path: Path, command: list[str]) -> int:
    """Captures until a signal, or while ``command`` runs; gives its exit code."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.set_wakeup_fd(writer)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGCHLD):
        signal.signal(number, lambda *_: None)
    taken = Capture(interface, path)
    process = subprocess.Popen(command) if command else None
    is_done = False
    while not is_done:
        ready = select.select([taken, reader], (), ())[0]
        taken.drain()
        if reader in ready:
            numbers = os.read(reader, 64)
            is_done = (
                process.poll() is not None
                if process
                else bool({*numbers} & {signal.SIGTERM, signal.SIGINT})
            )
            if process and not is_done and signal.SIGTERM in numbers:
                process.terminate()
    dropped = taken.close()
    print(f"{taken.frames} frames in {path}, {dropped} dropped", file=sys.stderr)
    return process.returncode if process else 0


def main() -> int:
    arguments = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    arguments.add_argument(
        "--interface",
        default=os.environ.get("EPA_BUS_INTERFACE"),
        help="default: $EPA_BUS_INTERFACE",
    )
    arguments.add_argument("--out", type=Path, required=True, help="pcap file")
    arguments.add_argument(
        "command",
        nargs=argparse.REMAINDER,
        metavar="-- COMMAND",
        help="run this meanwhile; the capture ends with it",
    )
    chosen = arguments.parse_args()
    if chosen.interface is None:
        arguments.error("found no interface, expected --interface or EPA_BUS_INTERFACE")
    return capture(
        chosen.interface,
        chosen.out,
        chosen.command[1:] if chosen.command[:1] == ["--"] else chosen.command,
    )


if __name__ == "__main__":
    sys.exit(main())

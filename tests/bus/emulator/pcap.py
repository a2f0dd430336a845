"""Frames of an interface into a pcap file, by a process of its own, so that somebody else's dissector can judge them."""

import os
import select
import signal
import socket
import struct
import time

ETH_P_ALL = 3


class Capture:
    """Runs until ``stop``, which returns the number of frames."""

    def __init__(self, interface, path):
        packets = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL))
        packets.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
        packets.bind((interface, ETH_P_ALL))
        self._read, write = os.pipe()
        self._child = os.fork()
        if self._child == 0:
            _write(packets, path, write)
        packets.close()
        os.close(write)

    def stop(self):
        time.sleep(0.3)  # what is still in the socket's queue
        os.kill(self._child, signal.SIGTERM)
        count = struct.unpack("<Q", os.read(self._read, 8))[0]
        os.waitpid(self._child, 0)
        os.close(self._read)
        return count


def _write(packets, path, answer):
    stopped = []
    signal.signal(signal.SIGTERM, lambda *_: stopped.append(True))
    count = 0
    with open(path, "wb") as file:
        file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, 1))
        while True:
            if not select.select([packets], (), (), 0.05)[0]:
                if stopped:
                    break
                continue
            frame = packets.recv(65536)
            seconds, rest = divmod(time.time_ns(), 1_000_000_000)
            file.write(struct.pack("<IIII", seconds, rest // 1000, len(frame), len(frame)) + frame)
            count += 1
    os.write(answer, struct.pack("<Q", count))
    os._exit(0)

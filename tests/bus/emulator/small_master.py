"""A little EtherCAT master for the tests, written apart from the emulator: frames by struct, CoE by
the book.

It talks to an EmulatedBus in memory and owns its time, so that nothing here depends on a clock.
"""

import struct

APRD, APWR, FPRD, FPWR, BRD, BWR, LRD, LWR, LRW, ARMW, FRMW = 1, 2, 4, 5, 7, 8, 10, 11, 12, 13, 14
INIT, PREOP, SAFEOP, OP = 1, 2, 4, 8


class Abort(Exception):
    def __init__(self, code):
        super().__init__(f"0x{code:08X}")
        self.code = code


def ethernet(*datagrams):
    """Frame of (command, address32, data) datagrams."""
    body = b""
    for n, (command, address, data) in enumerate(datagrams):
        more = 0x8000 if n < len(datagrams) - 1 else 0
        body += struct.pack("<BBIHH", command, n, address, len(data) | more, 0) + data + b"\0\0"
    return (
        b"\xff" * 6
        + b"\x02\0\0\0\0\x01"
        + b"\x88\xa4"
        + struct.pack("<H", 0x1000 | len(body))
        + body
    ).ljust(60, b"\0")


class SmallMaster:
    def __init__(self, bus, step_ns=100_000):
        self.bus, self.step_ns = bus, step_ns
        self.now_ns = max(
            1_000_000_000, bus.agenda.now_ns
        )  # another master may have been here before
        self.late = []
        bus.transmit = self.late.append
        self.counter = 0

    def frame(self, *datagrams):
        """Sends; returns [(address, data, working counter)] or None where no frame came back."""
        self.now_ns += self.step_ns
        raw = bytearray(ethernet(*datagrams))
        size = len(raw)
        before = len(self.late)
        if not self.bus.receive(raw, self.now_ns):
            if len(self.late) != before + 1:
                return None
            raw = self.late.pop()  # a fault has handled it, and it came back at once
        assert len(raw) == size
        return self.parse(raw)

    @staticmethod
    def parse(raw):
        answers, at = [], 16
        while True:
            command, index, address, flags, _ = struct.unpack_from("<BBIHH", raw, at)
            length = flags & 0x7FF
            data = bytes(raw[at + 10 : at + 10 + length])
            answers.append((address, data, struct.unpack_from("<H", raw, at + 10 + length)[0]))
            at += 12 + length
            if not flags & 0x8000:
                return answers

    def one(self, command, address, data):
        answer = self.frame((command, address, data))
        return None if answer is None else answer[0][1:]

    def read(self, station, register, size):
        data, counter = self.one(FPRD, station | register << 16, bytes(size))
        return data if counter else None

    def number(self, station, register, size=2):
        return int.from_bytes(self.read(station, register, size), "little")

    def write(self, station, register, data):
        return self.one(FPWR, station | register << 16, data)[1]

    def wait(self, ms):
        self.now_ns += int(ms * 1e6)
        self.bus.advance_to(self.now_ns)

    def number_slaves(self):
        """Gives station addresses 0x1001 ...; returns them."""
        count = self.one(BRD, 0, bytes(2))[1]
        for n in range(count):
            self.one(APWR, (-n & 0xFFFF) | 0x0010 << 16, struct.pack("<H", 0x1001 + n))
        return [0x1001 + n for n in range(count)]

    def request(self, station, state, wait_ms=10):
        """Asks for a state; returns (AL status, AL status code) after the wait."""
        self.write(station, 0x0120, struct.pack("<H", state))
        self.wait(wait_ms)
        status, _, code = struct.unpack("<HHH", self.read(station, 0x0130, 6))
        return status, code

    def sync_manager(self, station, number, start, length, control, active=1):
        return self.write(
            station,
            0x0800 + 8 * number,
            struct.pack("<HHBBBB", start, length, control, 0, active, 0),
        )

    def fmmu(self, station, number, logical, length, first_bit, last_bit, physical, bit, kind):
        return self.write(
            station,
            0x0600 + 16 * number,
            struct.pack(
                "<IHBBHBBB3x", logical, length, first_bit, last_bit, physical, bit, kind, 1
            ),
        )

    def mailbox(self, station, size=128, out=0x1000, back=0x1080):
        self.sync_manager(station, 0, out, size, 0x26)
        self.sync_manager(station, 1, back, size, 0x22)
        self.sizes = getattr(self, "sizes", {})
        self.sizes[station] = (out, back, size)

    def talk(self, station, coe, polls=20, protocol=3):
        """One mailbox message out; the payload of the one that comes back (None: none)."""
        out, back, size = self.sizes[station]
        self.counter = self.counter % 7 + 1
        message = struct.pack("<HHBB", len(coe), 0, 0, protocol | self.counter << 4) + coe
        if self.write(station, out, message.ljust(size, b"\0")) != 1:
            return None
        return self.listen(station, polls)

    def listen(self, station, polls=20):
        _, back, size = self.sizes[station]
        for _ in range(polls):
            if self.read(station, 0x080D, 1)[0] & 8:
                raw = self.read(station, back, size)
                length, _, _, kind = struct.unpack_from("<HHBB", raw)
                self.kind = kind & 0x0F
                return raw[6 : 6 + length]
            self.wait(0.1)
        return None

    def _sdo(self, station, request, service=2):
        answer = self.talk(station, struct.pack("<H", service << 12) + request)
        assert answer is not None, "no answer"
        if answer[2] == 0x80:
            raise Abort(struct.unpack_from("<I", answer, 6)[0])
        return answer

    def upload(self, station, index, subindex):
        answer = self._sdo(station, struct.pack("<BHB4x", 0x40, index, subindex))
        command = answer[2]
        if command & 2:
            return answer[6 : 10 - (command >> 2 & 3)]
        size = struct.unpack_from("<I", answer, 6)[0]
        data, toggle = answer[10:], 0
        while len(data) < size:
            answer = self._sdo(station, bytes([0x60 | toggle << 4]) + bytes(7))
            assert answer[2] >> 4 & 1 == toggle
            part = answer[3:]
            data += part[: 7 - (answer[2] >> 1 & 7)] if len(part) == 7 else part
            toggle ^= 1
            if answer[2] & 1:
                break
        assert len(data) == size
        return data

    def download(self, station, index, subindex, data, force_normal=False):
        if len(data) <= 4 and not force_normal:
            self._sdo(
                station,
                struct.pack("<BHB", 0x23 | (4 - len(data)) << 2, index, subindex)
                + data.ljust(4, b"\0"),
            )
            return
        room = self.sizes[station][2] - 16
        self._sdo(station, struct.pack("<BHBI", 0x21, index, subindex, len(data)) + data[:room])
        rest, toggle = data[room:], 0
        while rest:
            part, rest = rest[: room + 7], rest[room + 7 :]
            unused = max(0, 7 - len(part))
            self._sdo(
                station, bytes([toggle << 4 | unused << 1 | (not rest)]) + part + bytes(unused)
            )
            toggle ^= 1

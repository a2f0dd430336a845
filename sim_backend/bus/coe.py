"""CANopen over EtherCAT, the server side: SDO upload and download (expedited, normal, segmented),
aborts, emergencies.

Sources: ETG.1000.6 (CoE services and their layouts).
"""

from collections.abc import Callable
from struct import pack, unpack_from

from sim_backend.bus.dictionary import (
    COMMAND_UNKNOWN,
    GENERAL_ERROR,
    NO_COMPLETE_ACCESS,
    TOGGLE,
    TOO_LONG,
    TOO_SHORT,
    Dictionary,
    SdoAbort,
)
from sim_backend.bus.sdo_info import serve_information

EMERGENCY, SDO_REQUEST, SDO_RESPONSE, SDO_INFORMATION = 1, 2, 3, 8
_DOWNLOAD_SEGMENT, _DOWNLOAD, _UPLOAD, _UPLOAD_SEGMENT, _ABORT = range(5)
_EXPEDITED, _SIZE_GIVEN, _COMPLETE = 0x02, 0x01, 0x10
_LARGEST = 4096


def _coe(service: int, payload: bytes) -> bytes:
    return pack("<H", service << 12) + payload


def emergency(code: int, register: int, data: bytes = b"") -> bytes:
    """An emergency message: error code (0x603F), error register (0x1001), five manufacturer
    bytes.
    """
    return _coe(EMERGENCY, pack("<HB", code, register) + data.ljust(5, b"\0")[:5])


class CoeServer:
    """Answers CoE messages out of a dictionary; one segmented transfer at a time. ``state`` gives
    the AL state.
    """

    def __init__(self, dictionary: Dictionary, state: Callable[[], int]):
        self._dictionary, self._state = dictionary, state
        self.refused: set[int] = set()  # objects that faults make unreachable
        self.forgotten: set[int] = set()  # objects whose new values faults throw away
        self.reset()

    def reset(self) -> None:
        self._object = (0, 0)
        self._upload: bytes | None = None
        self._download: bytearray | None = None
        self._expected, self._toggle = 0, 0

    def serve(self, message: bytes, room: int) -> list[bytes]:
        """Answers to one CoE message; ``room``: bytes that fit into one answer."""
        service = unpack_from("<H", message)[0] >> 12
        if service == SDO_INFORMATION:
            return [
                _coe(SDO_INFORMATION, part)
                for part in serve_information(self._dictionary, message[2:], room - 2)
            ]
        if service != SDO_REQUEST or len(message) < 3:
            return []
        try:
            return self._sdo(message[2:].ljust(8, b"\0"), room - 2)
        except SdoAbort as abort:
            self._upload = self._download = None
            return [_coe(SDO_REQUEST, pack("<BHBI", 0x80, *self._object, abort.code))]

    def _sdo(self, request: bytes, room: int) -> list[bytes]:
        command = request[0] >> 5
        if command in (_DOWNLOAD, _UPLOAD):
            self._object = unpack_from("<HB", request, 1)
            self._upload = self._download = None
            if self._object[0] in self.refused:
                raise SdoAbort(GENERAL_ERROR)
            if request[0] & _COMPLETE:
                raise SdoAbort(NO_COMPLETE_ACCESS)
        if command == _DOWNLOAD:
            return self._start_download(request)
        if command == _UPLOAD:
            return self._start_upload(room)
        if command == _DOWNLOAD_SEGMENT:
            return self._next_download(request)
        if command == _UPLOAD_SEGMENT:
            return self._next_upload(request, room)
        if command == _ABORT:
            self._upload = self._download = None
            return []
        raise SdoAbort(COMMAND_UNKNOWN)

    def _start_download(self, request: bytes) -> list[bytes]:
        index, subindex = self._object
        if request[0] & _EXPEDITED:
            size = (
                4 - (request[0] >> 2 & 3)
                if request[0] & _SIZE_GIVEN
                else self._size_of(index, subindex)
            )
            self._store(request[4 : 4 + size])
        else:
            size = unpack_from("<I", request, 4)[0]
            if size > _LARGEST:
                raise SdoAbort(TOO_LONG)
            data = request[8 : 8 + size]
            if len(data) < size:
                self._dictionary.item(index, subindex)
                self._download, self._expected, self._toggle = bytearray(data), size, 0
            else:
                self._store(data)
        return [_coe(SDO_RESPONSE, pack("<BHBI", 0x60, index, subindex, 0))]

    def _store(self, data: bytes) -> None:
        if self._object[0] not in self.forgotten:
            self._dictionary.download(*self._object, data, self._state())

    def _size_of(self, index: int, subindex: int) -> int:
        return min(4, len(self._dictionary.item(index, subindex).value))

    def _start_upload(self, room: int) -> list[bytes]:
        index, subindex = self._object
        data = self._dictionary.upload(index, subindex, self._state())
        if 1 <= len(data) <= 4:
            head = pack("<BHB", 0x43 | (4 - len(data)) << 2, index, subindex)
            return [_coe(SDO_RESPONSE, head + data.ljust(4, b"\0"))]
        first = data[: room - 8]
        if len(first) < len(data):
            self._upload, self._toggle = data[len(first) :], 0
        return [_coe(SDO_RESPONSE, pack("<BHBI", 0x41, index, subindex, len(data)) + first)]

    def _check_toggle(self, command: int) -> None:
        if command >> 4 & 1 != self._toggle:
            raise SdoAbort(TOGGLE)
        self._toggle ^= 1

    def _next_upload(self, request: bytes, room: int) -> list[bytes]:
        if self._upload is None:
            raise SdoAbort(COMMAND_UNKNOWN)
        toggle = request[0] & 0x10
        self._check_toggle(request[0])
        part, rest = self._upload[: room - 1], self._upload[room - 1 :]
        unused = max(0, 7 - len(part))
        self._upload = rest or None
        return [
            _coe(SDO_RESPONSE, bytes([toggle | unused << 1 | (not rest)]) + part + bytes(unused))
        ]

    def _next_download(self, request: bytes) -> list[bytes]:
        if self._download is None:
            raise SdoAbort(COMMAND_UNKNOWN)
        self._check_toggle(request[0])
        data = request[1:]
        if len(data) <= 7:
            data = data[: 7 - (request[0] >> 1 & 7)]
        self._download += (
            data[: max(0, self._expected - len(self._download))] if len(data) > 7 else data
        )
        if request[0] & 1:
            if len(self._download) != self._expected:
                raise SdoAbort(TOO_LONG if len(self._download) > self._expected else TOO_SHORT)
            self._store(bytes(self._download))
            self._download = None
        elif len(self._download) > self._expected:
            raise SdoAbort(TOO_LONG)
        return [_coe(SDO_RESPONSE, bytes([0x20 | request[0] & 0x10]) + bytes(7))]

"""SDO information: lists of objects, and descriptions of objects and entries.

Source: ETG.1000.6 (CoE SDO information service).
"""

from struct import pack, unpack_from

from sim_backend.bus.dictionary import (
    BITS,
    NO_OBJECT,
    NO_SUBINDEX,
    RX_PDO,
    TX_PDO,
    UNSUPPORTED_ACCESS,
    WRITE,
    Dictionary,
    OdObject,
    SdoAbort,
)

(
    LIST_REQUEST,
    LIST_RESPONSE,
    OBJECT_REQUEST,
    OBJECT_RESPONSE,
    ENTRY_REQUEST,
    ENTRY_RESPONSE,
    ERROR,
) = (1, 2, 3, 4, 5, 6, 7)
_INCOMPLETE = 0x80


def serve_information(dictionary: Dictionary, request: bytes, room: int) -> list[bytes]:
    """Answers to one request, in as many fragments as the room asks for. Empty where the request is
    no request.
    """
    if len(request) < 4:
        return []
    operation = request[0] & 0x7F
    try:
        if operation == LIST_REQUEST and len(request) >= 6:
            return _fragments(
                LIST_RESPONSE, _list(dictionary, unpack_from("<H", request, 4)[0]), room
            )
        if operation == OBJECT_REQUEST and len(request) >= 6:
            return _fragments(
                OBJECT_RESPONSE, _object(dictionary, unpack_from("<H", request, 4)[0]), room
            )
        if operation == ENTRY_REQUEST and len(request) >= 8:
            return _fragments(
                ENTRY_RESPONSE, _entry(dictionary, *unpack_from("<HBB", request, 4)), room
            )
        raise SdoAbort(UNSUPPORTED_ACCESS)
    except SdoAbort as abort:
        return [pack("<BBHI", ERROR, 0, 0, abort.code)]


def _fragments(operation: int, data: bytes, room: int) -> list[bytes]:
    size = max(2, (room - 4) & ~1)
    parts = [data[i : i + size] for i in range(0, len(data), size)]
    return [
        pack("<BBH", operation | (_INCOMPLETE if left else 0), 0, left) + part
        for left, part in zip(range(len(parts) - 1, -1, -1), parts, strict=False)
    ]


def _is_in(entry: OdObject, kind: int) -> bool:
    access = 0
    for item in entry.items.values():
        access |= item.access
    return {
        1: True,
        2: bool(access & RX_PDO),
        3: bool(access & TX_PDO),
        4: bool(access & WRITE),
        5: bool(access & WRITE),
    }[kind]


def _list(dictionary: Dictionary, kind: int) -> bytes:
    if kind > 5:
        raise SdoAbort(UNSUPPORTED_ACCESS)
    chosen = {
        k: [index for index in sorted(dictionary.objects) if _is_in(dictionary.objects[index], k)]
        for k in range(1, 6)
    }
    values = [len(chosen[k]) for k in range(1, 6)] if kind == 0 else chosen[kind]
    return pack(f"<H{len(values)}H", kind, *values)


def _object(dictionary: Dictionary, index: int) -> bytes:
    entry = dictionary.objects.get(index)
    if entry is None:
        raise SdoAbort(NO_OBJECT)
    data_type = entry.items[0].data_type if len(entry.items) == 1 else 0
    return pack("<HHBB", index, data_type, max(entry.items), entry.code) + entry.name.encode(
        "latin-1"
    )


def _entry(dictionary: Dictionary, index: int, subindex: int, value_info: int) -> bytes:
    if index not in dictionary.objects:
        raise SdoAbort(NO_OBJECT)
    item = dictionary.objects[index].items.get(subindex)
    if item is None:
        raise SdoAbort(NO_SUBINDEX)
    bits = BITS.get(item.data_type, 8 * len(item.get()))
    return pack(
        "<HBBHHH", index, subindex, 0, item.data_type, bits, item.access
    ) + item.name.encode("latin-1")

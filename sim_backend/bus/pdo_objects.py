"""The communication objects that every CoE slave carries: identity, PDO mapping and assignment,
synchronisation.

Sources: ETG.1000.6 (0x1000 to 0x1C3F), ETG.1020 (0x1C32/0x1C33), ETG.5001 (PDO numbers of modular
devices).
"""

from collections.abc import Callable

from sim_backend.bus import dictionary as od
from sim_backend.bus.sii import Pdo, SiiContent

_ASSIGNED_MAX = 8


def add_identity(dictionary: od.Dictionary, content: SiiContent, device_type: int) -> None:
    """0x1000, 0x1008 to 0x100A, 0x1018."""
    dictionary.variable(0x1000, od.number("Device type", od.UINT32, device_type))
    dictionary.variable(0x1008, od.text("Device name", content.name))
    dictionary.variable(0x1009, od.text("Hardware version", "00"))
    dictionary.variable(0x100A, od.text("Software version", f"{content.revision >> 16:02X}"))
    dictionary.record(
        0x1018,
        "Identity",
        {
            1: od.number("Vendor ID", od.UINT32, content.vendor),
            2: od.number("Product code", od.UINT32, content.product),
            3: od.number("Revision", od.UINT32, content.revision),
            4: od.number("Serial number", od.UINT32, content.serial),
        },
    )


def add_mapping(dictionary: od.Dictionary, pdo: Pdo) -> None:
    """A PDO mapping object that cannot be changed."""
    items = {
        n + 1: od.number(
            f"SubIndex {n + 1:03d}", od.UINT32, entry.index << 16 | entry.subindex << 8 | entry.bits
        )
        for n, entry in enumerate(pdo.entries)
    }
    dictionary.record(pdo.index, pdo.name, items)


def add_sync_objects(
    dictionary: od.Dictionary, outputs: tuple[int, ...], inputs: tuple[int, ...]
) -> None:
    """0x1C00 and the two synchronisation objects; empty assignments where a direction carries
    nothing.
    """
    uses = {1: 1, 2: 2, 3: 3, 4: 4}
    dictionary.record(
        0x1C00,
        "Sync manager type",
        {n: od.number(f"SubIndex {n:03d}", od.UINT8, use) for n, use in uses.items()},
        od.ARRAY,
    )
    for index, used in ((0x1C12, outputs), (0x1C13, inputs)):
        if not used:
            dictionary.record(
                index, "PDO assign", {0: od.number("SubIndex 000", od.UINT8, 0)}, od.ARRAY
            )
    for index, name in ((0x1C32, "SM output parameter"), (0x1C33, "SM input parameter")):
        dictionary.record(
            index,
            name,
            {
                1: od.number("Sync mode", od.UINT16, 1, od.READ | od.WRITE_PREOP),
                2: od.number("Cycle time", od.UINT32, 1_000_000, od.READ | od.WRITE_PREOP),
                3: od.number("Shift time", od.UINT32, 0),
                4: od.number("Sync modes supported", od.UINT16, 0x0007),
                5: od.number("Minimum cycle time", od.UINT32, 500_000),
                6: od.number("Calc and copy time", od.UINT32, 100_000),
            },
        )


def add_assignment(
    dictionary: od.Dictionary,
    index: int,
    default: list[int],
    allowed: Callable[[list[int]], int],
    changed: Callable[[], None],
) -> Callable[[], list[int]]:
    """A writable 0x1C12 or 0x1C13. ``allowed`` gives an abort code (0: fine) for a list of PDOs.
    Returns a function that gives the list of PDOs assigned now.
    """
    access = od.READ | od.WRITE_PREOP
    items: dict[int, od.Item] = {}

    def entry_check(data: bytes) -> None:
        if items[0].number:
            raise od.SdoAbort(od.COUNT_NOT_ZERO)
        if allowed([int.from_bytes(data, "little")]) == od.NO_OBJECT:
            raise od.SdoAbort(od.VALUE_RANGE)

    def count_check(data: bytes) -> None:
        if data[0] > _ASSIGNED_MAX:
            raise od.SdoAbort(od.VALUE_HIGH)
        code = allowed([items[n + 1].number for n in range(data[0])])
        if code:
            raise od.SdoAbort(code)

    items[0] = od.number(
        "SubIndex 000", od.UINT8, len(default), access, check=count_check, written=changed
    )
    for n in range(_ASSIGNED_MAX):
        items[n + 1] = od.number(
            f"SubIndex {n + 1:03d}",
            od.UINT16,
            default[n] if n < len(default) else 0,
            access,
            check=entry_check,
        )
    dictionary.record(index, "PDO assign", items, od.ARRAY)
    return lambda: [items[n + 1].number for n in range(items[0].number)]

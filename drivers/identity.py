"""What is on the wire against what the rig file says: every slave named that is missing, extra,
swapped or another.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from difflib import SequenceMatcher
from typing import NamedTuple

from epa_rt.config.devices import DEVICES
from epa_rt.config.rig import Slave

UNKNOWN = "an unknown device"


class Found(NamedTuple):
    """One slave as its SII describes it, in the order of the wire."""

    vendor: int
    product: int
    revision: int
    name: str = ""


def device_of(found: Found, expected: Sequence[Slave] = ()) -> str:
    """The device's name in our table, what a rig file describes itself, or what the slave says."""
    if known := _known(found.vendor, found.product):
        return known
    for slave in expected:
        described = slave.description
        identity = (described.vendor, *described.products)
        if described.is_generic and identity == (found.vendor, found.product):
            return _kind(slave)
    own = f" '{found.name}'" if found.name and found.name.isprintable() else ""
    return f"{UNKNOWN}{own} (vendor 0x{found.vendor:08X}, product 0x{found.product:08X})"


def _known(vendor: int, product: int) -> str | None:
    """The name in our table."""
    return next(
        (d.name for d in DEVICES.values() if d.vendor == vendor and product in d.products), None
    )


def _kind(slave: Slave) -> str:
    """What stands on the wire where a slave is as the rig file says."""
    described = slave.description
    if not described.is_generic:
        return slave.device
    product = described.products[0]
    return _known(described.vendor, product) or f"a generic terminal (product 0x{product:08X})"


def label(position: int, slave: Slave) -> str:
    """How every sentence names a slave: 'drive (slave 5, EPOS4)'; ``position`` counts from 1."""
    return f"{slave.name} (slave {position}, {slave.device})"


def differences(expected: Sequence[Slave], found: Sequence[Found]) -> list[str]:
    """One sentence per slave that is not as the rig file says; empty where all is as it should
    be.
    """
    if not found:
        return [f"found no slave at all, expected {len(expected)} from {label(1, expected[0])} on"]
    wanted = [_kind(slave) for slave in expected]
    present = [device_of(f, expected) for f in found]
    if wanted == present:
        return [
            text
            for i, (slave, f) in enumerate(zip(expected, found, strict=True), 1)
            for text in _of_kind(i, slave, f)
        ]
    if Counter(wanted) == Counter(present):
        return [
            f"found {device} as slave {i}, expected {label(i, slave)}: slaves are swapped"
            for i, (slave, device) in enumerate(zip(expected, present, strict=True), 1)
            if _kind(slave) != device
        ]
    sentences: list[str] = []
    for kind, i0, i1, j0, j1 in SequenceMatcher(
        None, wanted, present, autojunk=False
    ).get_opcodes():
        while kind == "insert" and j1 < len(present) and present[j0] == present[j1]:
            j0, j1 = j0 + 1, j1 + 1  # of several alike, the last is the one too many
        if kind != "equal":
            sentences += _of_part(expected, present, range(i0, i1), range(j0, j1))
    return sentences


def _of_part(
    expected: Sequence[Slave], present: Sequence[str], wanted: range, there: range
) -> Iterable[str]:
    """Slaves that do not match, pair by pair as long as there are pairs, then what is missing or
    too many.
    """
    for i, j in zip(wanted, there, strict=False):
        yield f"found {present[j]} as slave {j + 1}, expected {label(i + 1, expected[i])}"
    for i in wanted[len(there) :]:
        before = f" behind {expected[i - 1].name}" if i else ""
        yield (
            f"found no {_kind(expected[i])}{before}, expected {label(i + 1, expected[i])}: it is"
            " missing"
        )
    for j in there[len(wanted) :]:
        yield f"found {present[j]} as slave {j + 1}, expected none there: it is extra"


def _of_kind(position: int, slave: Slave, found: Found) -> Iterable[str]:
    """A slave of the right device whose product or revision the rig file does not allow."""
    low, high = slave.description.revisions
    if slave.product is not None and found.product != slave.product:
        yield (
            f"found product 0x{found.product:08X}, expected 0x{slave.product:08X} at"
            f" {label(position, slave)}"
        )
    if slave.revision is not None:
        if found.revision != slave.revision:
            yield (
                f"found revision 0x{found.revision:08X}, expected 0x{slave.revision:08X} at"
                f" {label(position, slave)}"
            )
    elif not low <= found.revision <= high:
        yield (
            f"found revision 0x{found.revision:08X}, expected 0x{low:08X} to 0x{high:08X} at"
            f" {label(position, slave)} (say 'revision: 0x{found.revision:08X}' in the rig file"
            " once it has been tried)"
        )

"""How the slaves are wired: who hangs on which port of whom, link bits, and when a frame passes
each port.

Terminals hang on the one before them, by the internal bus; a device with copper ports hangs on the
last such device's outgoing port. A coupler therefore has both. Ports are passed in the order 0, 3,
1, 2. Sources: ETG.1000.4 (DL status 0x0110), Beckhoff EK1100 documentation (X1 in, internal bus, X2
out).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from sim_backend.bus import registers as reg
from sim_backend.bus.slave import Slave

_ORDER = (3, 1, 2)
_THROUGH_NS, _EBUS_NS, _COPPER_NS = 160, 20, 320
_COUPLER_INTERNAL, _COUPLER_OUT, _OUT = 1, 2, 1


@dataclass
class Node:
    """A slave in the tree: its children by port, and when a frame passes each of its ports."""

    slave: Slave
    children: dict[int, "Node"] = field(default_factory=dict)
    delays_ns: dict[int, int] = field(default_factory=dict)


def tree_of(slaves: Sequence[Slave]) -> Node | None:
    """The tree of a row of slaves in frame order; None for an empty row."""
    root: Node | None = None
    last_copper: Node | None = None
    last: Node | None = None
    for slave in slaves:
        node = Node(slave)
        if root is None:
            root = node
        elif slave.controller.is_copper and last_copper is not None:
            last_copper.children[
                _COUPLER_OUT if last_copper.slave.content.name == "EK1100" else _OUT
            ] = node
        else:
            last.children[_COUPLER_INTERNAL] = node
        last = node
        if slave.controller.is_copper:
            last_copper = node
    return root


def wire(slaves: Sequence[Slave]) -> list[Slave]:
    """The slaves that frames reach, in order: what hangs behind an absent one is cut off, unless it
    is bypassed.

    Writes DL status and port delays of each of them.
    """
    root = tree_of([slave for slave in slaves if not slave.is_bypassed])
    reached: set[int] = set()
    if root is not None and root.slave.is_present:
        _cut(root)
        _pass(root, 0, reached)
    return [slave for slave in slaves if id(slave) in reached]


def _cut(node: Node) -> None:
    node.children = {port: child for port, child in node.children.items() if child.slave.is_present}
    for child in node.children.values():
        _cut(child)


def _pass(node: Node, entered_ns: int, reached: set[int]) -> int:
    """Sends a frame through a node; returns when it leaves its port 0 again."""
    reached.add(id(node.slave))
    node.delays_ns[0] = entered_ns
    now_ns = entered_ns + _THROUGH_NS
    for port in _ORDER:
        child = node.children.get(port)
        if child is not None:
            cable_ns = _COPPER_NS if child.slave.controller.is_copper else _EBUS_NS
            now_ns = _pass(child, now_ns + cable_ns, reached) + cable_ns
            node.delays_ns[port] = now_ns
    slave = node.slave
    status = 0x0001
    for port in range(4):
        linked = port == 0 or port in node.children
        status |= (0x10 << port if linked else 0) | (0x200 if linked else 0x100) << 2 * port
    slave.esc.put(reg.DL_STATUS, 2, status)
    if slave.clock is not None:
        slave.clock.port_delays_ns = tuple(node.delays_ns.get(port) for port in range(4))
    return now_ns

"""Which network interface the bus hangs on, and whether we may and can use it. Everything asked of
this network namespace.
"""

import ctypes
import fcntl
import socket
import struct
from pathlib import Path
from typing import NamedTuple

from epa_rt.backend import BackendError

_SIOCGIFFLAGS, _SIOCGIFHWADDR, _SIOCGIWNAME = (
    0x8913,
    0x8927,
    0x8B01,
)  # linux/sockios.h, linux/wireless.h
_UP, _LOOPBACK, _RUNNING = 0x1, 0x8, 0x40  # IFF_*, linux/if.h
_ETHERNET = 1  # ARPHRD_ETHER, linux/if_arp.h
_SIOCETHTOOL, _ETHTOOL_GDRVINFO, _DRVINFO_BYTES = 0x8946, 3, 196  # linux/ethtool.h
_NET = Path("/sys/class/net")

RIGHTS_COMMAND = (
    'sudo setcap cap_net_raw,cap_net_admin,cap_sys_nice,cap_ipc_lock+ep "$(readlink -f "$(command'
    ' -v python3)")"'
)


class Interface(NamedTuple):
    """A network interface: Ethernet or not, wireless or not, switched on, with a link."""

    name: str
    is_ethernet: bool
    is_wireless: bool
    is_up: bool
    has_link: bool
    has_default_route: bool

    @property
    def is_candidate(self) -> bool:
        """A wired interface that is not this machine's way to the network."""
        return self.is_ethernet and not self.is_wireless and not self.has_default_route

    @property
    def state(self) -> str:
        return "link" if self.has_link else "no link" if self.is_up else "down"


def interfaces() -> list[Interface]:
    """Every interface of this network namespace but the loopback."""
    routed = _routed()
    found = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        for _number, name in socket.if_nameindex():
            flags = _ask(asking, _SIOCGIFFLAGS, name)
            kind = _ask(asking, _SIOCGIFHWADDR, name)
            if flags is None or flags & _LOOPBACK:
                continue
            wireless = _ask(asking, _SIOCGIWNAME, name) is not None
            found.append(
                Interface(
                    name,
                    kind == _ETHERNET,
                    wireless,
                    bool(flags & _UP),
                    bool(flags & _RUNNING),
                    name in routed,
                )
            )
    return found


def candidates(present: list[Interface]) -> list[Interface]:
    """Those that could carry the bus; one that is switched on goes before those that are not."""
    wired = [i for i in present if i.is_candidate]
    return [i for i in wired if i.is_up] or wired


def choose(wanted: str | None, lock_step: bool = False, net: Path = _NET) -> str:
    """The interface of this name, or the only candidate. Raises BackendError: one sentence with
    what there is, or that ``lock_step`` is not for a real wire.
    """
    present = interfaces()
    shown = ", ".join(f"{i.name} ({i.state})" for i in present) or "none"
    if wanted is not None:
        chosen = next((i for i in present if i.name == wanted), None)
        if chosen is None:
            raise BackendError(f"found no network interface '{wanted}', expected one of: {shown}")
    else:
        possible = candidates(present)
        if len(possible) != 1:
            raise BackendError(
                f"found {len(possible)} network interfaces that could carry the bus, expected one, "
                f"or --interface to say which (there are: {shown})"
            )
        chosen = possible[0]
    if lock_step and reaches_a_card(chosen.name, net):
        raise BackendError(
            f"found lock step on {chosen.name}, which leads to a real wire, expected an emulated"
            " bus: cycles would follow each other as fast as the slaves answer, and not by the"
            " rig's period"
        )
    if not chosen.is_up:
        raise BackendError(
            f"found the network interface {chosen.name} switched off, expected it up: sudo ip link"
            f" set {chosen.name} up"
        )
    if not chosen.has_link:
        raise BackendError(
            f"found no link on the network interface {chosen.name}, "
            "expected the bus coupler powered and its cable plugged in"
        )
    check_rights()
    return chosen.name


def reaches_a_card(name: str, net: Path = _NET) -> bool:
    """Whether there is hardware behind this interface or below it (bridge, bond, VLAN); a veth has
    none. As sysfs shows it, which in a network namespace that was made without a mount of its own
    knows only those outside.
    """
    return (net / name / "device").exists() or any(
        reaches_a_card(lower.name.removeprefix("lower_"), net)
        for lower in (net / name).glob("lower_*")
    )


def is_emulated_bus(wanted: str | None) -> bool:
    """Whether this interface, or the only candidate, is an end of a pair of virtual ones, which has
    emulated slaves behind it; False where there is none to ask.
    """
    possible = candidates(interfaces())
    name = wanted or (possible[0].name if len(possible) == 1 else "")
    return _driver(name) == "veth"


def _driver(name: str) -> str:
    """What drives an interface, as the kernel says in any network namespace; '' where it does
    not.
    """
    answer = bytearray(_DRVINFO_BYTES)
    struct.pack_into("I", answer, 0, _ETHTOOL_GDRVINFO)
    held = (ctypes.c_char * len(answer)).from_buffer(answer)
    request = struct.pack("16sP16x", name.encode(), ctypes.addressof(held))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        try:
            fcntl.ioctl(asking, _SIOCETHTOOL, request)
        except OSError:
            return ""
    return answer[4:36].split(b"\0", 1)[0].decode("ascii", "replace")


def check_rights() -> None:
    """Raises BackendError where this user may not open a raw socket, with the command that changes
    it.
    """
    try:
        socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0).close()
    except PermissionError:
        raise BackendError(
            "this user may not open a raw socket, which the bus needs; "
            f"either run as root, or once: {RIGHTS_COMMAND}"
        ) from None


def _ask(asking: socket.socket, request: int, name: str) -> int | None:
    """The first 16 bits of an interface's answer; None where the request does not apply to it."""
    try:
        answer = fcntl.ioctl(asking, request, struct.pack("16s24x", name.encode()))
    except OSError:
        return None
    number: int = struct.unpack_from("<H", answer, 16)[0]
    return number


def _routed() -> set[str]:
    """Interfaces with a default route."""
    try:
        with open("/proc/net/route", encoding="ascii") as table:
            rows = [line.split() for line in table.readlines()[1:]]
    except OSError:
        return set()
    return {
        row[0] for row in rows if len(row) > 7 and row[1] == "00000000" and row[7] == "00000000"
    }

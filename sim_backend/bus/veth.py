"""Network interfaces without tools: a pair of virtual Ethernet ends, switched on, without IPv6 and
ARP.

Source: rtnetlink(7), veth(4), netdevice(7).
"""

import fcntl
import os
import socket
from pathlib import Path
from struct import pack, unpack_from

_NEWLINK, _DELLINK = 16, 17
_REQUEST, _ACK, _CREATE, _EXCLUSIVE = 0x1, 0x4, 0x400, 0x200
_IFLA_IFNAME, _IFLA_LINKINFO, _INFO_KIND, _INFO_DATA, _VETH_PEER = 3, 18, 1, 2, 1
_GET_FLAGS, _SET_FLAGS = 0x8913, 0x8914
_UP, _NOARP = 0x1, 0x80
_ERROR = 2


def _attribute(kind: int, data: bytes) -> bytes:
    return pack("<HH", 4 + len(data), kind) + data + bytes(-len(data) % 4)


def _ask(kind: int, flags: int, body: bytes) -> None:
    """One rtnetlink request. Raises OSError with the kernel's answer."""
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 0) as kernel:
        kernel.bind((0, 0))
        kernel.send(pack("<IHHII", 16 + len(body), kind, flags | _REQUEST | _ACK, 1, 0) + body)
        answer = kernel.recv(65536)
    if unpack_from("<H", answer, 4)[0] == _ERROR:
        number = -unpack_from("<i", answer, 16)[0]
        if number:
            raise OSError(number, os.strerror(number))


def make_pair(one: str, other: str) -> None:
    """Makes two connected interfaces and brings both up. Raises OSError where that is not
    permitted.
    """
    peer = bytes(16) + _attribute(_IFLA_IFNAME, other.encode() + b"\0")
    info = _attribute(_INFO_KIND, b"veth") + _attribute(_INFO_DATA, _attribute(_VETH_PEER, peer))
    body = (
        bytes(16)
        + _attribute(_IFLA_IFNAME, one.encode() + b"\0")
        + _attribute(_IFLA_LINKINFO, info)
    )
    _ask(_NEWLINK, _CREATE | _EXCLUSIVE, body)
    for name in (one, other):
        quiet(name)


def remove(name: str) -> None:
    """Removes an interface (and, for a veth, its other end)."""
    _ask(_DELLINK, 0, pack("<BxHiII", 0, 0, socket.if_nametoindex(name), 0, 0))


def quiet(name: str) -> None:
    """Brings an interface up without IPv6 and ARP, so that only EtherCAT is on it."""
    disable = Path(f"/proc/sys/net/ipv6/conf/{name}/disable_ipv6")
    if disable.exists():
        disable.write_text("1")
    request = name.encode().ljust(16, b"\0")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        flags = unpack_from("<H", fcntl.ioctl(any_socket, _GET_FLAGS, request + bytes(16)), 16)[0]
        fcntl.ioctl(any_socket, _SET_FLAGS, request + pack("<H14x", flags | _UP | _NOARP))

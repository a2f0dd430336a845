"""One master per network interface of this machine: held by a name that the kernel gives back when
its process is gone.

The name is an abstract socket address, which belongs to the network namespace as the interface
does, needs no folder that another user may write to, and tells who holds it (unix(7)).
"""

import errno
import os
import socket
import struct

from epa_rt.backend import BackendError

_WAITING = 1024  # refused askers that the holder never answers stay in its queue


class Claim:
    """Taken before the first frame; ``release`` gives it back and may be called twice."""

    def __init__(self, interface: str):
        """Raises BackendError naming the process that drives the bus on this interface."""
        name = f"\0epa_rt.ethercat.{socket.if_nametoindex(interface)}"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._socket.bind(name)
            self._socket.listen(_WAITING)
        except OSError as error:
            self._socket.close()
            if error.errno != errno.EADDRINUSE:
                raise
            raise BackendError(
                f"found the bus on {interface} in the hands of {_holder(name)}, expected it free:"
                " end that first (a run brakes and vents at its Ctrl-C)"
            ) from None

    def release(self) -> None:
        self._socket.close()


def _holder(name: str) -> str:
    """'process 4711 (epa)', as far as this user may know."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as asking:
        asking.setblocking(False)
        try:
            asking.connect(name)
            told = asking.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12)
        except OSError:
            return "another process"
    pid: int = struct.unpack("iII", told)[0]
    if pid <= 0:
        return "a process outside of this container"
    if pid == os.getpid():
        return f"this process itself ({pid})"
    try:
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            words = file.read(200).replace(b"\0", b" ").decode("utf-8", "replace").strip()
    except OSError:
        return f"process {pid}"
    return f"process {pid} ({words})" if words.isprintable() and words else f"process {pid}"

"""A port kept for a server that will listen later."""

from __future__ import annotations

import socket


class ReservedPort:
    """A port bound and not listened on: nobody else gets it by accident, clients are refused.

    Linux lets another socket of SO_REUSEADDR listen on it, as Foxglove's server does. Raises
    OSError where the port cannot be had.
    """

    def __init__(self, host: str, port: int) -> None:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM
        )[0]
        self._socket = socket.socket(family, kind, protocol)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind(address)
        except BaseException:
            self._socket.close()
            raise
        self.port: int = self._socket.getsockname()[1]

    def close(self) -> None:
        self._socket.close()

    def __enter__(self) -> ReservedPort:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

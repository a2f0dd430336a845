"""Asking a slave again where an answer got lost on the way."""

from collections.abc import Callable

import pysoem

_TRIES = 3


def insist(ask: Callable[..., bytes], *arguments: object) -> bytes:
    """A refusal is an answer. Every write here may come twice. Raises what pysoem does where the
    last answer stays away too.
    """
    for _ in range(_TRIES - 1):
        try:
            return ask(*arguments)
        except (pysoem.WkcError, pysoem.PacketError):
            pass
    return ask(*arguments)

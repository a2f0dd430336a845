"""The boundary: raw process image out, raw process image in. A backend also owns time."""

from typing import Any, NamedTuple, Protocol

Event = tuple[str, str, dict[str, Any]]  # kind, text, data


class Exchange(NamedTuple):
    """One bus cycle, its health beside its data.

    ``t_ns``: the cycle edge on the backend's clock. ``lateness_ns``: how long after the edge the
    exchange began. ``busy_ns``: how long everything above the backend took in the cycle before (0
    where nobody measures it). ``read_ns``: when the inputs were true, on the same clock; a rig
    moves on while the loop is late, a simulated one moves by cycles alone.
    """

    cycle: int
    t_ns: int
    inputs_raw: bytes
    working_counter_ok: bool
    lateness_ns: int
    busy_ns: int
    read_ns: int


class BackendError(Exception):
    """A backend that cannot be opened or went away; one sentence for the operator."""


class Backend(Protocol):
    """Hardware, simulation, emulated bus or a recorded log.

    ``exchange`` waits for the next cycle edge, hands over the outputs and returns the inputs of
    that edge. ``close`` puts the outputs into their safe state first; it may be called twice, and
    before ``open``.

    ``events``: what happened on a bus, for the log; the loop drains it. ``drive_off``: what the
    drive said of itself while it was closed; None where nobody heard it.
    """

    period_s: float

    @property
    def events(self) -> list[Event]: ...

    @property
    def drive_off(self) -> bool | None: ...

    def open(self) -> None: ...

    def exchange(self, outputs_raw: bytes) -> Exchange: ...

    def close(self) -> None: ...

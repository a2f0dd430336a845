"""What the supervisor runs: an experiment's phases, a homing, or an operator's keys."""

from collections.abc import Mapping
from typing import Any, Protocol

Event = tuple[str, str, dict[str, Any]]


class Plan(Protocol):
    """``begin`` once, then ``step`` in every cycle. ``events`` grows by (kind, text, data).

    ``loop_changed``: the controller must be reset in this cycle. ``failure``: a sentence that ends
    the run. ``reference_names``: the keys that ``step`` writes.
    """

    events: list[Event]
    reference_names: tuple[str, ...]
    phase_index: int
    loop: str
    loop_changed: bool
    finished: bool
    failure: str | None

    def begin(self, measured: Mapping[str, float]) -> None: ...

    def step(
        self, measured: Mapping[str, float], reference: dict[str, float], cycle: int
    ) -> None: ...

    def brake(self, cycle: int = -1) -> None: ...

"""One log as the diagnosis reads it: columns in SI on the bus's own grid, and what was going on."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Span:
    """A stretch of a recording, ``start`` included, ``stop`` not, in samples. ``trial`` where it is
    one to be judged.
    """

    name: str
    start: int
    stop: int
    trial: bool


@dataclass(frozen=True)
class Recording:
    """``columns``: (N,) each, by signal name: measured values (NaN where invalid) and ``cmd_*`` as
    they were *sent*.

    Row k holds what came in at bus edge k and the command that was computed from it. ``cycle`` (N,)
    counts bus cycles since the start, with holes where cycles were lost. ``found`` lists in
    sentences what is wrong with the log (hygiene.py); nothing is repaired silently. ``t_ns`` (N,)
    is the clock's stamp of each row, None where there is none. ``twin_of``: the recording whose
    motion this one has, read again.
    """

    name: str
    path: str
    rig: str
    plant: str
    experiment: str
    period_s: float
    cycle: np.ndarray
    columns: dict[str, np.ndarray]
    spans: tuple[Span, ...]
    attachments: dict[str, bytes] = field(default_factory=dict)
    found: tuple[str, ...] = ()
    t_ns: np.ndarray | None = None
    twin_of: "Recording | None" = None

    @property
    def samples(self) -> int:
        return len(self.cycle)

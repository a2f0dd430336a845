"""What the loop asks of a controller and of whatever enables the drive."""

from collections.abc import Mapping
from typing import Protocol

Signals = Mapping[str, float]


class Controller(Protocol):
    """One control law: present values and references in, commands out.

    `reads` and `writes` are signal names, so that the wiring is checked before anything is opened.
    `saturated` and `slewed` count the steps in which it cut its own command at a limit, or held it
    to a slew limit: the gate behind it sees none of these.
    """

    @property
    def reads(self) -> tuple[str, ...]: ...

    @property
    def writes(self) -> tuple[str, ...]: ...

    @property
    def saturated(self) -> int: ...

    @property
    def slewed(self) -> int: ...

    def reset(self, measured: Signals, commanded: Signals | None = None) -> None:
        """Start from where the rig is; `commanded` holds what was last sent, where it is known."""
        ...

    def step(self, measured: Signals, reference: Signals, dt_s: float) -> dict[str, float]:
        """Commands of this cycle, SI. The same dict is returned and overwritten every cycle."""
        ...

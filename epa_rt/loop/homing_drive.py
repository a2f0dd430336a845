"""The bus drive in a run that sets its zero: its own homing mode, started by control word bit 4."""

from collections.abc import Callable

from epa_rt.config.rig import Cia402Drive
from epa_rt.loop.drives import BusDrive
from epa_rt.safety.commands import HOMING_MODE, START_HOMING


class HomingDrive(BusDrive):
    """Enabled in mode 6 from the start, so that no mode changes under power. ``go``: start now."""

    def __init__(self, file: Cia402Drive, period_s: float, go: Callable[[], bool]):
        super().__init__(file, period_s, HOMING_MODE)
        self._go = go

    def step(self, measured: dict[str, float], command: dict[str, float]) -> None:
        super().step(measured, command)
        if self.live and self._go():
            command[self._control] = START_HOMING

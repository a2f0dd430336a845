"""The bus drive in a run that sets its zero: its own homing mode, started by control word bit 4."""

from collections.abc import Callable

from epa_rt.config.rig import Cia402Drive
from epa_rt.loop.drives import BusDrive
from epa_rt.safety.commands import HOMING_MODE, START_HOMING


class HomingDrive(BusDrive):
    """Enabled in mode 6 from the start, so that no mode changes under power. ``go``: start now.
    ``interrupted``: brake on the quick-stop ramp and hold; what homing moves ends with it.
    """

    def __init__(
        self,
        file: Cia402Drive,
        period_s: float,
        go: Callable[[], bool],
        interrupted: Callable[[], bool] = lambda: False,
    ):
        super().__init__(file, period_s, HOMING_MODE)
        self._go, self._interrupted = go, interrupted

    def step(self, measured: dict[str, float], command: dict[str, float]) -> None:
        if self.live and self._interrupted():
            self.quick_stop()
        super().step(measured, command)
        if super().live and self._go():
            command[self._control] = START_HOMING

    @property
    def live(self) -> bool:
        """A drive that was interrupted holds: it is not lost."""
        return super().live or (self._interrupted() and self.holds)

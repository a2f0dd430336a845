"""Whether a motor must be let down before its power goes, and how far that has come.

After a trip the envelope moves it; at a run's own end the supervisor does, by commands that pass
the envelope as any other.
"""

from collections.abc import Callable, Mapping

from epa_rt.config.rig import Cia402Drive, Rig
from epa_rt.loop.rest import RestWatch
from epa_rt.safety.let_down import LetDown
from epa_rt.safety.stopping import NO_ZERO, Stopping

SETTLE_MAX_S = 1.0  # longest wait at the rest place for a motor to stand


class LettingDown:
    """``wanted`` once, when all is vented or has had its time; then ``step`` every cycle.

    ``text``: what came of it, for the end of the run. ``trouble``: a sentence once it failed; in a
    trip the envelope says it. ``has_zero``: whether travel has one; after a trip the envelope
    knows.
    """

    def __init__(self, rig: Rig, rest: RestWatch, has_zero: Callable[[], bool]):
        self.text = self.trouble = self._why = ""
        self._rig, self._rest, self._has_zero = rig, rest, has_zero
        self._down = LetDown(rig)
        drive = rig.drive
        self._mode = drive.mode if isinstance(drive, Cia402Drive) else ""
        self._word = drive.control_word if isinstance(drive, Cia402Drive) else ""
        self._targets = (rig.motor.position_target, rig.motor.speed_target)
        self._stopping: Stopping | None = None
        self._settle_cycles, self._waited = round(SETTLE_MAX_S / rig.period_s), 0

    def wanted(
        self, measured: Mapping[str, float], command: Mapping[str, float], stopping: Stopping | None
    ) -> bool:
        """Whether something pulls and the motor can be moved to where nothing does.

        ``command``: under which it holds now. ``stopping``: the envelope's, after a trip.
        """
        self._stopping, self._waited = stopping, 0
        self.text = self.trouble = ""
        if not self._rest.pulls:
            return False
        why = self._refusal(measured, command, stopping)
        if why:
            self.text = f"not let down, though {self._rest.pull} ({why})"
            return False
        if stopping is None:
            self._down.begin(measured, self._mode_of(command))
        else:
            stopping.ask_to_let_down()
        self._why = f"under power to {self._place}, as {self._rest.pull}"
        self.text = f"on its way {self._why}"
        return True

    @property
    def _place(self) -> str:
        return self._rig.motor.rest_place_name or ""

    def _mode_of(self, command: Mapping[str, float]) -> float:
        """The drive's mode; a wired drive takes a speed."""
        return command[self._mode] if self._mode else 9.0

    def _refusal(
        self, measured: Mapping[str, float], command: Mapping[str, float], stopping: Stopping | None
    ) -> str:
        if stopping is not None:
            why = stopping.refuses_to_let_down()
        elif not self._has_zero():
            why = NO_ZERO
        elif self._word and command[self._word] != 0x0F:
            why = "the drive holds by its own quick stop, after a torque"
        else:
            why = self._down.refusal(self._mode_of(command))
        if not why and self._down.is_there(measured):
            why = f"it is at {self._place} already"
        return why

    def step(self, measured: Mapping[str, float], command: dict[str, float], bus_ok: bool) -> bool:
        """One cycle; True once the motor is there and stands. ``command`` takes the targets where
        no trip was.
        """
        down = self._down if self._stopping is None else self._stopping.let_down
        if self._stopping is None:
            if bus_ok:
                self.trouble = down.step(measured)
            command.update(down.targets)
        if not down.arrived:
            return False
        self._waited += 1
        return self._rest.motor_stands or self._waited > self._settle_cycles

    def close(self) -> None:
        """It is down; says what still pulls there."""
        self.text = f"let down {self._why}"
        if self._rest.pulls:
            self.text += f"; there {self._rest.pull}"

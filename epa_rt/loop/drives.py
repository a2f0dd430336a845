"""The two ways a rig enables its drive, behind one face for the supervisor."""

from typing import Protocol

from epa_rt.config.rig import AnalogDrive as AnalogDriveFile
from epa_rt.config.rig import Cia402Drive, Rig
from epa_rt.control.analog_drive import OutputEnabler
from epa_rt.control.cia402 import OFF, DriveEnabler
from epa_rt.control.drive_errors import drive_error_words

MODE_OF_TARGET = {"position": 8, "speed": 9, "torque": 10}


class Drive(Protocol):
    """``step`` writes the enabling rows of the command; ``trouble`` is a sentence once it failed or
    was lost.

    ``quick_stop``: from now on the drive brakes and holds by itself, where it can. ``holds``: it
    has power, and follows targets or holds so. ``off``: by its own word, or that of the output that
    enables it.
    """

    def enable(self) -> None: ...

    def disable(self, controlled: bool) -> None: ...

    def quick_stop(self) -> None: ...

    def step(self, measured: dict[str, float], command: dict[str, float]) -> None: ...

    @property
    def live(self) -> bool: ...

    @property
    def holds(self) -> bool: ...

    @property
    def off(self) -> bool: ...

    def trouble(self, measured: dict[str, float]) -> str: ...


class BusDrive:
    """A drive enabled by control and status word, in a mode that it says itself: targets of another
    one would mean something else to it.
    """

    def __init__(self, file: Cia402Drive, period_s: float, mode: int):
        self._enabler = DriveEnabler(max(1, round(file.transition_timeout / period_s)))
        self._file, self._mode = file, mode
        self._reported = float(mode)  # what it says
        self._unlike = self._patience = 0  # cycles of another mode while enabled; how many may be
        self._status, self._control = file.status_word, file.control_word
        self._mode_row, self._mode_display = file.mode, file.mode_display

    def enable(self) -> None:
        self._patience = self._enabler.timeout_cycles
        self._enabler.enable()

    def disable(self, controlled: bool) -> None:
        self._enabler.disable(controlled)

    def quick_stop(self) -> None:
        self._enabler.quick_stop()

    def step(self, measured: dict[str, float], command: dict[str, float]) -> None:
        enabler, mode = self._enabler, self._mode
        # a row of a word holds an int
        command[self._control] = enabler.step(measured[self._status])  # type: ignore[arg-type]
        command[self._mode_row] = mode
        self._reported = reported = measured[self._mode_display]
        if not enabler.enabled:
            self._unlike = 0
        elif reported == mode:
            self._unlike = self._patience = 0
        else:
            self._unlike += 1

    @property
    def live(self) -> bool:
        return self._enabler.enabled and not self._unlike

    @property
    def holds(self) -> bool:
        return self._enabler.holds and not self._unlike

    @property
    def off(self) -> bool:
        return not self._enabler.enabled and self._enabler.state in OFF

    def trouble(self, measured: dict[str, float]) -> str:
        cause = self._enabler.cause or self._other_mode()
        code = int(measured[self._file.error_code]) if self._file.error_code else 0
        return f"{cause} (error {drive_error_words(code)})" if cause and code else cause

    def _other_mode(self) -> str:
        """A drive that is being enabled has time to change its mode; one that has had it has
        none.
        """
        return (
            f"it reports mode {self._reported:g} (0x6061), asked for {self._mode}"
            if self._unlike > self._patience
            else ""
        )


class WiredDrive:
    """A drive enabled by a digital output, that says nothing of its state over the bus."""

    def __init__(self, file: AnalogDriveFile, period_s: float):
        self._drive = OutputEnabler(round(file.enable_delay / period_s))
        self._enable = file.enable
        self._off = True

    def enable(self) -> None:
        self._drive.enable()

    def disable(self, controlled: bool) -> None:
        self._drive.disable(controlled)

    def quick_stop(self) -> None:
        """A speed command of zero is all that such a drive can be told."""

    def step(self, measured: dict[str, float], command: dict[str, float]) -> None:
        output = self._drive.step()
        self._off = not output
        command[self._enable] = float(output)

    @property
    def live(self) -> bool:
        return self._drive.targets_live

    @property
    def holds(self) -> bool:
        return self._drive.targets_live

    @property
    def off(self) -> bool:
        return self._off

    def trouble(self, measured: dict[str, float]) -> str:
        return self._drive.cause


def drive_of(rig: Rig, target: str) -> Drive:
    """The drive of a rig, in the mode for a target kind ('position', 'speed', 'torque')."""
    if rig.drive.interface == "cia402":
        return BusDrive(rig.drive, rig.period_s, MODE_OF_TARGET[target])
    return WiredDrive(rig.drive, rig.period_s)

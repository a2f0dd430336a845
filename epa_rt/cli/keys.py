"""The operator's keys and the line of figures of epa jog, read and written without ever waiting."""

import sys
import termios
import tty
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress

from epa_rt.cli.typed import Typed
from epa_rt.config.rig import Rig
from epa_rt.experiments.jogging import Jogging, Keys
from epa_rt.loop.requests import OperatorRequests
from epa_rt.realtime.screen import DroppingStream

SHOW_S = 0.2
WIDTH = 79
_NAMES = {
    b"\x1b[D": "left",
    b"\x1b[C": "right",
    b"\x1b[A": "up",
    b"\x1b[B": "down",
    b"\x1bOD": "left",
    b"\x1bOC": "right",
    b"\x1bOA": "up",
    b"\x1bOB": "down",
}


def keys_in(data: bytes) -> list[str]:
    """The keys of what a terminal sent: arrows by name, letters as they are."""
    found, at = [], 0
    while at < len(data):
        name = _NAMES.get(data[at : at + 3])
        if name is not None:
            found.append(name)
            at += 3
        elif data[at] == 0x1B:
            if at + 1 == len(data):
                found.append("escape")
            at += 1 if at + 1 == len(data) else 3
        else:
            found.append(chr(data[at]).lower())
            at += 1
    return found


class ShownRequests(OperatorRequests):
    """Requests of a jog by orders that also shows a line, in the loop's own ``poll``.

    ``selected``: the number of the muscle that is marked in it; none below zero.
    """

    selected = -1

    def __init__(self, rig: Rig, jog: Jogging, measured: Mapping[str, float]):
        super().__init__(rig.period_s)
        self._jog, self._measured = jog, measured
        self._show_every = max(1, round(SHOW_S / rig.period_s))
        self._line, self._out = FigureLine(rig), DroppingStream.of(sys.stderr)

    def poll(self, cycle: int) -> int:
        if cycle % self._show_every == 0:
            self._out.write("\r" + self._line.text(self._measured, self._jog, self.selected))
        return super().poll(cycle)


class KeyRequests(ShownRequests):
    """The same with keys that are read."""

    def __init__(self, rig: Rig, keys: Keys, jog: Jogging, measured: Mapping[str, float]):
        super().__init__(rig, jog, measured)
        self._keys = keys
        self._typed = Typed(rig.period_s, self.ask)

    def poll(self, cycle: int) -> int:
        for key in keys_in(self._typed.read(cycle)):
            self._keys.press(key, cycle)
        self.selected = self._keys.selected
        return super().poll(cycle)


class FigureLine:
    """Travel, speed, force and pressures with their units on one line of 80 columns."""

    def __init__(self, rig: Rig):
        motor = rig.motor
        self._travel, self._speed = motor.position, motor.speed
        self._forces = [row.name for row in rig.inputs if row.si_unit == "N"]
        self._pressures = [(muscle.name, muscle.pressure) for muscle in rig.muscles]
        self._atmosphere_pa = rig.atmosphere_pa
        self._factor, self._unit = (
            (1e3, "mm") if rig.row(motor.position).si_unit == "m" else (57.29578, "deg")
        )

    def text(self, measured: Mapping[str, float], jog: Jogging, selected: int) -> str:
        """The line, as long as the screen is wide, without an end."""
        factor, unit = self._factor, self._unit
        parts = [f"{factor * measured[self._travel]:8.3f} {unit}"]
        if self._speed is not None:
            parts.append(f"{factor * measured[self._speed]:6.2f} {unit}/s")
        parts += [f"{measured[name]:6.1f} N" for name in self._forces]
        pressures = []
        for i, (name, signal) in enumerate(self._pressures):
            mark = "*" if i == selected and len(self._pressures) > 1 else ""
            gauge_kpa = (measured[signal] - self._atmosphere_pa) / 1e3
            pressures.append(f"{mark}{name} {gauge_kpa:5.1f}")
        if pressures:
            parts.append(f"{', '.join(pressures)} kPa gauge")
        if jog.note:
            parts.append(jog.note)
        return " | ".join(parts)[:WIDTH].ljust(WIDTH)


@contextmanager
def raw_keys() -> Iterator[None]:
    """The terminal gives single keys at once, and nothing where there are none. Ctrl-C still
    works. A terminal that is gone by the end is left as it is.
    """
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        tty.setcbreak(descriptor)
        settings = termios.tcgetattr(descriptor)
        settings[6][termios.VMIN], settings[6][termios.VTIME] = 0, 0
        termios.tcsetattr(descriptor, termios.TCSANOW, settings)
        yield
    finally:
        with suppress(OSError, termios.error):
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)
            sys.stderr.write("\n")

"""Where the references of a calibration come from: a file, a simulated gauge, or the operator."""

import sys
import textwrap
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from epa_rt.calibrate.point import CalibrationError, Point
from epa_rt.calibrate.points_file import Asked
from epa_rt.calibrate.reference import Reader
from epa_rt.calibrate.refusals import Scale, check_reading, check_rest, doubt_of
from epa_rt.calibrate.taking import Reference, Step, Taking
from epa_rt.cli.typed import Typed
from epa_rt.config.units import UnitError
from epa_rt.loop.requests import OperatorRequests
from epa_rt.realtime.screen import DroppingStream

if TYPE_CHECKING:
    import numpy as np

END = ("done", "end", "q")
SHOW_S = 0.2  # between two readings on the screen
_SAVE, _BACK, _ERASE = "\x1b7", "\x1b8", "\x1b[K"  # the cursor's place; the rest of its line


class Standard(Protocol):
    """A simulated reference: what is applied to the sensor, and what it feels."""

    applied: float | None

    @property
    def truth(self) -> float: ...


class FileAnswers:
    """References of a file, one after the other, without anybody there. ``standard``: of a
    simulated rig, to which the reference is applied, off by its own uncertainty.
    """

    def __init__(
        self, asked: list[Asked], standard: Standard | None, noise: "np.random.Generator | None"
    ):
        self.enough = False
        self.steps: Iterator[Step] = iter([Step((), one.where) for one in asked])
        self._left = deque(asked)
        self._standard, self._noise = standard, noise
        self._reference: Reference | None = None

    def ask(self, step: Step, number: int, reading: float) -> None:
        one = self._left.popleft()
        where = f"point {number}" + (f" ({one.where})" if one.where else "")
        self._reference = Reference(one.reference, one.reference_u, where, is_mass=one.is_mass)
        if self._standard is not None:
            error = self._noise.normal() * one.reference_u if self._noise is not None else 0.0
            applied = one.reference + error if one.applied is None else one.applied
            self._standard.applied = applied

    def answer(self) -> Reference | None:
        return self._reference

    def took(self, point: Point) -> bool:
        return True


class GaugeAnswers:
    """A simulated gauge beside the sensor, read through every record, with an error of its own at
    each point.
    """

    def __init__(
        self, standard: Standard, u: float, noise: "np.random.Generator | None", shift: float
    ):
        self.enough = False
        self._standard, self._u, self._noise, self._shift = standard, u, noise, shift
        self._reference: Reference | None = None

    def ask(self, step: Step, number: int, reading: float) -> None:
        error = self._noise.normal() * self._u if self._noise is not None else 0.0
        standard = self._standard
        self._reference = Reference(
            error + self._shift, self._u, f"point {number} ({step.words})", lambda: standard.truth
        )

    def answer(self) -> Reference | None:
        return self._reference

    def took(self, point: Point) -> bool:
        return True


class TypedLines(OperatorRequests):
    """Requests of a run that also reads the operator's lines, in the loop's own ``poll``, without
    ever waiting. What is typed while nothing is asked is dropped. ``reading``, where it is set:
    what stands behind the line while it is typed, anew every SHOW_S.
    """

    def __init__(self, period_s: float):
        super().__init__(period_s)
        self._terminal = Typed(period_s, self.ask)
        self._typed, self._lines = "", deque[str](maxlen=8)
        self._out = DroppingStream.of(sys.stderr)
        self._is_asking = False
        self._show_every = max(1, round(SHOW_S / period_s))
        self.reading: Callable[[], str] | None = None

    def poll(self, cycle: int) -> int:
        self._take_in(self._terminal.read(cycle))
        if self._is_asking and not self._lines and cycle % self._show_every == 0:
            self._show()
        return super().poll(cycle)

    def _show(self) -> None:
        if self.reading is not None:
            self._write(f"{_SAVE}   now {self.reading()}{_ERASE}{_BACK}")

    def prompt(self) -> None:
        """From now on lines are taken."""
        self._typed, self._is_asking = "", True
        self._write("> ")
        self._show()

    def line(self) -> str | None:
        """The line that was typed; None until there is one."""
        if not self._lines:
            return None
        self._is_asking = False
        return self._lines.popleft().strip()

    def say(self, text: str) -> None:
        """One line for the operator; dropped where the screen takes none."""
        self._write(text + "\n")

    def _take_in(self, data: bytes) -> None:
        """Keys as lines: Enter ends one, backspace and Ctrl-U mend it."""
        for key in data.decode("utf-8", "replace"):
            if not self._is_asking or self._lines:
                continue
            if key in "\r\n":
                self._lines.append(self._typed)
                self._write(f"{_ERASE}\n" if self.reading is not None else "\n")
            elif key in "\x7f\b":
                if self._typed:
                    self._typed = self._typed[:-1]
                    self._write("\b \b")
            elif key == "\x15":
                self._write("\b \b" * len(self._typed))
                self._typed = ""
            elif key.isprintable() and len(self._typed) < 60:
                self._typed += key
                self._write(key)

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):
            self._out.write(text)
            self._out.flush()


@dataclass(frozen=True)
class Talk:
    """What the operator is told: how to apply a reference, and how long a record takes."""

    says: str
    record_s: float
    by_gauge: bool  # a simulated reference is read and not applied


class TypedAnswers:
    """The operator's references. ``asked``: those to propose, in order; Enter takes one.
    ``used_mass``: one was written as a mass.
    """

    def __init__(
        self,
        lines: TypedLines,
        reader: Reader,
        scale: Scale,
        talk: Talk,
        asked: list[Asked],
        standard: Standard | None,
    ):
        self.enough, self.used_mass = False, False
        self.taking: Taking | None = None
        self._lines, self._reader, self._scale, self._talk = lines, reader, scale, talk
        self._asked, self._standard = deque(asked), standard
        self._points: list[Point] = []
        self._number = 0

    def ask(self, step: Step, number: int, reading: float) -> None:
        self._number = number
        say, shown, talk = self._lines.say, self._scale.shown, self._talk
        name = step.words and f": {step.words}"
        say(f"\npoint {number}{name}: reads {self.shown(reading)}")
        if talk.by_gauge and self._standard is not None:
            say(f"  (the simulated reference says {shown(self._standard.truth)})")
        if number == 1:
            say(f"  {talk.says}")
            say("  'again' drops the last point, 'done' ends; Ctrl-C stops")
        if self._asked:
            say(f"  Enter for {shown(self._asked[0].reference)}")
        if (taking := self.taking) is not None:
            self._lines.reading = lambda: self.shown(taking.reading)
        self._lines.prompt()

    def shown(self, reading: float) -> str:
        """What the signal says now (SI, pressures absolute), as the operator's gauge would."""
        reader = self._reader
        return self._scale.shown(
            reading - reader.atmosphere_pa if reader.row.reads == "gauge" else reading
        )

    def answer(self) -> Reference | None:
        text = self._lines.line()
        if text is None:
            return None
        if text.lower() in END:
            self.enough = True
        elif text.lower() == "again":
            self._again()
        elif text or self._asked:
            return self._reference(text)
        else:
            self._lines.prompt()
        return None

    def _reference(self, text: str) -> Reference | None:
        try:
            if text:
                value, u, mass = self._reader.read(text)
            else:
                one = self._asked[0]
                value, u, mass = one.reference, one.reference_u, one.is_mass
        except UnitError as error:
            self._lines.say(f"  {error}")
            self._lines.prompt()
            return None
        if self._asked:
            self._asked.popleft()
        self.used_mass |= mass
        if self._standard is not None and not self._talk.by_gauge:
            self._standard.applied = value
        shown = self._scale.shown(value)
        self._lines.say(f"  {shown}: reading for {self._talk.record_s:g} s, hands off")
        return Reference(value, u, f"point {self._number}", is_mass=mass)

    def _again(self) -> None:
        dropped = None if self.taking is None else self.taking.drop_last()
        if dropped is None:
            self._lines.say("  there is no point to drop")
        else:
            self._points.pop()
            self._number -= 1
            self._lines.say(f"  {dropped.point.where} is dropped")
        self._lines.prompt()

    def took(self, point: Point) -> bool:
        """Says what was read; a point that is noisy or moved is not taken."""
        scale, say = self._scale, self._lines.say
        span = abs(scale.gain) * (scale.valid[1] - scale.valid[0])
        try:
            check_reading(point, scale)
            check_rest(point, self._points, scale, span)
        except CalibrationError as error:
            for text in textwrap.wrap(f"NOT TAKEN: {error}", 76):
                say(f"  {text}")
            return False
        doubt = doubt_of(point, self._points, scale)
        self._points.append(point)
        present = scale.gain * point.reading + scale.offset
        say(
            f"  {point.reading:.5g} {scale.native}, scatter {point.scatter:.2g} {scale.native}:"
            f" by the rig file {scale.shown(present)}"
        )
        if doubt:
            for text in textwrap.wrap(f"CHECK: {doubt} ('again' drops this point)", 76):
                say(f"  {text}")
        return True

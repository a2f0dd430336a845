"""The progress line of a run, printed by the recorder process so that the loop never prints.

Nor may it hold up the recorder: Ctrl-S, or a reader of stderr that stopped, costs lines and not the
log.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TextIO

from epa_rt.realtime.screen import DroppingStream

TERMINAL_INTERVAL_S = 0.25
PLAIN_INTERVAL_S = 10.0


@dataclass(frozen=True)
class ProgressSpec:
    """How long the run is expected to be: cycles (1 at most: not known), and seconds per cycle."""

    total_cycles_estimate: int
    period_s: float
    enabled: bool = True


_COLUMNS = 79  # a line that wraps cannot be overwritten


class ProgressLine:
    """Writes state, phase, time, share, estimated end and the fill of the recorder's buffer;
    overwrites itself on a terminal.
    """

    def __init__(
        self, spec: ProgressSpec, states: tuple[str, ...], phases: tuple[str, ...], stream: TextIO
    ) -> None:
        self._spec, self._states, self._phases = spec, states, phases
        self._stream: DroppingStream | TextIO | _Silent = DroppingStream.of(stream)
        self._terminal = stream.isatty()
        self._due_s: float | None = None
        self._begin: tuple[float, int] | None = None
        self._last: tuple[float, int, int, int, float] | None = None
        self._width = 0

    def update(self, now_s: float, cycles: int, state: int, phase: int, fill_ratio: float) -> None:
        """Print if it is time: `now_s` by any steady clock, `cycles` recorded so far, `fill_ratio`
        of the ring.
        """
        if self._begin is None:
            self._begin = (now_s, cycles)
            self._due_s = now_s
        self._last = (now_s, cycles, state, phase, fill_ratio)
        if self._due_s is not None and now_s < self._due_s:
            return
        self._due_s = now_s + (TERMINAL_INTERVAL_S if self._terminal else PLAIN_INTERVAL_S)
        self._print(self.text(now_s, cycles, state, phase, fill_ratio))

    def text(
        self,
        now_s: float,
        cycles: int,
        state: int,
        phase: int,
        fill_ratio: float,
        over: bool = False,
    ) -> str:
        """The line itself, without an end. ``over``: nothing more comes, and nothing is left."""
        begin = f"{_name(self._states, state)} | {_name(self._phases, phase)} |"
        buffer = f"buffer {100 * fill_ratio:.0f} % full"
        period_s = self._spec.period_s
        if self._spec.total_cycles_estimate <= 1:  # moved by hand or homed: nobody knows how long
            return f"{begin} {_clock(cycles * period_s)} | {buffer}"
        total = max(self._spec.total_cycles_estimate, cycles)
        times = f"{_clock(cycles * period_s)} of {_clock(total * period_s)}"
        if over:
            return f"{begin} {times} | {buffer}"
        begin_s, begin_cycles = self._begin or (now_s, cycles)
        done, elapsed_s = cycles - begin_cycles, now_s - begin_s
        left = _clock(elapsed_s / done * (total - cycles)) if done > 0 else "--:--"
        return f"{begin} {times} | {100 * cycles // total:3d} % | {left} left | {buffer}"

    def finish(self) -> None:
        """Print where it ended, and leave the terminal on a line of its own."""
        if self._last:
            self._print(self.text(*self._last, over=True))
            self._last = None
            if self._terminal:
                self._write("\n")

    def _print(self, text: str) -> None:
        if self._terminal:
            if len(text) > _COLUMNS:  # what the phase's name leaves no room for goes whole
                text = text.rpartition(" | ")[0][:_COLUMNS]
            self._write("\r" + text.ljust(self._width))
            self._width = len(text)
        else:
            self._write(text + "\n")

    def _write(self, text: str) -> None:
        try:
            self._stream.write(text)
            self._stream.flush()
        except (OSError, ValueError):
            # A terminal that went away must not cost the log.
            self._stream = _Silent()


class _Silent:
    def write(self, text: str) -> None: ...
    def flush(self) -> None: ...


def _name(names: tuple[str, ...], index: int) -> str:
    return names[index] if 0 <= index < len(names) else "-"


def _clock(seconds: float) -> str:
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes:02d}:{seconds:02d}"

"""Narrow lines on a raw channel: mains hum, a fan. Of one frequency, one size and one phase all the
log long, and on nothing that moves the rig.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from epa_rt.config.rig_rows import PLACES
from epa_rt.gap.finding import Finding, Sinusoid, measured_names, regular, regular_rows
from epa_rt.gap.hygiene.answering import terms_of_motion, without_answer
from epa_rt.gap.hygiene.multitaper import (
    chance_of_going_along,
    chance_of_running,
    error_of_steps,
    half_bandwidth,
    line_chances,
    noise_beside,
    noise_of_phasor,
    running,
    together,
    tones,
)
from epa_rt.gap.hygiene.values import smallest_step
from epa_rt.gap.recording import Recording
from epa_rt.gap.side_by_side import each

FALSE_ALARM = 1e-3  # of any line on all channels of all logs together, where there is noise alone
# share of the log in which a line has one size and runs on: one trial is less
_ALL_ALONG = 0.75  # by scripts/line_thresholds.py
_WINDOW_ROWS = (128, 2048)
_WINDOWS, _OF_SHORTEST = 4, 6  # of a log at least; of the shortest one, where windows can be long
_BLOCK = 16  # windows over which a phase must run on: mains and fans wander over longer ones
_LONGEST = 1.25  # cycles to a row: with a fifth of them lost a log is refused
_BRIDGED = 0.05  # of a window's rows at most
_MAINS_HZ, _MAINS_OFF, _HARMONICS = (50.0, 60.0), 0.01, 6  # EN 50160: 1 %; rectifiers make the 6th
_SENSORS = ("_pa", "_n")  # pressures and load cells share cables and terminals
_SLOPES = ("_m_s", "_rad_s")
_DRIVEN = 0.05  # of what a command moves, from which a frequency counts as one of its own
# times the harmonics beside it, which fall with their number; by scripts/line_thresholds.py
_STANDS_OUT = 3.0
_STEADY = 0.1  # of its mean, by which a speed may change where all is at one speed


@dataclass(frozen=True)
class _Log:
    """A recording cut into windows of ``rows`` rows, on a grid without holes."""

    recording: Recording
    rows: int

    @cached_property
    def starts(self) -> np.ndarray:
        cycle = self.recording.cycle
        return np.arange(0, int(cycle[-1] - cycle[0]) + 2 - self.rows, self.rows)

    def cut(self, name: str) -> np.ndarray:
        """(M, rows) of a column."""
        return self._cut(regular(self.recording, name))

    def still(self, name: str, frequency: float | None = None) -> np.ndarray:
        """(M, rows) of a column as ``beside`` gives it."""
        return self._cut(self.beside(name, frequency))

    def beside(self, name: str, frequency: float | None = None) -> np.ndarray:
        """(n,) of a column less what of it answers to commands and motion, but for a line of
        ``frequency``.
        """
        whole = regular(self.recording, name)
        return whole if _moves(name) else without_answer(whole, self.motion, frequency)

    @cached_property
    def motion(self) -> np.ndarray:
        """(n, p) what may answer to commands and motion."""
        return terms_of_motion(
            self.recording, [name for name in sorted(self.recording.columns) if _moves(name)]
        )

    def known(self, name: str) -> np.ndarray:
        """(M,) bool: windows with hardly a row without a value."""
        finite = np.isfinite(self.recording.columns[name])
        return self._cut(regular_rows(self.recording, finite)).mean(axis=1) >= 1.0 - _BRIDGED

    def _cut(self, values: np.ndarray) -> np.ndarray:
        return values[: len(self.starts) * self.rows].reshape(len(self.starts), self.rows)


@dataclass(frozen=True)
class _Seen:
    """A line on a channel of one log; frequencies in cycles a row, ``share`` that runs on,
    ``chance`` as -ln, ``floor``: noise and step of the channel.
    """

    log: _Log
    kept: np.ndarray
    sinusoids: tuple[Sinusoid, ...]
    deviation: float
    share: float
    chance: float
    floor: float

    @property
    def amplitude(self) -> float:
        return float(np.mean([np.hypot(one.cosine, one.sine) for one in self.sinusoids]))

    @property
    def frequency(self) -> float:
        return float(np.mean([one.frequency for one in self.sinusoids]))

    @property
    def counts(self) -> bool:
        return self.share >= _ALL_ALONG and self.amplitude > self.floor

    def blocks(self) -> Iterator[tuple[float, np.ndarray]]:
        """(frequency, rows of windows) of each block."""
        parts = _blocks(self.kept)
        return zip((one.frequency for one in self.sinusoids), parts, strict=True)


def check_lines(recordings: Sequence[Recording]) -> list[Finding]:
    """One for each log and line on one of its channels; ``sinusoids`` is what is taken out, none
    where the line may be of something that turns.
    """
    found = []
    for period_s in sorted({one.period_s for one in recordings}):
        logs = _logs([one for one in recordings if one.period_s == period_s])
        names = sorted({name for log in logs for name in _tested(log.recording)})
        each(lambda log: log.motion, logs if names else ())  # what every channel asks for
        lines = partial(_lines, logs, len(names))
        for name, of_channel in zip(names, each(lines, names), strict=True):
            for seen in of_channel:
                found += _findings(seen, name, logs, recordings)
    return found


def _logs(recordings: Sequence[Recording]) -> list[_Log]:
    """Those that are long enough for four windows and not torn, all cut alike."""
    low, high = _WINDOW_ROWS
    long = [one for one in recordings if one.samples >= _WINDOWS * low and not _torn(one)]
    if not long:
        return []
    rows = int(np.clip(min(one.samples for one in long) // _OF_SHORTEST, low, high))
    return [_Log(one, rows) for one in long]


def _torn(recording: Recording) -> bool:
    """Whether cycles go back, or more are lost than a diagnosis takes."""
    cycle = recording.cycle
    return bool(np.any(np.diff(cycle) < 0)) or bool(
        cycle[-1] - cycle[0] + 1 > _LONGEST * recording.samples
    )


def _tested(recording: Recording) -> list[str]:
    return [
        name
        for name in measured_names(recording)
        if (known := recording.columns[name][np.isfinite(recording.columns[name])]).size
        and known.min() < known.max()
    ]


def _lines(logs: Sequence[_Log], channels: int, name: str) -> list[list[_Seen]]:
    """The lines of one of the ``channels``, each in the logs that have it."""
    able = [log for log in logs if name in log.recording.columns]
    able = [log for log in able if int(log.known(name).sum()) >= _WINDOWS]
    if not able:
        return []
    found = []
    windows = np.concatenate([log.still(name)[log.known(name)] for log in able])
    peaks, tests = _candidates(windows)
    enough = np.log(max(len(peaks), 1) * len(able) / FALSE_ALARM)
    for frequency, chance in peaks:
        if chance < np.log(tests * channels / FALSE_ALARM):
            continue
        seen = [one for log in able if (one := _seen(log, name, frequency)).counts]
        if (
            seen
            and float(together(np.array([one.chance for one in seen]))) > enough
            and not _moved(seen, name)
            and not any(_is_harmonic(one, name) for one in seen)
        ):
            found.append(seen)
    return found


def _candidates(windows: np.ndarray) -> tuple[list[tuple[float, float]], int]:
    """Peaks of (frequency, -ln of its chance), the clearest first, a bandwidth apart; and how many
    frequencies were looked at.
    """
    frequencies, chances = line_chances(windows)
    joint, total = together(chances), chances.sum(axis=0)
    peaks = np.flatnonzero(joint > -np.log(FALSE_ALARM))
    found: list[tuple[float, float]] = []
    for at in peaks[np.argsort(-total[peaks])]:
        if all(abs(frequencies[at] - f) > half_bandwidth(windows.shape[1]) for f, _ in found):
            found.append((float(frequencies[at]), float(joint[at])))
    return found, len(frequencies)


def _seen(log: _Log, name: str, frequency: float) -> _Seen:
    """What a log's channel holds at a frequency, block by block."""
    kept = np.flatnonzero(log.known(name))
    windows, reach = log.still(name, frequency), 0.5 / log.rows
    sinusoids, chances, runs, along = [], [], [], []
    power = 0.0
    parts = _blocks(kept)
    ends = [log.starts[part[0]] for part in parts[1:]]
    for part, start, stop in zip(parts, [0, *ends], [*ends, _grid_rows(log)], strict=True):
        starts = log.starts[part].astype(float)
        rough = frequency
        for _ in range(2):
            off, _share = running(
                tones(windows[part], rough).phasors * _at(rough, starts), starts, reach
            )
            rough += off
        exact = tones(windows[part], rough)
        turned = exact.phasors * _at(rough, starts)
        mean = turned.mean()
        own = float(np.sum(np.abs(turned) ** 2))
        power += own
        runs.append(abs(mean) ** 2 * len(part))
        chances.append(
            chance_of_running(float(abs(mean) ** 2) * len(part) / own if own else 0.0, len(part))
        )
        along.append((turned * np.conj(mean) / max(abs(mean), 1e-300)).real)
        sinusoids.append(
            Sinusoid(int(start), int(stop), float(rough), float(mean.real), float(-mean.imag))
        )
    scatter = np.concatenate([one - one.mean() for one in along])
    count = len(kept)
    noise = noise_beside(windows[kept], frequency)
    deviation = max(float(np.std(scatter)), noise * noise_of_phasor(log.rows)) / np.sqrt(count)
    values = log.recording.columns[name]
    step = smallest_step(values[np.isfinite(values)])
    size = float(np.mean([np.hypot(one.cosine, one.sine) for one in sinusoids]))
    apart = float(np.sqrt(max(np.mean(windows[kept].var(axis=1)) - 0.5 * size**2, 0.0)))
    return _Seen(
        log,
        kept,
        tuple(sinusoids),
        float(np.hypot(deviation, error_of_steps(size, step, min(noise, apart)))),
        float(sum(runs) / power) if power else 0.0,
        float(together(np.array(chances))),
        max(noise, step),
    )


def _at(frequency: float, starts: np.ndarray) -> np.ndarray:
    """What turns phasors of windows back to those of the log's first row."""
    return np.exp(-2j * np.pi * frequency * starts)


def _blocks(kept: np.ndarray) -> list[np.ndarray]:
    return np.array_split(kept, -(-len(kept) // _BLOCK))


def _grid_rows(log: _Log) -> int:
    cycle = log.recording.cycle
    return int(cycle[-1] - cycle[0]) + 1


def _moved(seen: Sequence[_Seen], name: str) -> bool:
    """Whether a command, a reference or a reading of motion carries the line too, in step with
    it; for a reading of motion, whether any other column does.
    """
    others = {
        other
        for one in seen
        for other in one.log.recording.columns
        if _moves(other) or (_moves(name) and other in measured_names(one.log.recording))
    }
    enough = np.log(max(len(others), 1) / FALSE_ALARM)
    return any(_in_step(seen, name, other) > enough for other in others - {name})


def _moves(name: str) -> bool:
    asked = name.startswith(("cmd_", "ref_", "motor_"))
    return (
        not name.startswith("est_")
        and not name.endswith("_raw")
        and (asked or not name.endswith(_SENSORS))
    )


def _in_step(seen: Sequence[_Seen], name: str, other: str) -> float:
    """-ln of the chance that another column has that line as well, and in step: the larger one.
    What a far larger motion leaves at a frequency may be in step and is no line.
    """
    lines, steps = [np.zeros(0)], []
    for one in seen:
        if other not in one.log.recording.columns:
            continue
        own, its, known = one.log.cut(name), one.log.cut(other), one.log.known(other)
        for frequency, part in one.blocks():
            both = part[known[part]]
            if len(both) > 1:
                a, b = (tones(values[both], frequency) for values in (own, its))
                steps.append(chance_of_going_along(a.phasors, b.phasors))
                lines.append(b.chances)
    if not steps:
        return 0.0
    return min(float(together(np.concatenate(lines))), float(together(np.array(steps))))


def _is_harmonic(seen: _Seen, name: str) -> bool:
    """Whether a line does not stand out from those that lie beside it by a frequency of a command:
    the answer of what is not linear.
    """
    return stands_out(seen.log, name, seen.frequency) < _STANDS_OUT


def stands_out(log: _Log, name: str, frequency: float) -> float:
    """A line's amplitude over that of the largest beside it; infinite where no command has a
    frequency.
    """
    recording, grid = log.recording, _grid_rows(log)
    own = np.diff(log.beside(name, frequency)) * np.hanning(grid - 1)
    beside = {
        frequency + times * asked
        for other in recording.columns
        if other.startswith(("cmd_", "ref_")) and not other.endswith("_raw")
        for asked in _asked(regular(recording, other))
        for times in (-2, -1, 1, 2)
    }
    largest = max((_size(own, f) for f in beside if 0.0 < f < 0.5), default=0.0)
    return _size(own, frequency) / largest if largest > 0.0 else float("inf")


def _asked(values: np.ndarray) -> np.ndarray:
    """Frequencies that a command is made of, in cycles a row, but for those too slow to tell."""
    power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(len(values)))) ** 2
    power[:4] = 0.0  # four over the log's length: a line and those beside it are told apart
    inner = power[1:-1]
    peaks = (inner > power[:-2]) & (inner >= power[2:]) & (inner > _DRIVEN / 2.0 * power.sum())
    return (np.flatnonzero(peaks) + 1) / len(values)


def _size(steps: np.ndarray, frequency: float) -> float:
    """Amplitude at a frequency of a column whose steps from row to row are given, tapered."""
    turns = np.exp(-2j * np.pi * frequency * np.arange(len(steps)))
    gain = abs(np.exp(2j * np.pi * frequency) - 1.0)
    return float(abs(np.sum(turns * steps))) * 4.0 / len(steps) / gain


def _findings(
    seen: Sequence[_Seen], name: str, logs: Sequence[_Log], recordings: Sequence[Recording]
) -> list[Finding]:
    turns = _turns(seen)
    says = f"{name} {_line(seen, name)}, in {_which(seen, recordings)}; " + (
        f"it is kept, as it may turn with {turns}, which goes at one speed"
        if turns
        else "nothing that moves carries it; it is taken out"
    )
    short = [one.name for one in recordings if one.name not in {log.recording.name for log in logs}]
    if short:
        says += f" ({', '.join(short)}: too short or too torn to tell)"
    return [
        Finding(
            "note" if turns else "exclude",
            "line",
            one.log.recording.name,
            name,
            says,
            sinusoids=() if turns else one.sinusoids,
        )
        for one in seen
    ]


def _line(seen: Sequence[_Seen], name: str) -> str:
    """'carries a line of 50.0 Hz, 3.06 ± 0.02 N amplitude (mains hum?)'."""
    from epa_rt.config.rig_rows import si_unit_of
    from epa_rt.config.units import UnitError, with_unit

    period_s = seen[0].log.recording.period_s
    hertz = float(np.mean([one.frequency for one in seen])) / period_s
    seconds = max(_grid_rows(one.log) for one in seen) * period_s
    weights = np.array([one.deviation**-2.0 for one in seen])
    amplitude = float(weights @ [one.amplitude for one in seen] / weights.sum())
    deviation = float(weights.sum() ** -0.5)
    try:
        unit = si_unit_of(name)
    except UnitError:
        unit = ""
    digits = max(int(np.floor(np.log10(seconds))), 0)
    decimals = max(int(np.ceil(-np.log10(deviation))) + 1, 0)  # two digits of the deviation
    low = 0.5 / period_s <= 2.0 * max(_MAINS_HZ)
    why = _mains(hertz, 1.0 / period_s, low)
    return (
        f"carries a line {'seen at' if low else 'of'} {hertz:.{digits}f} Hz"
        f"{' (may be an alias)' if low else ''},"
        f" {with_unit(f'{amplitude:.{decimals}f} ± {deviation:.{decimals}f}', unit)} amplitude{why}"
    )


def _mains(hertz: float, rate_hz: float, folded: bool) -> str:
    """' (mains hum?)' where a line is at a multiple of the mains, or where one is folded to."""
    for mains in _MAINS_HZ:
        for times in range(1, _HARMONICS + 1):
            at = mains * times
            seen = abs((at + 0.5 * rate_hz) % rate_hz - 0.5 * rate_hz) if folded else at
            if abs(hertz - seen) <= _MAINS_OFF * at:
                return f" (mains hum of {at:g} Hz?)" if folded else " (mains hum?)"
    return ""


def _which(seen: Sequence[_Seen], recordings: Sequence[Recording]) -> str:
    if len(seen) == len(recordings):
        return "all logs" if len(seen) > 1 else "the log"
    return ", ".join(one.log.recording.name for one in seen)


def _turns(seen: Sequence[_Seen]) -> str:
    """A reading that goes at one speed in every log that has the line: what turns with it has one
    frequency as well. '' where there is none.
    """
    names = {name for one in seen for name in measured_names(one.log.recording)}
    for name in sorted(names):
        if name.endswith((*PLACES, *_SLOPES)):
            speeds = np.concatenate([_speeds(one.log, name) for one in seen])
            mean = abs(float(np.mean(speeds)))
            if mean > 0.0 and float(np.std(speeds)) < _STEADY * mean:
                return name
    return ""


def _speeds(log: _Log, name: str) -> np.ndarray:
    """Of each window: the mean of a speed, the way of a position; 0 where it goes to and fro."""
    if name not in log.recording.columns:
        return np.zeros(len(log.starts))
    windows = log.cut(name)
    if name.endswith(_SLOPES):
        speeds, spread = windows.mean(axis=1), windows.std(axis=1)
    else:
        speeds, spread = windows[:, -1] - windows[:, 0], 0.5 * np.ptp(windows, axis=1)
    return np.where(np.abs(speeds) > spread, speeds, 0.0)

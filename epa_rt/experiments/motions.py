"""From the motion of a phase as it is written to the profile that is planned, checked against the
rig's limits.
"""

from collections.abc import Callable
from dataclasses import dataclass

from epa_rt.config.experiment import (
    Chirp,
    Move,
    Multisine,
    PhaseFile,
    RandomSpeed,
    Sine,
    Staircase,
    Step,
    Wave,
)
from epa_rt.experiments import oscillations, profiles, random_speed
from epa_rt.experiments.bounds import MOST_PIECES, MOST_WAVES, MOST_WAVES_OF_PERIOD
from epa_rt.experiments.coordinate import Coordinate
from epa_rt.experiments.profiles import Profile
from epa_rt.experiments.reader import Reader, show

BLEND_S = (
    0.5  # a planned profile that is entered beside its start takes the offset out within this time
)
LASTING = (
    "random_speed",
    "chirp",
    "sine",
    "multisine",
)  # motions that go on for as long as 'for' says


@dataclass(frozen=True)
class Situation:
    """Where a motion is planned: ``start`` is the reference's position before it, None where only
    the run will tell.
    """

    coordinate: Coordinate
    start: float | None
    duration_s: float | None
    seed: tuple[int, ...]


@dataclass(frozen=True)
class Motion:
    """A motion planned from a start; ``from_start`` makes it anew where that is quick enough for a
    cycle.
    """

    planned_start: float | None
    planned: Profile | None
    from_start: Callable[[float], Profile] | None = None

    @property
    def end(self) -> float | None:
        return None if self.planned is None else self.planned.end

    def profile(self, start: float) -> Profile:
        """The profile from where the reference is; planned ones are entered smoothly where that is
        beside the plan.
        """
        if start == self.planned_start:
            return self.planned
        if self.from_start is not None:
            return self.from_start(start)
        return profiles.Blended(self.planned, start - self.planned_start, BLEND_S)


def plan(reader: Reader, phase: PhaseFile, situation: Situation) -> Motion:
    """The motion of a phase. Raises ConfigError where it does not fit the rig."""
    kind = phase.motion
    if kind is None:
        return _planned(lambda start: profiles.Hold(start), situation)
    if kind == "move":
        motion = _move(reader, phase.move, situation)
    else:
        if situation.start is None:
            raise reader.error(
                (kind,),
                f"a {kind} from a position that is not known beforehand",
                "a move before it",
            )
        make = {
            "random_speed": _random_speed,
            "chirp": _chirp,
            "sine": _sine,
            "multisine": _multisine,
            "step": _step,
            "staircase": _staircase,
        }[kind]
        try:
            motion = Motion(situation.start, make(reader, getattr(phase, kind), situation))
        except ValueError as error:  # what only the profile itself can see
            found, expected = str(error).removeprefix("found ").split(", expected ", 1)
            raise reader.error((kind,), found, expected) from None
    if motion.planned is not None:
        _check(reader, kind, motion.planned, situation.coordinate)
    return motion


def _planned(make: Callable[[float], Profile], situation: Situation) -> Motion:
    return Motion(situation.start, None if situation.start is None else make(situation.start), make)


def _check(reader: Reader, kind: str, profile: Profile, coordinate: Coordinate) -> None:
    low, high = coordinate.limits
    peaks, si_unit, slack = profile.peaks, coordinate.si_unit, 1.0 + 1e-9
    if peaks.low < low - 1e-12 or peaks.high > high + 1e-12:
        raise reader.error(
            (kind,),
            f"positions from {show(peaks.low, si_unit)} to {show(peaks.high, si_unit)}",
            f"positions within the rig's limits, {show(low, si_unit)} to {show(high, si_unit)}",
        )
    for name, peak, highest, rate in (
        ("speed", peaks.speed, coordinate.speed_max, "/s"),
        ("acceleration", peaks.acceleration, coordinate.acceleration_max, "/s^2"),
    ):
        if peak > highest * slack:
            raise reader.error(
                (kind,),
                f"a {name} of up to {show(peak, si_unit, rate)}",
                f"at most the rig's limit, {show(highest, si_unit, rate)}",
            )


def _move(reader: Reader, move: Move, situation: Situation) -> Motion:
    coordinate = situation.coordinate
    end = reader.position(("move", "to"), move.to, coordinate)
    speed = reader.speed(("move", "speed"), move.speed, coordinate)
    acceleration = reader.acceleration(("move", "acceleration"), move.acceleration, coordinate)
    motion = _planned(lambda start: profiles.Move(start, end, speed, acceleration), situation)
    # from an unknown start the end is known all the same: what follows can be planned from there
    return (
        motion
        if motion.planned is not None
        else Motion(None, profiles.Hold(end), motion.from_start)
    )


def _random_speed(reader: Reader, motion: RandomSpeed, situation: Situation) -> Profile:
    key, coordinate = "random_speed", situation.coordinate
    low, high = (
        reader.position((key, "between", i), motion.between[i], coordinate) for i in (0, 1)
    )
    if not low < high:
        raise reader.error(
            (key, "between"), f"{list(motion.between)}", "the lower position before the upper one"
        )
    speed = reader.speed((key, "speed"), motion.speed, coordinate)
    acceleration = reader.acceleration((key, "acceleration"), motion.acceleration, coordinate)
    dwell_s = tuple(reader.positive((key, "dwell", i), motion.dwell[i], "s") for i in (0, 1))
    if dwell_s[0] > dwell_s[1]:
        raise reader.error(
            (key, "dwell"), f"{list(motion.dwell)}", "the shorter time before the longer one"
        )
    count = 2.0 * situation.duration_s / (dwell_s[0] + dwell_s[1])
    if count > MOST_PIECES / 2:
        raise reader.error(
            (key, "dwell"),
            f"about {count:.0f} speeds in {situation.duration_s:g} s",
            f"at most {MOST_PIECES // 2} in a run: a shorter 'for', or a longer dwell",
        )
    if high - low < speed * dwell_s[0]:
        raise reader.error(
            (key, "between"),
            f"a range of {show(high - low, coordinate.si_unit)}",
            "at least what the speed covers in the shortest dwell,"
            f" {show(speed * dwell_s[0], coordinate.si_unit)}",
        )
    return random_speed.RandomSpeed(
        situation.start,
        low,
        high,
        speed,
        acceleration,
        dwell_s,
        situation.duration_s,
        situation.seed,
    )


def _wave(reader: Reader, key: str, wave: Wave, situation: Situation) -> tuple[float, float, float]:
    """Mean, amplitude, fade in s."""
    coordinate = situation.coordinate
    mean = reader.position((key, "mean"), wave.mean, coordinate)
    if abs(situation.start - mean) > 1e-9:
        raise reader.error(
            (key, "mean"),
            f"a motion about {show(mean, coordinate.si_unit)} that starts at"
            f" {show(situation.start, coordinate.si_unit)}",
            "a move to the mean before it",
        )
    amplitude = 0.5 * reader.positive((key, "peak_to_peak"), wave.peak_to_peak, coordinate.si_unit)
    return mean, amplitude, reader.positive((key, "fade"), wave.fade, "s")


def _chirp(reader: Reader, motion: Chirp, situation: Situation) -> Profile:
    mean, amplitude, fade_s = _wave(reader, "chirp", motion, situation)
    start_hz = reader.frequency(("chirp", "from"), motion.start)
    end_hz = reader.frequency(("chirp", "to"), motion.end)
    _check_waves(reader, "chirp", situation, max(start_hz, end_hz), fade_s)
    return oscillations.Chirp(mean, amplitude, start_hz, end_hz, situation.duration_s, fade_s)


def _sine(reader: Reader, motion: Sine, situation: Situation) -> Profile:
    mean, amplitude, fade_s = _wave(reader, "sine", motion, situation)
    frequency_hz = reader.frequency(("sine", "frequency"), motion.frequency)
    _check_waves(reader, "sine", situation, frequency_hz, fade_s)
    return oscillations.Sine(mean, amplitude, frequency_hz, situation.duration_s, fade_s)


def _check_waves(
    reader: Reader, kind: str, situation: Situation, frequency_hz: float, fade_s: float
) -> None:
    """What is planned from points along the wave must not have too many of them."""
    waves = situation.duration_s * (frequency_hz + 1.0 / fade_s)
    if waves > MOST_WAVES:
        raise reader.error(
            (kind,),
            f"about {waves:.0f} waves and fades in {situation.duration_s:g} s",
            f"at most {MOST_WAVES} in one phase",
        )


def _multisine(reader: Reader, motion: Multisine, situation: Situation) -> Profile:
    mean, amplitude, fade_s = _wave(reader, "multisine", motion, situation)
    start_hz = reader.frequency(("multisine", "from"), motion.start)
    end_hz = reader.frequency(("multisine", "to"), motion.end)
    period_s = reader.positive(("multisine", "period"), motion.period, "s")
    if not start_hz < end_hz:
        raise reader.error(
            ("multisine", "to"), f"'{motion.end}'", f"a frequency above 'from', {start_hz:g} Hz"
        )
    if period_s * end_hz > MOST_WAVES_OF_PERIOD:
        raise reader.error(
            ("multisine", "period"),
            f"a period of {period_s:g} s, {period_s * end_hz:.6g} waves of its highest line",
            f"at most {MOST_WAVES_OF_PERIOD} waves, {MOST_WAVES_OF_PERIOD / end_hz:g} s",
        )
    _check_waves(reader, "multisine", situation, end_hz, fade_s)
    ratio = (end_hz / start_hz) ** (1.0 / (motion.lines - 1))
    harmonics = tuple(
        sorted({round(start_hz * ratio**i * period_s) for i in range(motion.lines)} - {0})
    )
    if len(harmonics) < motion.lines:
        raise reader.error(
            ("multisine", "lines"),
            f"{motion.lines} lines of which only {len(harmonics)} differ at a period of"
            f" {period_s:g} s",
            "fewer lines, a wider band or a longer period",
        )
    return oscillations.Multisine(
        mean, amplitude, harmonics, period_s, situation.duration_s, fade_s, situation.seed
    )


def _step(reader: Reader, motion: Step, situation: Situation) -> Profile:
    coordinate = situation.coordinate
    levels = [
        reader.position(("step", "levels", i), level, coordinate)
        for i, level in enumerate(motion.levels)
    ]
    rise_s = reader.cycles(("step", "rise"), motion.rise) * reader.rig.period_s
    dwell_s = reader.cycles(("step", "dwell"), motion.dwell) * reader.rig.period_s
    return profiles.Step(situation.start, levels * motion.times, dwell_s, rise_s)


def _staircase(reader: Reader, motion: Staircase, situation: Situation) -> Profile:
    coordinate = situation.coordinate
    start = reader.position(("staircase", "from"), motion.start, coordinate)
    end = reader.position(("staircase", "to"), motion.end, coordinate)
    levels = [start + (end - start) * i / motion.steps for i in range(motion.steps)] + [end]
    levels += levels[-2::-1] if motion.back else []
    speed = reader.speed(("staircase", "speed"), motion.speed, coordinate)
    acceleration = reader.acceleration(
        ("staircase", "acceleration"), motion.acceleration, coordinate
    )
    dwell_s = reader.positive(("staircase", "dwell"), motion.dwell, "s")
    return profiles.Staircase(situation.start, levels, dwell_s, speed, acceleration)

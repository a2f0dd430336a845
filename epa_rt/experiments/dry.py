"""A run without a rig: every reference over time, what it reaches, and whether the rig can
follow.
"""

from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.experiments.experiment import Experiment, Phase
from epa_rt.experiments.profiles import Profile
from epa_rt.experiments.reader import show

AT_ONCE = 200_000  # cycles of a phase that are sampled together
MOST_KEPT = 2_000_000  # points of a run that are kept for its picture, 48 MB
FEWEST_KEPT = 200  # of each phase


@dataclass(frozen=True)
class DryPhase:
    """One phase as planned: times in s since the run began, references in SI, what they reach.

    ``start_s`` and ``duration_s`` are estimates from the first phase on whose end hangs on the rig.
    Of a long phase the arrays hold the lowest and the highest point of each stretch, for a picture;
    the figures are of every cycle.
    """

    phase: Phase
    start_s: float
    duration_s: float
    t_s: np.ndarray
    positions: np.ndarray
    speeds: np.ndarray
    low: float
    high: float
    speed_peak: float
    acceleration_peak: float


@dataclass(frozen=True)
class DryRun:
    """All phases in order; ``findings`` are sentences about what the rig cannot follow, none where
    all is well.
    """

    experiment: Experiment
    phases: tuple[DryPhase, ...]
    findings: tuple[str, ...]

    @property
    def duration_s(self) -> float:
        return sum(phase.duration_s for phase in self.phases)

    def speed_peak(self, loop: str) -> float:
        """Largest |speed| of the reference in a loop (SI per s)."""
        return max((p.speed_peak for p in self.phases if p.phase.loop == loop), default=0.0)


def dry_run(experiment: Experiment, rig: Rig) -> DryRun:
    """Samples every phase at the rig's period, some of it at a time. A start that only the run
    will tell is taken as the phase's end.
    """
    phases, findings = [], []
    positions: dict[str, float] = {}
    start_s = 0.0
    kept = max(FEWEST_KEPT, MOST_KEPT // len(experiment.phases))
    for phase in experiment.phases:
        key = phase.coordinate.position_key
        start = phase.motion.planned_start
        if start is None:
            start = positions.get(
                key, phase.motion.end if phase.motion.end is not None else _somewhere(phase)
            )
        profile = phase.profile(start)
        dry = _sampled(phase, profile, start_s, rig.period_s, kept)
        positions[key] = profile.end
        start_s += dry.duration_s
        phases.append(dry)
        findings += _findings(dry, rig)
    return DryRun(experiment, tuple(phases), tuple(dict.fromkeys(findings)))


def _somewhere(phase: Phase) -> float:
    low, high = phase.coordinate.limits
    return min(max(0.0, low), high)


def _sampled(
    phase: Phase, profile: Profile, start_s: float, period_s: float, kept: int
) -> DryPhase:
    duration_s = max(phase.duration_s, profile.duration_s, period_s)
    count = round(duration_s / period_s)
    stretch = -(-count // kept) if count > kept else 1  # cycles of which two points are kept
    at_once = max(1, AT_ONCE // stretch) * stretch
    low, high, speed = np.inf, -np.inf, 0.0
    shown: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for first in range(0, count, at_once):
        t_s = np.arange(first, min(first + at_once, count)) * period_s
        positions, speeds = profile.sample(t_s)
        low, high = min(low, float(positions.min())), max(high, float(positions.max()))
        speed = max(speed, float(np.abs(speeds).max()))
        chosen = _ends_of_stretches(positions, stretch)
        shown.append((t_s[chosen], positions[chosen], speeds[chosen]))
    t_s, positions, speeds = (np.concatenate(parts) for parts in zip(*shown, strict=True))
    return DryPhase(
        phase,
        start_s,
        duration_s,
        start_s + t_s,
        positions,
        speeds,
        low,
        high,
        speed,
        profile.peaks.acceleration,
    )


def _ends_of_stretches(positions: np.ndarray, stretch: int) -> np.ndarray | slice:
    """Indices of the lowest and the highest point of each stretch, in order of time."""
    if stretch == 1:
        return slice(None)
    starts = np.arange(0, positions.size, stretch)
    padded = np.full(starts.size * stretch, positions[-1])
    padded[: positions.size] = positions
    rows = padded.reshape(-1, stretch)
    ends = np.sort(np.stack([rows.argmin(axis=1), rows.argmax(axis=1)]), axis=0) + starts
    return np.unique(np.minimum(ends, positions.size - 1))


def _findings(dry: DryPhase, rig: Rig) -> list[str]:
    coordinate = dry.phase.coordinate
    si_unit, (low, high) = coordinate.si_unit, coordinate.limits
    findings = []
    if dry.low < low - 1e-12 or dry.high > high + 1e-12:
        findings.append(
            f"{dry.phase.key}: goes from {show(dry.low, si_unit)} to {show(dry.high, si_unit)}, "
            f"the rig allows {show(low, si_unit)} to {show(high, si_unit)}"
        )
    allowed = [
        (dry.speed_peak, coordinate.speed_max, "a speed", "/s", "the rig allows"),
        (
            dry.acceleration_peak,
            coordinate.acceleration_max,
            "an acceleration",
            "/s^2",
            "the rig allows",
        ),
    ]
    allowed += _command_limits(dry, rig)
    for peak, highest, what, rate, who in allowed:
        if peak > highest * (1.0 + 1e-6):
            findings.append(
                f"{dry.phase.key}: reaches {what} of {show(peak, si_unit, rate)}, {who}"
                f" {show(highest, si_unit, rate)}"
            )
    return findings


def _command_limits(dry: DryPhase, rig: Rig) -> list[tuple[float, float, str, str, str]]:
    """Limits and slews of the command rows, which clamp what a motor loop asks for."""
    motor = rig.motor
    limits: list[tuple[float, float, str, str, str]] = []
    if dry.phase.loop not in ("motor_position", "motor_speed"):
        return limits
    if dry.phase.loop == "motor_position" and motor.position_target:
        row = rig.row(motor.position_target)
        if row.slew:
            limits.append((dry.speed_peak, row.slew, "a speed", "/s", f"{row.name} slews at"))
    elif motor.speed_target:
        row = rig.row(motor.speed_target)
        if row.limits:
            limits.append(
                (
                    dry.speed_peak,
                    min(abs(x) for x in row.limits),
                    "a speed",
                    "/s",
                    f"{row.name} is limited to",
                )
            )
        if row.slew:
            limits.append(
                (dry.acceleration_peak, row.slew, "an acceleration", "/s^2", f"{row.name} slews at")
            )
    return limits

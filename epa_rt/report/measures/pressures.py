"""What pressure each trial began with, and what became of it."""

from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig import Muscle
from epa_rt.report.measures.valves import last_switching
from epa_rt.report.run import Run, Span

SETTLED_S = 0.5
TOLERANCE_PA = 2000.0
MOVED_M = 0.0005


@dataclass(frozen=True)
class TrialPressure:
    """One muscle in one trial, absolute Pa. ``when_set_pa``: at the end of the last phase that set
    it.

    ``start_pa``: over the last ``SETTLED_S`` before the trial without a switching. ``moved``: the
    motor took the muscle elsewhere between the two. ``drift_pa``: change over the trial with the
    motion taken out.
    """

    trial: Span
    muscle: str
    target_pa: float
    when_set_pa: float
    start_pa: float
    moved: bool
    drift_pa: float
    low_pa: float
    high_pa: float

    @property
    def error_pa(self) -> float:
        """When set, against the target."""
        return self.when_set_pa - self.target_pa

    @property
    def start_error_pa(self) -> float:
        """At the trial's start, against the target."""
        return self.start_pa - self.target_pa


def trial_pressures(run: Run, trial: Span) -> list[TrialPressure]:
    """Each muscle of the rig in one trial."""
    return [_of(run, trial, muscle) for muscle in run.rig.muscles]


def _of(run: Run, trial: Span, muscle: Muscle) -> TrialPressure:
    pressure = run.signals[muscle.pressure]
    inside = pressure[trial.samples]
    target = run.signals[f"ref_{muscle.pressure}"][trial.begin]
    set_until, travel = _set_until(run, trial, muscle), run.signals[run.rig.motor.position]
    moved = (
        abs(float(travel[trial.begin] - travel[set_until - 1])) > MOVED_M if set_until else False
    )
    return TrialPressure(
        trial,
        muscle.name,
        float(target),
        settled_mean(run, muscle, set_until),
        settled_mean(run, muscle, trial.begin),
        moved,
        drift(run, trial, inside),
        _least(inside, np.fmin),
        _least(inside, np.fmax),
    )


def settled_mean(run: Run, muscle: Muscle, end: int) -> float:
    """Mean pressure in Pa over the last ``SETTLED_S`` before a sample, or since the last switching
    where that is later.
    """
    begin = max(end - round(SETTLED_S / run.period_s), last_switching(run, muscle, end), 0)
    window = run.signals[muscle.pressure][begin:end]
    return float(np.nanmean(window)) if np.isfinite(window).any() else float("nan")


def drift(run: Run, trial: Span, pressure: np.ndarray) -> float:
    """Change in Pa over a trial: the part of a fit on time, position and position squared that goes
    with time.
    """
    coordinate = trial.phase.coordinate
    x = (
        run.signals[coordinate.measured][trial.samples]
        if coordinate.measured
        else np.zeros(len(pressure))
    )
    good = np.isfinite(x) & np.isfinite(pressure)
    step = max(1, int(good.sum()) // 50_000)
    x, pressure = x[good][::step], pressure[good][::step]
    if len(x) < 10:
        return float("nan")
    x = (x - x.mean()) / (x.std() or 1.0)
    time = np.linspace(-0.5, 0.5, len(x))
    columns = np.column_stack([time, np.ones(len(x)), x, x * x])
    return float(np.linalg.lstsq(columns, pressure, rcond=None)[0][0])


def _set_until(run: Run, trial: Span, muscle: Muscle) -> int:
    """End of the last phase before the trial in which the muscle's pressure was set or trimmed;
    else the trial's begin.
    """
    for span in reversed([span for span in run.phases if span.end <= trial.begin]):
        orders = span.phase.orders if span.phase else ()
        if any(
            order.muscle == muscle.name and order.word in ("set", "hold_and_trim")
            for order in orders
        ):
            return span.end
    return trial.begin


def _least(values: np.ndarray, choose: np.ufunc) -> float:
    return float(choose.reduce(values)) if len(values) else float("nan")

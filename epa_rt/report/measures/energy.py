"""The electrical proxy of the study: the integral of the squared motor current, its equation 9."""

from dataclasses import dataclass

import numpy as np

from epa_rt.report.measures.tracking import Periods
from epa_rt.report.run import NotShown, Run, Span


@dataclass(frozen=True)
class TrialEnergy:
    """Over one trial: integral of I² dt in A² s, and its mean over time in A²."""

    trial: Span
    integral_a2_s: float
    mean_a2: float
    peak_a: float


def current_of(run: Run) -> np.ndarray:
    """The measured motor current in A. Raises NotShown where the rig measures none."""
    name = run.rig.motor.current
    if name is None:
        raise NotShown("this rig measures no motor current")
    return run.signals[name]


def trial_energy(run: Run, trial: Span) -> TrialEnergy:
    """Raises NotShown where the rig measures no current."""
    current = current_of(run)[trial.samples]
    good = current[np.isfinite(current)]
    integral = float(np.sum(good**2) * run.period_s)
    duration_s = len(good) * run.period_s
    return TrialEnergy(
        trial,
        integral,
        integral / duration_s if duration_s else float("nan"),
        float(np.max(np.abs(good))) if len(good) else float("nan"),
    )


def energy_of_periods(run: Run, periods: Periods) -> np.ndarray:
    """Integral of I² dt over each period, in A² s."""
    squared = np.nan_to_num(current_of(run)) ** 2 * run.period_s
    total = np.concatenate([[0.0], np.cumsum(squared)])
    return total[periods.ends] - total[periods.begins]

"""What the knee study finds: the nine conditions, the catalogue over the whole grid, and the price
of one fixed setting.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from epa_rt.study import grid
from epa_rt.study.knee import NONE, Knee, Periods, experiment_text, periods, saved_ratio, smooth
from epa_rt.study.motion import NAMES, Drive, point

Runner = Callable[[Path, str], tuple[dict[str, np.ndarray], float]]
CATALOGUE_DRIVE = Drive(
    (40.0, 400.0, 1.0), step_s=5e-4, settle_periods=6
)  # stiffer than the paper's: motions then differ by 1 %, energies compare
FOLLOWED_RATIO = 0.9
BIN_HZ = 0.1


@dataclass(frozen=True)
class Conditions:
    """Periods per condition (SPAM, PPAM; Pa, 0: none)."""

    asked: Knee
    of: dict[tuple[float, float], Periods]

    def saved(self, spam_pa: float, ppam_pa: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequency (Hz) and saved energy (ratio, positive: saved), in bins."""
        mine, none = self.of[spam_pa, ppam_pa], self.of[spam_pa, NONE]
        ratio = saved_ratio(mine, none)
        return smooth(mine.hz[: len(ratio)], ratio, BIN_HZ)

    def swing(self, spam_pa: float, ppam_pa: float) -> tuple[np.ndarray, np.ndarray]:
        """Frequency (Hz) and achieved swing over the wanted one, in bins."""
        mine = self.of[spam_pa, ppam_pa]
        return smooth(mine.hz, mine.swing_rad / self.asked.peak_to_peak_rad, BIN_HZ)

    def crossings_hz(self, spam_pa: float) -> np.ndarray:
        """Frequencies at which the least and the largest parallel pressure change places in what
        they save.
        """
        hz, low = self.saved(spam_pa, float(self.asked.ppam_pa.min()))
        apart = self.saved(spam_pa, float(self.asked.ppam_pa.max()))[1] - low
        at = np.flatnonzero(np.sign(apart[1:]) != np.sign(apart[:-1]))
        return hz[at] + (hz[at + 1] - hz[at]) * apart[at] / (apart[at] - apart[at + 1])


@dataclass(frozen=True)
class Catalogue:
    """Figures of motion.Found over (frequency, SPAM, PPAM)."""

    asked: Knee
    of: dict[str, np.ndarray]

    def effort(self) -> np.ndarray:
        """Mean of I^2 (A^2), infinite where the knee does not follow."""
        hz = self.asked.catalogue_rad_s[:, None, None] / (2.0 * np.pi)
        lever_swing = self.of["motion_m"] / self.wanted_m
        good = np.isfinite(self.of["energy_a2_s"]) & (lever_swing >= FOLLOWED_RATIO)
        return np.where(good, self.of["energy_a2_s"] * hz, np.inf)

    @property
    def wanted_m(self) -> float:
        return self.of["wanted_m"].item()

    def best(self) -> list[tuple[float, float, float]]:
        """Per frequency: SPAM (Pa), PPAM (Pa), mean I^2 (A^2)."""
        effort = self.effort()
        rows = [np.unravel_index(one.argmin(), one.shape) for one in effort]
        return [
            (
                float(self.asked.catalogue_spam_pa[i]),
                float(self.asked.catalogue_ppam_pa[j]),
                float(effort[k, i, j]),
            )
            for k, (i, j) in enumerate(rows)
        ]

    def fixed(self) -> tuple[float, float, np.ndarray]:
        """The one setting with the least sum of effort over the frequencies: SPAM, PPAM (Pa), its
        effort per frequency (A^2).
        """
        effort = self.effort()
        i, j = np.unravel_index(effort.sum(axis=0).argmin(), effort.shape[1:])
        return (
            float(self.asked.catalogue_spam_pa[i]),
            float(self.asked.catalogue_ppam_pa[j]),
            effort[:, i, j],
        )


def at_condition(runner: Runner, asked: Knee, at: grid.Point) -> grid.Found:
    """The task of the nine conditions; ``at``: SPAM, PPAM (Pa)."""
    columns, period_s = runner(asked.rig, experiment_text(asked, *at))
    found = periods(asked, columns["motor_current_a"], columns["knee_angle_rad"], period_s)
    return {
        "hz": found.hz.tolist(),
        "energy_a2_s": found.energy_a2_s.tolist(),
        "swing_rad": found.swing_rad.tolist(),
        "peak_current_a": found.peak_current_a.tolist(),
    }


def run_conditions(
    asked: Knee,
    runner: Runner,
    version: bytes,
    folder: Path | None,
    jobs: int,
    progress=lambda stage, share: None,
) -> Conditions:
    """All conditions through the loop. ``version`` stands for rig, plant and code of the loop.
    Raises GridError.
    """
    key = grid.key_of(
        "knee", version, asked.peak_to_peak_rad, asked.from_hz, asked.to_hz, asked.seconds
    )
    found = grid.solve(
        functools.partial(at_condition, runner, asked),
        asked.conditions,
        grid.Store(folder, "knee", key),
        grid.How(jobs, threads=False, chunk=1),
        progress,
        "conditions through the loop",
    )
    return Conditions(
        asked,
        {
            at: Periods(
                *(
                    np.array(one[name])
                    for name in ("hz", "energy_a2_s", "swing_rad", "peak_current_a")
                )
            )
            for at, one in zip(asked.conditions, found, strict=True)
        },
    )


def at_setting(params: np.ndarray, amplitude_m: float, at: grid.Point) -> grid.Found:
    """The task of the catalogue; ``at``: SPAM, PPAM (Pa), frequency (rad/s)."""
    return point(params, (at[0], at[1]), 0.0, amplitude_m, at[2], CATALOGUE_DRIVE).as_dict()


@dataclass(frozen=True)
class EqualMotion:
    """The conditions again on the compiled plant, whose servo gives all of them the same motion:
    arrays (frequency,) per condition.
    """

    asked: Knee
    energy_a2_s: dict[tuple[float, float], np.ndarray]
    motion_ratio: np.ndarray

    def saved(self, spam_pa: float, ppam_pa: float) -> np.ndarray:
        return 1.0 - self.energy_a2_s[spam_pa, ppam_pa] / self.energy_a2_s[spam_pa, NONE]


def run_equal_motion(asked: Knee, params: np.ndarray, how: grid.How) -> EqualMotion:
    """The conditions at the catalogue's frequencies. Raises GridError."""
    amplitude_m = 0.5 * asked.peak_to_peak_rad * float(params["load"]["lever_m"][0])
    vented_pa = float(params["gas"]["atmosphere_pa"][0, 1])
    points = [
        (s, p or vented_pa, float(w)) for s, p in asked.conditions for w in asked.catalogue_rad_s
    ]
    found = grid.solve(
        functools.partial(at_setting, params, amplitude_m), points, grid.Store(None, "", ""), how
    )
    shape = (len(asked.conditions), len(asked.catalogue_rad_s))
    energy, motion = (
        np.array([one[name] for one in found]).reshape(shape)
        for name in ("energy_a2_s", "motion_m")
    )
    return EqualMotion(
        asked, dict(zip(asked.conditions, energy, strict=True)), motion / (2.0 * amplitude_m)
    )


def run_catalogue(
    asked: Knee,
    params: np.ndarray,
    folder: Path | None,
    how: grid.How,
    progress=lambda stage, share: None,
) -> Catalogue:
    """The whole grid by the compiled plant. Raises GridError."""
    amplitude_m = 0.5 * asked.peak_to_peak_rad * float(params["load"]["lever_m"][0])
    axes = (asked.catalogue_rad_s, asked.catalogue_spam_pa, asked.catalogue_ppam_pa)
    points = [(float(s), float(p), float(w)) for w in axes[0] for s in axes[1] for p in axes[2]]
    key = grid.key_of("catalogue", params.tobytes(), amplitude_m, CATALOGUE_DRIVE)
    found = grid.solve(
        functools.partial(at_setting, params, amplitude_m),
        points,
        grid.Store(folder, "knee-catalogue", key),
        how,
        progress,
        "catalogue",
    )
    shape = tuple(map(len, axes))
    return Catalogue(
        asked,
        {name: np.array([one[name] for one in found]).reshape(shape) for name in NAMES}
        | {"wanted_m": np.array(2.0 * amplitude_m)},
    )

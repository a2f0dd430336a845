"""One plant, four wirings: the motor with a muscle in series, beside it, both, or a pair that pulls
against each other.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from epa_rt.models.blocks.muscle import NO_LOAD
from epa_rt.models.plant_file import PlantFile
from epa_rt.study import grid
from epa_rt.study.motion import NAMES, Drive, point
from epa_rt.study.setting import load_setting

KEYS = ("plant", "mean", "amplitude", "pressure", "frequency")
NAMES_OF = ("serial", "parallel", "both", "antagonistic")
GOALS = {
    "stroke_m": "motor's stroke",
    "peak_power_w": "peak of |F v| at the spool",
    "mean_i2_a2": "mean of I²",
}
FOLLOWED_RATIO = 0.9
PARALLEL_STRETCH_M = (
    0.015  # of the parallel muscle past no-load length at the mean: half its way to a 15 cm lock
)
STRAP_N_M, STRAP_N_S_M = 1e5, 50.0


@dataclass(frozen=True)
class Arrangements:
    """What is asked: the plant whose muscle 0 serves for all, the sine (m), pressures (Pa
    absolute), frequencies (rad/s).
    """

    plant: PlantFile
    mean_m: float
    amplitude_m: float
    pressure_pa: np.ndarray
    frequency_rad_s: np.ndarray


@dataclass(frozen=True)
class Compared:
    """Per arrangement the figures over (frequency, pressure of muscle 0, of muscle 1); one long
    where there is no such muscle.
    """

    asked: Arrangements
    of: dict[str, dict[str, np.ndarray]]

    def least(self, name: str, goal: str) -> list[tuple[float, float, float]]:
        """Per frequency: the least of ``goal`` among points that follow the sine, and the two
        pressures (Pa, NaN: no such muscle).
        """
        figures = self.of[name]
        follows = figures["motion_m"] >= FOLLOWED_RATIO * 2.0 * self.asked.amplitude_m
        values = np.where(follows & np.isfinite(figures[goal]), figures[goal], np.inf)
        rows = []
        for one in values:
            i, j = np.unravel_index(one.argmin(), one.shape)
            found = float(one[i, j])
            p0, p1 = pressures_of(name, self.asked.pressure_pa)
            rows.append(
                (found, float(p0[i]), float(p1[j]))
                if np.isfinite(found)
                else (np.nan, np.nan, np.nan)
            )
        return rows


def wired(plant: PlantFile, name: str) -> np.ndarray:
    """Parameters of the plant's muscle in one of NAMES_OF, under the same load.

    Muscle 0 hangs between spool and load. Parallel: it is a strap instead, and muscle 1 hangs
    between frame and load. Both: both. Antagonistic: muscle 1 is its mirror, lengthened where
    muscle 0 is shortened by spool and load alike.
    """
    params = plant.params.copy()
    load, muscle = params["load"][0], params["muscle"][0]
    no_load_m = float(muscle[0]["braid_length_m"]) * NO_LOAD
    params["gas"][0, 1], muscle[1] = params["gas"][0, 0], muscle[0].copy()
    load["travel0_ratio"], load["load0_ratio"], load["rest0_m"] = 1.0, 1.0, no_load_m
    muscle[1]["present"] = 0.0 if name == "serial" else 1.0
    if name == "parallel":
        (
            muscle[0]["lock_length_m"],
            muscle[0]["lock_stiffness_n_m"],
            muscle[0]["lock_viscous_n_s_m"],
        ) = (no_load_m, STRAP_N_M, STRAP_N_S_M)
    if name in ("parallel", "both"):
        load["travel1_ratio"], load["load1_ratio"], load["rest1_m"] = (
            0.0,
            1.0,
            no_load_m + PARALLEL_STRETCH_M,
        )
    elif name == "antagonistic":
        load["travel1_ratio"], load["load1_ratio"], load["rest1_m"] = (
            -1.0,
            -1.0,
            no_load_m + 2.0 * PARALLEL_STRETCH_M,
        )
    return params


def pressures_of(name: str, pressure_pa: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pressures of muscle 0 and 1 in an arrangement; [NaN] where that muscle is missing or a
    strap.
    """
    none = np.array([np.nan])
    return {"serial": (pressure_pa, none), "parallel": (none, pressure_pa)}.get(
        name, (pressure_pa, pressure_pa)
    )


def load_arrangements(path: Path) -> Arrangements:
    """Raises ConfigError."""
    said = load_setting(path, "arrangements", KEYS)
    plant = said.plant("plant")
    if plant.params["load"]["kind_code"][0] != 1.0:
        raise said.source.error(
            ("plant",), f"'{plant.name}', whose load is no mass", "a plant with load: kind_code: 1"
        )
    atmosphere_pa = float(plant.params["gas"]["atmosphere_pa"][0, 0])
    return Arrangements(
        plant,
        said.quantity("mean", "m", -1.0, 1.0),
        said.quantity("amplitude", "m", 1e-4, 0.1),
        said.pressures("pressure", atmosphere_pa),
        said.frequencies("frequency"),
    )


def at_setting(params: np.ndarray, mean_m: float, amplitude_m: float, at: grid.Point) -> grid.Found:
    """The task; ``at``: pressures of muscle 0 and 1 (Pa), frequency (rad/s)."""
    found = point(params, (at[0], at[1]), mean_m, amplitude_m, at[2], Drive()).as_dict()
    return found | {"mean_i2_a2": found["energy_a2_s"] * at[2] / (2.0 * np.pi)}


def compare(
    asked: Arrangements,
    folder: Path | None = None,
    how: grid.How = grid.How(),
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> Compared:
    """All four over their pressures and the frequencies. Raises GridError."""
    of = {}
    for name in NAMES_OF:
        params = wired(asked.plant, name)
        atmosphere_pa = float(params["gas"]["atmosphere_pa"][0, 0])
        axes = (
            asked.frequency_rad_s,
            *(
                np.where(np.isnan(p), atmosphere_pa, p)
                for p in pressures_of(name, asked.pressure_pa)
            ),
        )
        points = [
            (float(p0), float(p1), float(w)) for w in axes[0] for p0 in axes[1] for p1 in axes[2]
        ]
        task = functools.partial(at_setting, params, asked.mean_m, asked.amplitude_m)
        store = grid.Store(
            folder,
            f"arrangement-{name}",
            grid.key_of(params.tobytes(), asked.mean_m, asked.amplitude_m),
        )
        found = grid.solve(task, points, store, how, progress, name)
        of[name] = {
            figure: np.array([one[figure] for one in found]).reshape(tuple(map(len, axes)))
            for figure in (*NAMES, "mean_i2_a2")
        }
    return Compared(asked, of)

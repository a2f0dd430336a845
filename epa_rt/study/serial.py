"""The serial study (Figs 5 to 8): a mass on muscle and motor, over no-load pressure and frequency
of the wanted sine.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from epa_rt.models.plant_file import PlantFile
from epa_rt.study import grid
from epa_rt.study.motion import LAG_S, NAMES, PID, STEP_S, Drive, point
from epa_rt.study.setting import load_setting

KEYS = (
    "plant",
    "beside",
    "mean",
    "amplitude",
    "pressure",
    "frequency",
    "kp",
    "ki",
    "kd",
    "servo_lag",
)
FOLLOWED_RATIO = (
    0.9  # of the wanted motion: a point that achieves less is no candidate for the best pressure
)
STEPS_PER_LAG = 10
# eq. (8) is so strongly damped at low pressure that the PID's derivative needs shorter steps
POLYNOMIAL_STEP_S = 4e-5


@dataclass(frozen=True)
class Serial:
    """What is asked. Pressures absolute (Pa) at no-load length, frequencies in rad/s, mean (m) and
    amplitude (m) of the mass.
    """

    name: str
    plant: PlantFile
    beside: tuple[PlantFile, ...]
    mean_m: float
    amplitude_m: float
    pressure_pa: np.ndarray
    frequency_rad_s: np.ndarray
    drive: Drive


@dataclass(frozen=True)
class Maps:
    """What was found: one array (frequencies, pressures) per figure of motion.Found."""

    asked: Serial
    of: dict[str, np.ndarray]

    def best(self, figure: str) -> np.ndarray:
        """Index of the pressure, per frequency, with the least of ``figure`` among those that
        follow the sine; -1 where none does.
        """
        follows = self.of["motion_m"] >= FOLLOWED_RATIO * 2.0 * self.asked.amplitude_m
        values = np.where(follows & np.isfinite(self.of[figure]), self.of[figure], np.inf)
        return np.where(np.isfinite(values).any(axis=1), values.argmin(axis=1), -1)

    def best_pressure_pa(self, figure: str) -> np.ndarray:
        """The same as absolute pressure (Pa), NaN where none follows."""
        best = self.best(figure)
        return np.where(best >= 0, self.asked.pressure_pa[best], np.nan)

    def at_best(self, figure: str, shown: str | None = None) -> np.ndarray:
        """``shown`` (default: figure itself) at the best pressure of ``figure``, per frequency."""
        best = self.best(figure)
        return np.where(best >= 0, self.of[shown or figure][np.arange(len(best)), best], np.nan)


def load_serial(path: Path) -> Serial:
    """Reads a study file. Raises ConfigError."""
    said = load_setting(path, "serial", KEYS)
    plant = said.plant("plant")
    if plant.params["load"]["kind_code"][0] != 1.0:
        raise said.source.error(
            ("plant",), f"'{plant.name}', whose load is no mass", "a plant with load: kind_code: 1"
        )
    beside = said.plants("beside")
    for i, one in enumerate(beside):
        if one.params["load"]["kind_code"][0] != 1.0:
            raise said.source.error(
                ("beside", i),
                f"'{one.name}', whose load is no mass",
                "a plant with load: kind_code: 1",
            )
        if one.name in (plant.name, *(other.name for other in beside[:i])):
            raise said.source.error(
                ("beside", i),
                f"a second plant named '{one.name}'",
                "plants that name themselves apart ('plant:' in their files)",
            )
    atmosphere_pa = float(plant.params["gas"]["atmosphere_pa"][0, 0])
    lag = said.quantity("servo_lag", "s", 1e-4, 0.1, LAG_S)
    pid = (
        said.quantity("kp", "1", 0.0, 1e3, PID[0]),
        said.quantity("ki", "1/s", 0.0, 1e5, PID[1]),
        said.quantity("kd", "s", 0.0, 10.0, PID[2]),
    )
    return Serial(
        path.stem,
        plant,
        beside,
        said.quantity("mean", "m", -1.0, 1.0),
        said.quantity("amplitude", "m", 1e-4, 0.1),
        said.pressures("pressure", atmosphere_pa),
        said.frequencies("frequency"),
        Drive(pid, lag, min(STEP_S, lag / STEPS_PER_LAG)),
    )


def at_point(
    params: np.ndarray, mean_m: float, amplitude_m: float, drive: Drive, at: grid.Point
) -> dict[str, float]:
    """The task of the grid; ``at``: absolute pressure (Pa), frequency (rad/s)."""
    pressure_pa, omega = at
    return point(
        params,
        (pressure_pa, float(params["gas"]["atmosphere_pa"][0, 1])),
        mean_m,
        amplitude_m,
        omega,
        drive,
    ).as_dict()


def solve(
    asked: Serial,
    folder: Path | None = None,
    how: grid.How = grid.How(),
    progress: Callable[[str, float], None] = lambda stage, share: None,
    plant: PlantFile | None = None,
) -> Maps:
    """Every point of the maps, of ``plant`` (default: the study's own). Raises GridError."""
    plant = plant or asked.plant
    drive = asked.drive
    if plant.params["muscle"]["law_code"][0, 0] == 2.0:
        drive = replace(drive, step_s=min(drive.step_s, POLYNOMIAL_STEP_S))
    points = [(float(p), float(w)) for w in asked.frequency_rad_s for p in asked.pressure_pa]
    task = functools.partial(at_point, plant.params, asked.mean_m, asked.amplitude_m, drive)
    key = grid.key_of("serial", plant.params.tobytes(), asked.mean_m, asked.amplitude_m, drive)
    found = grid.solve(
        task, points, grid.Store(folder, f"serial-{plant.name}", key), how, progress, plant.name
    )
    shape = (len(asked.frequency_rad_s), len(asked.pressure_pa))
    return Maps(
        asked, {name: np.array([one[name] for one in found]).reshape(shape) for name in NAMES}
    )

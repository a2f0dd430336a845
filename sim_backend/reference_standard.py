"""A reference at a simulated rig's sensor: a mass hung on the cell, a jig that holds the joint, or
a gauge beside it that reads the truth.
"""

import numpy as np

from epa_rt.models import plant as nominal_physics
from epa_rt.models.blocks.instruments import bowed, warmed
from epa_rt.models.blocks.sensors import reading
from epa_rt.models.ports import SENSORS

_CHANNELS = {name: i for i, name in enumerate(SENSORS.names or ())}
# port: (parameter of its bend, of its drift, of its warm-up)
_CURVES = {
    "force_n": ("force_bow_per_n", "force_drift_n", "force_warm_up_s"),
    "muscle0_gauge_pa": ("muscle0_gauge_bow_per_pa", "muscle0_gauge_drift_pa", "gauge_warm_up_s"),
    "muscle1_gauge_pa": ("muscle1_gauge_bow_per_pa", "muscle1_gauge_drift_pa", "gauge_warm_up_s"),
}


class ReferenceStandard:
    """Physics for a RigModel: the plant's own, but the sensor at ``port`` feels ``applied`` (SI,
    gauge) where that is not None. The sensor's gain, zero, bend, drift and noise stay the plant's.
    """

    def __init__(self, port: str):
        self.port = port
        self.applied: float | None = None
        self._truth = float("nan")

    @property
    def truth(self) -> float:
        """What the sensor feels, in SI; gauge for a pressure."""
        return self._truth if self.applied is None else self.applied

    @staticmethod
    def new_state(params: np.ndarray) -> np.ndarray:
        return nominal_physics.new_state(params)

    def advance(
        self,
        params: np.ndarray,
        state: np.ndarray,
        command: np.ndarray,
        sensors: np.ndarray,
        period_s: float,
        substeps: int,
    ) -> None:
        """One cycle of the plant, then the sensor's reading of what is applied."""
        nominal_physics.advance(params, state, command, sensors, period_s, substeps)
        self._truth = self._true_value(params, state)
        if self.applied is None:
            return
        p, cycle = params["sensors"][0], int(state["cycle"][0]) - 1
        stem = self.port.rsplit("_", 1)[0]
        unit = self.port.rsplit("_", 1)[1]
        value = float(self.applied)
        if self.port in _CURVES:
            bow, drift, warm_up = _CURVES[self.port]
            value = bowed(value, p[bow]) + warmed(p[drift], p[warm_up], cycle, period_s)
        sensors[self.port] = reading(
            int(p["seed"]),
            cycle,
            _CHANNELS[self.port],
            value,
            p[f"{stem}_gain_ratio"],
            p[f"{stem}_offset_{unit}"],
            p[f"{stem}_noise_{unit}"],
        )

    def _true_value(self, params: np.ndarray, state: np.ndarray) -> float:
        truth = state["truth"][0]
        if self.port == "force_n":
            return float(np.ravel(truth["muscle_force_n"])[0])
        if self.port in ("muscle0_gauge_pa", "muscle1_gauge_pa"):
            i = int(self.port[6])
            atmosphere = float(np.ravel(params["gas"]["atmosphere_pa"])[0])
            return float(np.ravel(truth["pressure_pa"])[i]) - atmosphere
        return float(np.ravel(truth["joint_angle_rad"])[0])

"""A muscle that is filled at rest: its pull must follow the pressure as its length says."""

import math

from epa_rt.config.rig import Muscle, Rig
from epa_rt.safety.gas_watch import CAUSE, Refusal
from epa_rt.safety.muscle_law import MuscleGeometry

MEAN_S = 0.2  # over which the load cell is averaged: noise and the frame's swing
FILLED_PA = 50e3  # gauge: below it a pull tells nothing of the length
MOST_N = 20.0  # below its bound a pull counts no more than so, or what follows would be late
STRETCHED_M = 0.5e-3  # the braid's finest friction turns round over less


class FillWatch:
    """``step`` once per ``dt_s``; a refusal where a fill pulls more than the length allows: travel
    counts from a wrong zero. Judged against the cell's own reading when the muscle was vented.
    """

    def __init__(self, muscle: Muscle, force: str, geometry: MuscleGeometry, rig: Rig, dt_s: float):
        sensors = rig.safety.sensors
        self._pressure, self._force, self._geometry = muscle.pressure, force, geometry
        self._exhaust = muscle.exhaust
        self._atmosphere_pa, self._vented_pa = rig.atmosphere_pa, sensors.vented
        self._travel, self._band_n = rig.motor.position, sensors.fill_band
        self._dt_s, self._follow = dt_s, dt_s / MEAN_S
        self._allowed_s, self._out_s = sensors.law_time, 0.0
        self._over_n, self._vented_n, self._vented_m = 0.0, math.nan, 0.0
        self._shortest_m = math.inf

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample. A muscle that vents is not asked: its gas runs ahead of its sensor."""
        length, force = self._geometry.length(measured), measured[self._force]
        gauge_pa = measured[self._pressure] - self._atmosphere_pa
        if length < self._shortest_m:
            self._shortest_m = length
        if gauge_pa <= self._vented_pa or self._vented_n != self._vented_n:
            if self._vented_n != self._vented_n:
                self._vented_n = force
            self._vented_n += self._follow * (force - self._vented_n)
            self._vented_m, self._over_n, self._out_s = length, 0.0, 0.0
            return None
        stretched = length > self._shortest_m + STRETCHED_M
        pulled = force - self._vented_n
        most = self._geometry.filled(gauge_pa, length, self._vented_m, stretched) + self._band_n
        over_n = max(pulled - most, -MOST_N)
        self._over_n += self._follow * (over_n - self._over_n)
        if outputs[self._exhaust]:
            self._over_n = min(self._over_n, 0.0)
        if gauge_pa < FILLED_PA or self._over_n <= 0.0 or over_n <= 0.0:
            self._out_s = 0.0
            return None
        self._out_s += self._dt_s
        if self._out_s < self._allowed_s:
            return None
        return (
            CAUSE,
            self._travel,
            f"{self._travel}: a fill to {gauge_pa / 1e3:.0f} kPa gauge pulls {pulled:.0f} N, where"
            f" {1e3 * length:.1f} mm pull at most {most:.0f} N; check the zero of {self._travel}"
            f" (home again), its calibration, {self._force} (reads high), {self._pressure} (reads"
            " low)",
        )

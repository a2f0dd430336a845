"""Sensors at rest: what a vented, unpowered rig must read before anything may move."""

import math

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import reading, reading_error
from epa_rt.safety.gas_watch import Refusal
from epa_rt.safety.muscle_law import geometry_of

CAUSE = "sensor at rest"
BLOCK_S = 0.05  # one average: fifty samples at 1 kHz leave a fifth of a converter's step
STILL_PA = 1e3  # change from one average to the next below which a pressure stands
Hint = tuple[str, str, dict[str, object]]  # kind, text, data of an event


class AtRest:
    """``step`` once per cycle of bring-up; ``done`` once pressures stand still, or the wait is
    over. Then ``refusal`` and ``hints``, events that advise to calibrate.
    """

    def __init__(self, rig: Rig):
        self._rig, self._sensors = rig, rig.safety.sensors
        self.done = False
        self.refusal: Refusal | None = None
        self.hints: list[Hint] = []
        self._names = tuple(row.name for row in rig.inputs if not row.name.endswith("_raw"))
        self._pressures = tuple(muscle.pressure for muscle in rig.muscles)
        self._block = max(round(BLOCK_S / rig.period_s), 1)
        self._blocks_max = max(math.ceil(self._sensors.wait / BLOCK_S), 2)
        self._first: dict[str, float] = {}
        self._moved: set[str] = set()
        self._sums = dict.fromkeys(self._names, 0.0)
        self._mean: dict[str, float] = {}
        self._cycles = self._blocks = 0

    def step(self, measured: dict[str, float], bus_ok: bool) -> None:
        """Takes one cycle. Without ``bus_ok`` the values are old and do not count."""
        if self.done or not bus_ok:
            return
        sums = self._sums
        for name in self._names:
            sums[name] += measured[name]
        if not self._first:
            self._first = {name: measured[name] for name in self._sensors.flicker}
        for name, first in self._first.items():
            if measured[name] != first:
                self._moved.add(name)
        self._cycles += 1
        if self._cycles >= self._block:
            self._end_block()

    def _end_block(self) -> None:
        before, self._blocks = self._mean, self._blocks + 1
        self._mean = {name: total / self._cycles for name, total in self._sums.items()}
        self._sums, self._cycles = dict.fromkeys(self._names, 0.0), 0
        if self._blocks < 2:
            return
        still = all(abs(self._mean[p] - before[p]) <= STILL_PA for p in self._pressures)
        if still or self._blocks >= self._blocks_max:
            self.done = True
            self._judge()

    def _judge(self) -> None:
        """Each reading against its band; the first one beyond it ends the run."""
        for signal, wrong, band, hint, what in self._errors():
            if not abs(wrong) <= band:
                self.refusal = self.refusal or (CAUSE, signal, f"{signal} {what}")
            elif abs(wrong) > hint:
                self.hints.append(
                    (
                        "hint",
                        f"{signal} is {reading_error(signal, wrong)} off at rest: calibrate it",
                        {"signal": signal, "error": wrong},
                    )
                )
        for name in self._sensors.flicker:
            if name not in self._moved and self.refusal is None:
                self.refusal = (
                    CAUSE,
                    name,
                    f"{name} stood still to the count for {self._blocks * BLOCK_S:.2f} s; check its"
                    " wire and its converter",
                )

    def _errors(self) -> list[tuple[str, float, float, float, str]]:
        """Signal, error in SI, band, hint, sentence where it is beyond."""
        rig, sensors, mean = self._rig, self._sensors, self._mean
        found = []
        for muscle in rig.muscles:
            read_pa = mean[muscle.pressure]
            wrong = read_pa - rig.atmosphere_pa
            found.append(
                (
                    muscle.pressure,
                    wrong,
                    sensors.vented,
                    sensors.vented_hint,
                    f"reads {wrong / 1e3:+.1f} kPa gauge with {muscle.name} vented, more than"
                    f" {sensors.vented / 1e3:g} kPa off; check the sensor (zero, calibration,"
                    f" wire), {muscle.exhaust} (does it open?), {muscle.inlet} (does it leak?)",
                )
            )
        found += self._forces()
        motor = rig.motor
        if motor.current:
            wrong = mean[motor.current]
            found.append(
                (
                    motor.current,
                    wrong,
                    sensors.current_zero,
                    sensors.current_zero_hint,
                    f"reads {wrong:+.3f} A without power, more than {sensors.current_zero:g} A;"
                    " check its wire, its calibration, the drive's monitor",
                )
            )
        if rig.joint and sensors.joint_rest:
            rest, name = sensors.joint_rest, rig.joint.position
            wrong = mean[name] - rest.at
            found.append(
                (
                    name,
                    wrong,
                    rest.band,
                    0.5 * rest.band,
                    f"reads {reading(name, mean[name])} with the muscles vented, where the joint"
                    f" lies at {reading(name, rest.at)}; check its calibration, its wire, what"
                    " holds the joint",
                )
            )
        supply_pa = next((m.valves.supply for m in rig.muscles if m.valves.supply), None)
        if sensors.supply and supply_pa:
            wrong = mean[sensors.supply] - supply_pa
            found.append(
                (
                    sensors.supply,
                    wrong,
                    sensors.supply_band * supply_pa,
                    0.5 * sensors.supply_band * supply_pa,
                    f"reads {mean[sensors.supply] / 1e3:.0f} kPa abs, where the rig file says"
                    f" {supply_pa / 1e3:.0f} kPa abs; check the regulator, the sensor",
                )
            )
        return found

    def _forces(self) -> list[tuple[str, float, float, float, str]]:
        """Rows of forces at zero; one whose muscle's law is known may be pulled by its rubber, or
        by a braid that is locked.
        """
        rig, sensors, mean = self._rig, self._sensors, self._mean
        allowed: dict[str, tuple[float, float]] = {}
        for muscle in rig.muscles:
            geometry = geometry_of(muscle, rig)
            if muscle.law is not None and geometry is not None and muscle.law.force:
                name, band = muscle.law.force, muscle.law.force_band
                low, high = geometry.pull(0.0, geometry.length(mean), mean[name])
                allowed[name] = (max(low + band, 0.0), high - band)
        found = []
        for row in rig.inputs:
            if row.si_unit != "N" or row.limits is None:
                continue
            read, most = mean[row.name], max(abs(row.limits[0]), abs(row.limits[1]))
            low, high = allowed.get(row.name, (0.0, 0.0))
            over = read - min(max(read, low), high)
            band = sensors.unloaded * most
            zero = f", the zero of {rig.motor.position} (home again)" if low > 0.0 else ""
            found.append(
                (
                    row.name,
                    over,
                    band,
                    sensors.unloaded_hint * most,
                    f"reads {read:+.1f} N with the muscles vented, more than {band:.0f} N from what"
                    f" an unloaded cell may; check its zero, its wire, what pulls at it{zero}",
                )
            )
        return found

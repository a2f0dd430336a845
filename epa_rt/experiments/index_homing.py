"""The drive's own homing on the encoder's index pulse: started, watched by its status bits,
ended.
"""

from collections.abc import Mapping

from epa_rt.config.rig import Rig
from epa_rt.config.rig_homing import IndexWay
from epa_rt.experiments.experiment import ValveOrder
from epa_rt.experiments.homing import ATTAINED, HOMING_ERROR, REFERENCED, STAND_S, TARGET_REACHED
from epa_rt.experiments.speed_plan import SpeedPlan
from epa_rt.experiments.valve_crew import Valve
from epa_rt.safety.index_guard import IndexGuard

HOME_BITS = ATTAINED | TARGET_REACHED | REFERENCED
FOLLOW_S = 0.05  # for the count to follow the bits
VENT, SEEK = range(2)


class SeekingIndex(SpeedPlan):
    """The muscles vent, then the drive seeks its index pulse (CiA 402 mode 6, method 33 or 34).

    ``go``: the drive may be told to start. ``interrupted``: it is to brake and hold. ``before`` and
    ``after``: the travel of the place where it stands at the end, by the old count and by the new.
    ``was_referenced``: whether the old count had a zero.
    """

    phase_names = ("vent", "seek index")

    def __init__(self, rig: Rig, valves: Mapping[str, Valve], guard: IndexGuard, way: IndexWay):
        super().__init__(rig, valves, way.speed)
        assert rig.drive.interface == "cia402"
        self.go = self.interrupted = self.was_referenced = False
        self.before = self.after = float("nan")
        self._sign = -1.0 if rig.motor.zero.direction == "decreasing" else 1.0
        self._guard, self._way, self._status = guard, way, rig.drive.status_word
        self._tolerance = rig.motor.zero.tolerance
        self._stand_cycles = round(STAND_S / rig.period_s)
        self._longest_cycles = round(way.longest_s / rig.period_s)
        self._follow_cycles = round(FOLLOW_S / rig.period_s)
        self._age = self._attained = 0
        self._was_clear = False  # bit 12 was 0 since the start: once set, it is by this homing

    def begin(self, measured: Mapping[str, float]) -> None:
        super().begin(measured)
        self._crew.tell(ValveOrder(name, "vent") for name in self._valves)

    def brake(self, cycle: int = -1) -> None:
        """The drive itself brakes, and holds where it stands."""
        super().brake(cycle)
        self.go, self.interrupted = False, True

    def _decide(self, measured: Mapping[str, float], cycle: int) -> None:
        self._age += 1
        travel, status = measured[self._position], int(measured[self._status])
        self._rest_at(travel)
        self._was_clear = self.go and (self._was_clear or not status & ATTAINED)
        if status & HOMING_ERROR:
            self._fail("the drive reports a homing error (status word bit 13)", cycle)
        elif self.phase_index == VENT:
            vented = all(valve.settled for valve in self._valves.values())
            if vented and self._age >= self._stand_cycles:
                self.was_referenced, self.go = bool(status & REFERENCED), True
                self._age = 0
                self._enter(SEEK, cycle)
        elif self._was_clear and status & HOME_BITS == HOME_BITS:
            self._check(travel, cycle)
        else:
            self._attained = 0
            self._seek(status, cycle)

    def _seek(self, status: int, cycle: int) -> None:
        """Nothing found yet: how far, and how long?"""
        moved, way = self._guard.moved, self._way
        if self._sign * moved < -way.landing:
            self._fail(
                f"the drive moves by {1e3 * moved:.4g} mm, against motor.zero.direction", cycle
            )
            return
        if abs(moved) > way.most and not self._guard.is_set:
            self._fail(
                f"no index pulse within {1e3 * way.most:.4g} mm (one motor turn is"
                f" {1e3 * way.turn:.4g} mm): the encoder's index channel, its wire, or motor.zero",
                cycle,
            )
        elif self._age > self._longest_cycles:
            self._fail(
                f"the drive has not attained its index pulse after {way.longest_s:.1f} s and"
                f" {1e3 * moved:.4g} mm (status 0x{status:04X}; bits 10, 12 and 15 were awaited)",
                cycle,
            )

    def _check(self, travel: float, cycle: int) -> None:
        self._attained += 1
        if abs(travel - self._way.home) <= self._tolerance:
            self.before, self.after = travel - self._guard.shift, travel
            self._finish("the drive's zero is set at its index pulse", cycle)
        elif self._attained > self._follow_cycles:
            self._fail(
                f"travel reads {1e3 * travel:.4f} mm after homing, expected"
                f" {1e3 * self._way.home:.4f} mm to {1e3 * self._tolerance:.4g} mm (the drive did"
                " not go back to its pulse, its count jumped again, or 0x30B0 is not what the rig"
                " file says)",
                cycle,
            )

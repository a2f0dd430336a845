"""Finding the place of zero: a taut strap, an end stop, or here; then setting it in the drive."""

from collections.abc import Mapping

from epa_rt.config.rig import Rig, Zero
from epa_rt.config.rig_homing import RETREAT_SHARE, room_behind
from epa_rt.experiments.experiment import ValveOrder
from epa_rt.experiments.speed_plan import SpeedPlan
from epa_rt.experiments.valve_crew import Valve

LET_GO_SHARE = 0.5  # of the force or current threshold: below it the touch is over
FELT_S = 0.02  # filter of force and current: some conversions of noise, 40 um of lag at 2 mm/s
STARTING_S = 0.2  # the current of acceleration is over by then (speed_plan.RAMP_S)
STAND_S = 0.2  # how long the motor is watched where nothing moves it
AT_REST_SPEED = 1e-3  # m/s or rad/s, where no homing speed is given
FILL, RETREAT, APPROACH, RETURN, VENT = range(5)

TARGET_REACHED, ATTAINED, HOMING_ERROR, REFERENCED = 0x0400, 0x1000, 0x2000, 0x8000


def homing_speed(rig: Rig) -> float:
    """The speed of this rig's homing in m/s or rad/s."""
    return rig.motor.zero.speed or AT_REST_SPEED


class Homing(SpeedPlan):
    """Touches ``approaches`` times from the same side and goes to the mean of the touches (SI).

    ``touches``: travel at each touch. ``place``: where the zero belongs, once known. ``scatter``:
    largest less smallest touch. Between touches it stays within the travel limits, as a touch says
    where they are. All in the count's present coordinate, which may have no zero.
    """

    phase_names = ("fill", "retreat", "approach", "return", "vent")

    def __init__(self, rig: Rig, valves: Mapping[str, Valve], zero: Zero):
        super().__init__(rig, valves, homing_speed(rig))
        self.touches: list[float] = []
        self.place: float | None = None
        self._zero, self._rig = zero, rig
        self._force = next((row.name for row in rig.inputs if row.si_unit == "N"), "")
        is_strap = zero.method == "taut_strap"
        self._felt = self._force if is_strap else (rig.motor.current or "")
        self._threshold = (zero.force if is_strap else zero.current) or 0.0
        self._direction = -1.0 if zero.direction == "decreasing" else 1.0
        self._distance_max = zero.distance_max or 0.0
        self._room = room_behind(rig, zero)  # behind a touch, where the zero is
        self._retreat = min(RETREAT_SHARE * self._distance_max, self._room)
        self._share = rig.period_s / (FELT_S + rig.period_s)
        self._filtered = 0.0
        self._starting_cycles = round(STARTING_S / rig.period_s)
        self._stand_cycles = round(STAND_S / rig.period_s)
        self._start = self._from = 0.0
        self._age = 0

    @property
    def scatter(self) -> float:
        return max(self.touches) - min(self.touches) if self.touches else 0.0

    def begin(self, measured: Mapping[str, float]) -> None:
        super().begin(measured)
        self._start = self._from = self.travel
        self.touches.clear()
        if self._zero.method == "taut_strap":
            self._crew.tell(ValveOrder(name, "set", self._zero.pressure) for name in self._filled)

    def _enter(self, index: int, cycle: int) -> None:
        super()._enter(index, cycle)
        self._age = 0
        self._from = self.travel

    def _decide(self, measured: Mapping[str, float], cycle: int) -> None:
        self._age += 1
        if self._felt:
            felt = measured[self._felt]
            felt = felt if self._fills else abs(felt)
            self._filtered += self._share * (felt - self._filtered)
        if self._zero.method == "here":
            if self._age >= self._stand_cycles:
                self.place = measured[self._position]
                self._finish("stood still", cycle)
            return
        phase = self.phase_index
        if phase == FILL:
            if all(valve.settled for valve in self._valves.values()) or not self._fills:
                # a trim under way would move the force as much as the motor does
                self._crew.tell(ValveOrder(name, "hold") for name in self._filled)
                self._enter(RETREAT if self._touched(LET_GO_SHARE) else APPROACH, cycle)
        elif phase == RETREAT:
            self._retreat_step(cycle)
        elif phase == APPROACH:
            self._approach(measured, cycle)
        elif phase == RETURN:
            if self.arrived:
                self._crew.tell(ValveOrder(name, "vent") for name in self._valves)
                self._enter(VENT, cycle)
        elif self._age > self._stand_cycles and all(v.settled for v in self._valves.values()):
            self._finish(f"touched {len(self.touches)} times", cycle)

    @property
    def _fills(self) -> bool:
        return self._zero.method == "taut_strap"

    @property
    def _filled(self) -> tuple[str, ...]:
        return (self._rig.muscles[0].name,) if self._fills else ()

    def _touched(self, share: float = 1.0) -> bool:
        return self._filtered >= share * self._threshold

    def _retreat_step(self, cycle: int) -> None:
        self._wanted = -self._direction * homing_speed(self._rig)
        gone = abs(self.travel - self._from)
        most = min(self._distance_max, self._room) if self.touches else self._distance_max
        if gone >= self._retreat and not self._touched(LET_GO_SHARE):
            self._wanted = 0.0
            if len(self.touches) < self._zero.approaches:
                self._enter(APPROACH, cycle)
            elif self.arrived:
                self._return(cycle)
        elif gone > most:
            self._fail(
                f"{self._felt} does not fall below {LET_GO_SHARE * self._threshold:g}"
                f" {'N' if self._fills else 'A'} within {1e3 * most:g} mm: wrong"
                " direction, or the sensor stands",
                cycle,
            )

    def _return(self, cycle: int) -> None:
        """All touches are there: they must agree, and their mean is gone to from the same side."""
        self.place = sum(self.touches) / len(self.touches)
        if self.scatter > self._zero.tolerance:
            self._fail(
                f"the {len(self.touches)} approaches scatter by {1e3 * self.scatter:.3g} mm, more"
                f" than {1e3 * self._zero.tolerance:.3g} mm",
                cycle,
            )
            return
        self._enter(RETURN, cycle)
        self.go_to(self.place, homing_speed(self._rig))

    def _approach(self, measured: Mapping[str, float], cycle: int) -> None:
        self._wanted = self._direction * homing_speed(self._rig)
        starting = not self._fills and self._age < self._starting_cycles
        if not starting and self._touched():
            travel = measured[self._position]
            self.touches.append(travel)
            self._rest_at(travel)
            self.events.append(("touch", f"touch at {1e3 * travel:.4f} mm", {"travel": travel}))
            self._enter(RETREAT, cycle)
        elif abs(self.travel - self._start) > 0.95 * self._distance_max:
            unit = "N" if self._fills else "A"
            self._fail(
                f"{self._felt} has not reached {self._threshold:g} {unit} within"
                f" {1e3 * self._distance_max:g} mm: nothing there, or the wrong direction",
                cycle,
            )


class SettingZero(SpeedPlan):
    """The drive's own homing (CiA 402 mode 6, method 37): the count becomes ``at`` where it stands.

    ``go``: the drive may be told to start. ``before`` and ``after``: travel before and after, m.
    ``place``: where the motor was left to stand; it must not have crept from there.
    """

    phase_names = ("set zero",)

    def __init__(self, rig: Rig, valves: Mapping[str, Valve], zero: Zero, place: float | None):
        super().__init__(rig, valves, homing_speed(rig))
        assert rig.drive.interface == "cia402"
        self.go = False
        self.before = self.after = float("nan")
        self._zero, self._place, self._status = zero, place, rig.drive.status_word
        self._timeout_cycles = round(rig.drive.transition_timeout / rig.period_s)
        self._wait_cycles = round(0.05 / rig.period_s)  # for the bits and the count to follow
        self._age = 0

    def begin(self, measured: Mapping[str, float]) -> None:
        super().begin(measured)
        self.before, self.go, self._age = measured[self._position], False, 0

    def _decide(self, measured: Mapping[str, float], cycle: int) -> None:
        self._age += 1
        travel, status = measured[self._position], int(measured[self._status])
        self._rest_at(travel)
        if not self.go:
            self._start(travel, cycle)
        elif status & HOMING_ERROR:
            self._fail("the drive reports a homing error (status word bit 13)", cycle)
        elif self._age > self._wait_cycles and status & ATTAINED and status & REFERENCED:
            self._check(travel, cycle)
        elif self._age > self._timeout_cycles:
            self._fail(
                f"the drive did not report homing attained and referenced (status 0x{status:04X},"
                " bits 12 and 15)",
                cycle,
            )

    def _start(self, travel: float, cycle: int) -> None:
        crept = 0.0 if self._place is None else travel - self._place
        if abs(crept) > self._zero.tolerance:
            self._fail(
                f"the motor crept {1e3 * crept:.3g} mm without power, more than"
                f" {1e3 * self._zero.tolerance:.3g} mm; no zero was set",
                cycle,
            )
        else:
            self.before, self.go, self._age = travel, True, 0

    def _check(self, travel: float, cycle: int) -> None:
        self.after = travel
        if abs(travel - self._zero.at) > self._zero.tolerance:
            self._fail(
                f"travel reads {1e3 * travel:.4f} mm after homing, expected"
                f" {1e3 * self._zero.at:.4f} mm (0x30B0 is not what the rig file says?)",
                cycle,
            )
        else:
            self._finish("the drive's zero is set", cycle)

"""Force, current and joint against what moves them: the muscle's law, the motor's work, the way."""

import math

from epa_rt.config.devices import DEVICES
from epa_rt.config.rig import Muscle, Rig
from epa_rt.safety.gas_watch import CAUSE, Refusal
from epa_rt.safety.muscle_law import MuscleGeometry
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of

SPEED_STEP = 0.05  # of the top speed: less is the reading's own ripple
SPEED_STEPS = 10  # of these with no current at all: no motor does that
HOLD_S = 0.2  # a holding torque without its current for so long
STILL_M = 0.0004  # standstill, of travel: a few steps of a joint's converter
STILL_S = 0.2
WRONG_WAY = 0.15  # of what the lever says, backwards
POWERED = 0x0F  # control word "enable operation"


class LawWatch:
    """The force row against pressure and length. A refusal where it stays outside of what a sound
    muscle pulls.
    """

    def __init__(self, muscle: Muscle, geometry: MuscleGeometry, rig: Rig, dt_s: float):
        self._pressure, self._force = muscle.pressure, muscle.law.force
        self._atmosphere_pa, self._geometry = rig.atmosphere_pa, geometry
        self._dt_s, self._allowed_s, self._out_s = dt_s, rig.safety.sensors.law_time, 0.0
        self._travel = rig.motor.position

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample; ``outputs`` play no part."""
        length = self._geometry.length(measured)
        gauge_pa, force = measured[self._pressure] - self._atmosphere_pa, measured[self._force]
        low, high = self._geometry.pull(gauge_pa, length)
        if low <= force <= high:
            self._out_s = 0.0
            return None
        self._out_s += self._dt_s
        if self._out_s < self._allowed_s:
            return None
        if force < low:
            suspects = (
                f"{self._force} (reads low, frozen, its wire), {self._pressure} (reads high),"
                f" {self._travel} (its zero, its calibration)"
            )
            expected = f"at least {low:.0f} N"
        else:
            suspects = (
                f"{self._pressure} (reads low, its calibration), {self._force} (reads high),"
                f" {self._travel} (its zero, its calibration)"
            )
            expected = f"at most {high:.0f} N"
        return (
            CAUSE,
            self._force,
            f"{self._force} = {force:.1f} N, where a muscle of {1e3 * length:.1f} mm at"
            f" {gauge_pa / 1e3:.0f} kPa gauge pulls {expected}; check {suspects}",
        )


class CurrentWatch:
    """A motor that speeds up, slows down or holds a pull takes current. ``force``: the row of the
    muscle that pulls the spool, or None.
    """

    def __init__(self, rig: Rig, force: str | None, dt_s: float):
        sensors, motor = rig.safety.sensors, rig.motor
        self._current, self._speed, self._force = motor.current, motor.speed, force
        self._zero_a = sensors.current_zero_hint
        self._step = SPEED_STEP * motor.speed_max
        bus = rig.drive.interface == "cia402"
        self._power = rig.drive.control_word if bus else rig.drive.enable
        self._on = float(POWERED) if bus else 1.0
        self._dt_s, self._steps, self._last, self._held_s = dt_s, 0, math.nan, 0.0
        self._friction_a = self._amperes_per_n = 0.0
        if sensors.torque_constant:
            self._friction_a = sensors.motor_friction / sensors.torque_constant
            self._amperes_per_n = (
                sensors.gear_efficiency * travel_per_turn(rig) / sensors.torque_constant
            )

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample; speaks only of a drive that ``outputs`` put under power."""
        if outputs[self._power] != self._on or not abs(measured[self._current]) <= self._zero_a:
            self._steps, self._last, self._held_s = 0, measured[self._speed], 0.0
            return None
        speed = measured[self._speed]
        if not abs(speed - self._last) < self._step:
            self._last, self._steps = speed, self._steps + 1
            if self._steps >= SPEED_STEPS:
                return self._refused("while the motor speeds up and slows down")
        if self._force is None:
            return None
        needed_a = self._amperes_per_n * measured[self._force] - self._friction_a
        self._held_s = self._held_s + self._dt_s if needed_a > 3.0 * self._zero_a else 0.0
        if self._held_s >= HOLD_S:
            return self._refused(
                f"while the motor holds {measured[self._force]:.0f} N, for which it needs at least"
                f" {needed_a:.2f} A"
            )
        return None

    def _refused(self, found: str) -> Refusal:
        suspects = "the current reading (its wire, its mapping); i2t is blind without it"
        return CAUSE, self._current, f"{self._current} stays at zero {found}; check {suspects}"


def travel_per_turn(rig: Rig) -> float:
    """Travel per radian of the motor, from the calibration of its position: m/rad. Zero where
    nothing says it.
    """
    row = rig.row(rig.motor.position)
    place = image_of(rig, outputs=False).places[row.entry]
    slave = next((s for s in rig.slaves if s.name == row.entry.split(".")[0]), None)
    if slave is None or "position" not in {e.name for e in DEVICES[slave.device].inputs}:
        return 0.0
    slope = abs(scaling_of(row, place.entry, rig).slope)
    return slope * slave.counts_per_turn / (2.0 * math.pi)


class JointWatch:
    """The joint's first answer to a motor that leaves standstill, by the sign of its lever.

    Asked only while valves are shut: gas moves a joint by itself. Beyond the first way nothing is
    asked, for near its resonance a joint may well go against its motor.
    """

    def __init__(self, rig: Rig, dt_s: float):
        joint, sensors = rig.joint, rig.safety.sensors
        self._travel, self._joint, self._lever = rig.motor.position, joint.position, joint.lever_arm
        self._valves = tuple(row for m in rig.muscles for row in (m.inlet, m.exhaust))
        self._way_m, self._dt_s = sensors.joint_follows, dt_s
        self._still_s, self._asked = 0.0, False
        self._travel_m = self._joint_m = math.inf

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample."""
        travel, joint = measured[self._travel], measured[self._joint] * self._lever
        moved, followed = travel - self._travel_m, joint - self._joint_m
        for valve in self._valves:
            if outputs[valve]:
                self._asked, self._still_s = False, 0.0
                self._travel_m, self._joint_m = travel, joint
                return None
        if not self._asked:
            if abs(moved) <= STILL_M and abs(followed) <= STILL_M:
                self._still_s += self._dt_s
                self._asked = self._still_s >= STILL_S
            else:
                self._still_s, self._travel_m, self._joint_m = 0.0, travel, joint
            return None
        if abs(moved) < self._way_m:
            return None
        self._asked, self._still_s, self._travel_m, self._joint_m = False, 0.0, travel, joint
        if followed * moved < -WRONG_WAY * moved * moved:
            return (
                CAUSE,
                self._joint,
                f"{self._joint} goes the other way: {1e3 * moved:+.1f} mm of {self._travel} moved"
                f" it by {followed / self._lever:+.4f}; check the sign of the joint's lever_arm and"
                f" of the calibration of {self._joint}, the encoder's direction",
            )
        return None

"""Force, current and joint against what moves them: the muscle's law, the motor's work, the way."""

import math

from epa_rt.config.rig import Cia402Drive, Joint, Muscle, Rig
from epa_rt.config.rig_rows import reading_error
from epa_rt.safety.gas_watch import CAUSE, Refusal
from epa_rt.safety.muscle_law import MuscleGeometry
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of

SPEED_STEP = 0.05  # of the top speed: less is the reading's own ripple
SPEED_STEPS = 10  # of these with no current at all: no motor does that
MEAN_S = 1.0  # of motion one way, over which torque and pull are averaged: inertia cancels
SETTLED_S = 2.0  # of motion each way before the averages are ones
MOVES = 0.01  # of the top speed
FROZEN_S = 1.0  # a force that stands to the count while its muscle is stretched
FROZEN_WAY_M = 0.003
STILL_M = 0.0004  # standstill, of travel: a few steps of a joint's converter
STILL_S = 0.2
ANSWERS = 0.2  # of what the lever says: from there on a joint has answered its motor
PATIENCE = 4.0  # ways that it may take to answer
TORQUE_MODE = 10  # CiA 402
POWERED = 0x0F  # control word "enable operation"


class LawWatch:
    """The force row against pressure and length. A refusal where it stays outside of what a sound
    muscle pulls.
    """

    def __init__(self, muscle: Muscle, force: str, geometry: MuscleGeometry, rig: Rig, dt_s: float):
        self._pressure, self._force = muscle.pressure, force
        self._exhaust = muscle.exhaust
        self._atmosphere_pa, self._geometry = rig.atmosphere_pa, geometry
        self._dt_s, self._allowed_s, self._out_s = dt_s, rig.safety.sensors.law_time, 0.0
        self._travel = rig.motor.position
        self._held_n, self._held_s = math.nan, 0.0
        self._shortest = self._longest = 0.0

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample. A muscle that vents is asked at rest: its gas runs ahead of its
        sensor.
        """
        if outputs[self._exhaust]:
            self._out_s = 0.0
            return None
        length = self._geometry.length(measured)
        gauge_pa, force = measured[self._pressure] - self._atmosphere_pa, measured[self._force]
        if force != self._held_n:
            self._held_n, self._held_s, self._shortest, self._longest = force, 0.0, length, length
        elif self._stands(length, gauge_pa):
            return (
                CAUSE,
                self._force,
                f"{self._force} stands at {force:.1f} N to the count while the muscle's length"
                f" changes by {1e3 * (self._longest - self._shortest):.1f} mm; check"
                f" {self._force} (frozen, its wire)",
            )
        low, high = self._geometry.pull(gauge_pa, length, force)
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

    def _stands(self, length: float, gauge_pa: float) -> bool:
        """Whether the pull has stood to the count for long, of a muscle that pulls and moves."""
        if gauge_pa < self._geometry.threshold_pa or length < self._geometry.taut_m:
            self._held_n = math.nan
            return False
        self._held_s += self._dt_s
        if length < self._shortest:
            self._shortest = length
        elif length > self._longest:
            self._longest = length
        return self._held_s >= FROZEN_S and self._longest - self._shortest > FROZEN_WAY_M


class Regulated:
    """Whether the last outputs let the drive regulate speed or position. In torque mode, and
    without power, others move the motor.
    """

    def __init__(self, rig: Rig):
        drive, self._mode = rig.drive, ""
        if isinstance(drive, Cia402Drive):
            self._power, self._on = drive.control_word, float(POWERED)
            self._mode = drive.mode
        else:
            self._power, self._on = drive.enable, 1.0

    def now(self, outputs: dict[str, float]) -> bool:
        if outputs[self._power] != self._on:
            return False
        return not self._mode or outputs[self._mode] != TORQUE_MODE


class CurrentWatch:
    """A motor that speeds up and slows down takes current."""

    def __init__(self, rig: Rig, current: str, speed: str):
        self._current, self._speed = current, speed
        self._zero_a = rig.safety.sensors.current_zero_hint
        self._step = SPEED_STEP * rig.motor.speed_max
        self._regulated = Regulated(rig).now
        self._steps, self._last = 0, math.nan

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample; speaks only of a drive that ``outputs`` put under power."""
        if not abs(measured[self._current]) <= self._zero_a or not self._regulated(outputs):
            self._steps, self._last = 0, measured[self._speed]
            return None
        speed = measured[self._speed]
        if not abs(speed - self._last) < self._step:
            self._last, self._steps = speed, self._steps + 1
            if self._steps >= SPEED_STEPS:
                return (
                    CAUSE,
                    self._current,
                    f"{self._current} stays at zero while the motor speeds up and slows down; check"
                    " the current reading (its wire, its mapping): i2t is blind without it",
                )
        return None


class TorqueWatch:
    """The motor's torque, by its current, against the pull on its spool, averaged over each
    direction of motion apart: their mean is without friction.

    Driving, a gear asks for pull / efficiency, driven for pull x efficiency.
    """

    def __init__(self, rig: Rig, force: str, torque_constant: float, dt_s: float):
        sensors, motor = rig.safety.sensors, rig.motor
        self._current, self._speed, self._force = motor.current or "", motor.speed or "", force
        self._moves = MOVES * motor.speed_max
        self._regulated = Regulated(rig).now
        self._amperes_per_n = 0.5 * travel_per_turn(rig) / torque_constant
        self._efficiency = sensors.gear_efficiency
        self._band_a = sensors.friction_difference / torque_constant + sensors.current_zero_hint
        self._dt_s, self._follow = dt_s, dt_s / MEAN_S
        # driven, driving: mean current, mean pull, time in motion
        self._driven, self._driving = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample of a motor that moves and regulates."""
        speed = measured[self._speed]
        if abs(speed) < self._moves or not self._regulated(outputs):
            return None
        driven, driving = self._driven, self._driving
        way = driving if speed > 0.0 else driven
        way[0] += self._follow * (measured[self._current] - way[0])
        way[1] += self._follow * (measured[self._force] - way[1])
        way[2] += self._dt_s
        if driven[2] < SETTLED_S or driving[2] < SETTLED_S:
            return None
        mean_a = 0.5 * (driven[0] + driving[0])
        back, forth = (self._amperes_per_n * max(each[1], 0.0) for each in (driven, driving))
        low = forth + back * self._efficiency - self._band_a
        high = forth / self._efficiency + back + self._band_a
        if low <= mean_a <= high:
            return None
        if mean_a < low:
            suspects = (
                f"{self._current} (reads low, dead: i2t is blind then), {self._force} (reads high)"
            )
        else:
            suspects = f"{self._force} (reads low, dead, its wire), {self._current} (reads high)"
        return (
            CAUSE,
            self._force if mean_a > high else self._current,
            f"the motor takes {mean_a:.2f} A to and fro for {0.5 * (driven[1] + driving[1]):.0f} N,"
            f" where {low:.2f} to {high:.2f} A are right; check {suspects}",
        )


def travel_per_turn(rig: Rig) -> float:
    """Travel per radian of the motor, from the calibration of its position: m/rad. Zero where
    nothing says it.
    """
    row = rig.row(rig.motor.position)
    place = image_of(rig, outputs=False).places[row.entry]
    slave = next((s for s in rig.slaves if s.name == row.entry.split(".")[0]), None)
    if slave is None or "position" not in {e.name for e in slave.description.inputs}:
        return 0.0
    slope = abs(scaling_of(row, place.entry, rig).slope)
    return slope * slave.counts_per_turn / (2.0 * math.pi)


class JointWatch:
    """The joint's first answer to a motor that leaves standstill, by the sign of its lever.

    Asked only while valves are shut: gas moves a joint by itself. Beyond the first way, and once
    the motor has turned back, nothing is asked: near its resonance a joint may well go against its
    motor.
    """

    def __init__(self, rig: Rig, joint: Joint, dt_s: float):
        sensors = rig.safety.sensors
        self._travel, self._joint, self._lever = rig.motor.position, joint.position, joint.lever_arm
        self._valves = tuple(row for m in rig.muscles for row in (m.inlet, m.exhaust))
        self._way_m, self._dt_s = sensors.joint_follows, dt_s
        self._still_s, self._asked = 0.0, False
        self._travel_m = self._joint_m = math.inf
        self._furthest_m = 0.0

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
                self._asked, self._furthest_m = self._still_s >= STILL_S, 0.0
            else:
                self._still_s, self._travel_m, self._joint_m = 0.0, travel, joint
            return None
        if abs(moved) < self._way_m:
            if abs(moved) > self._furthest_m:
                self._furthest_m = abs(moved)
            elif abs(moved) < self._furthest_m - STILL_M:  # back again: no first way any more
                self._asked, self._still_s = False, 0.0
                self._travel_m, self._joint_m = travel, joint
            return None
        answer = followed * moved / (moved * moved)
        if abs(answer) < ANSWERS and abs(moved) < PATIENCE * self._way_m:
            return None  # heavy, or held by friction: it has not answered yet
        self._asked, self._still_s, self._travel_m, self._joint_m = False, 0.0, travel, joint
        if answer <= -ANSWERS:
            return (
                CAUSE,
                self._joint,
                f"{self._joint} goes the other way: {1e3 * moved:+.1f} mm of {self._travel} moved"
                f" it by {reading_error(self._joint, followed / self._lever)}; check the sign of"
                f" the joint's lever_arm and of the calibration of {self._joint}, the encoder's"
                " direction",
            )
        return None

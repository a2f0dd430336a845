"""Controllers of the motor and of the joint: references in, drive targets out.

Each takes the names of its signals, so that one class serves any rig. After `reset` the first
command equals the last one (or the present value), and the reference is met from there.
"""

from dataclasses import replace
from math import exp, inf, nan, pi

from epa_rt.control.pid import Pid, PidGains
from epa_rt.control.protocol import Signals


def _last(name: str, commanded: Signals | None, otherwise: float) -> float:
    """Last command sent under `name`, or `otherwise` where there is none or it is NaN."""
    value = otherwise if commanded is None else commanded.get(name, otherwise)
    return value if value == value else otherwise


def _toward(value: float, target: float, largest_step: float) -> float:
    """`value` moved toward `target` by `largest_step` at most; NaN in either gives NaN."""
    change = target - value
    if change > largest_step:
        return value + largest_step
    if change < -largest_step:
        return value - largest_step
    return target + 0.0 * value


class MotorPosition:
    """Target travel = reference travel, aligned at reset so that the target does not jump. Unit m.

    `align_speed_m_s` above zero takes the alignment away again at that speed, for references that
    are absolute.
    """

    saturated = slewed = 0  # it cuts nothing; the gate does

    def __init__(
        self,
        *,
        travel: str = "motor_travel_m",
        reference_travel: str = "ref_motor_travel_m",
        command: str = "cmd_motor_travel_m",
        align_speed_m_s: float = 0.0,
    ) -> None:
        self.reads = (travel, reference_travel)
        self.writes = (command,)
        self._travel, self._reference, self._command = travel, reference_travel, command
        self._align_speed_m_s = align_speed_m_s
        self._start_m: float | None = None
        self._offset_m = 0.0
        self._out = {command: 0.0}

    def reset(self, measured: Signals, commanded: Signals | None = None) -> None:
        """Start from the last target, or from the measured travel where none is known."""
        self._start_m = _last(self._command, commanded, measured[self._travel])

    def step(self, measured: Signals, reference: Signals, dt_s: float) -> dict[str, float]:
        """Target travel in m."""
        wanted_m = reference[self._reference]
        if self._start_m is not None and wanted_m == wanted_m:
            self._offset_m = self._start_m - wanted_m
            self._start_m = None
        elif self._offset_m != 0.0:
            self._offset_m = _toward(self._offset_m, 0.0, self._align_speed_m_s * dt_s)
        self._out[self._command] = wanted_m + self._offset_m
        return self._out


class MotorSpeed:
    """Speed command = reference speed + kp x (reference travel - travel), so that the mean travel
    does not drift.

    kp_position in 1/s, limit in m/s; travel is compared from where both were at reset. `saturated`
    counts clamped steps. `align_speed_m_s` as in MotorPosition.
    """

    slewed = 0

    def __init__(
        self,
        *,
        travel: str = "motor_travel_m",
        reference_travel: str = "ref_motor_travel_m",
        reference_speed: str = "ref_motor_speed_m_s",
        command: str = "cmd_motor_speed_m_s",
        kp_position: float,
        limit_m_s: float,
        align_speed_m_s: float = 0.0,
    ) -> None:
        if not limit_m_s > 0.0:
            raise ValueError(f"limit_m_s: found {limit_m_s}, expected above zero")
        self.reads = (travel, reference_travel, reference_speed)
        self.writes = (command,)
        self.saturated = 0
        self._travel, self._reference_travel = travel, reference_travel
        self._reference_speed, self._command = reference_speed, command
        self._kp_position, self._limit_m_s, self._align_speed_m_s = (
            kp_position,
            limit_m_s,
            align_speed_m_s,
        )
        self._offset_m = 0.0
        self._align = True
        self._out = {command: 0.0}

    def reset(self, measured: Signals, commanded: Signals | None = None) -> None:
        """Take the present travel as the reference travel's counterpart; the first command is the
        reference speed.
        """
        self._align = True

    def step(self, measured: Signals, reference: Signals, dt_s: float) -> dict[str, float]:
        """Speed in m/s within +-limit, NaN where an input is NaN."""
        error_m = reference[self._reference_travel] - measured[self._travel]
        if self._align and error_m == error_m:
            self._offset_m = error_m
            self._align = False
        elif self._offset_m != 0.0:
            self._offset_m = _toward(self._offset_m, 0.0, self._align_speed_m_s * dt_s)
        speed = reference[self._reference_speed] + self._kp_position * (error_m - self._offset_m)
        limit = self._limit_m_s
        if speed > limit:
            speed = limit
            self.saturated += 1
        elif speed < -limit:
            speed = -limit
            self.saturated += 1
        self._out[self._command] = speed
        return self._out


class MotorTorque:
    """Torque command = reference torque, met from the last command at `slew_n_m_s` at most. Limit
    in N m.

    `saturated` counts steps in which the limit clamped, `slewed` those in which the slew limit kept
    it from what is wanted.
    """

    def __init__(
        self,
        *,
        reference: str = "ref_motor_torque_n_m",
        command: str = "cmd_motor_torque_n_m",
        limit_n_m: float,
        slew_n_m_s: float = inf,
    ) -> None:
        if not (limit_n_m > 0.0 and slew_n_m_s > 0.0):
            raise ValueError(
                f"limit_n_m, slew_n_m_s: found {limit_n_m}, {slew_n_m_s}, expected above zero"
            )
        self.reads = (reference,)
        self.writes = (command,)
        self.saturated = self.slewed = 0
        self._reference, self._command = reference, command
        self._limit_n_m, self._slew_n_m_s = limit_n_m, slew_n_m_s
        self._torque_n_m = 0.0
        self._out = {command: 0.0}

    def reset(self, measured: Signals, commanded: Signals | None = None) -> None:
        """Start from the last torque command, or from zero."""
        self._torque_n_m = _last(self._command, commanded, 0.0)

    def step(self, measured: Signals, reference: Signals, dt_s: float) -> dict[str, float]:
        """Torque in N m within +-limit, NaN where the reference is NaN."""
        wanted = reference[self._reference]
        limit = self._limit_n_m
        if wanted > limit or wanted < -limit:
            wanted = limit if wanted > limit else -limit
            self.saturated += 1
        torque = _toward(self._torque_n_m, wanted, self._slew_n_m_s * dt_s)
        if torque == torque:  # one NaN must not stay for ever
            self._torque_n_m = torque
            if torque != wanted:
                self.slewed += 1
        self._out[self._command] = torque
        return self._out


class JointAngle:
    """PID on the joint angle with the reference fed forward through the lever arm.

    `output` says what the drive is given: "travel" (m, feedforward lever x reference angle),
    "speed" (m/s, lever x reference speed) or "torque" (N m, lever x reference angle x gain in N).
    lever_arm_m in m per rad, its sign that of travel over angle. The gains' output unit is that of
    the command. Above `output_cutoff_hz` the command is smoothed (two poles), so that an angle
    sensor's steps do not become steps of the target. The speed and acceleration feedforward (s and
    s^2, on the reference) carry what the derivative, which brakes all motion, and the inertia ask
    for. ValueError for any other `output`.
    """

    slewed = 0

    def __init__(
        self,
        gains: PidGains,
        *,
        lever_arm_m: float,
        feedforward_gain: float = 1.0,
        feedforward_speed_s: float = 0.0,
        feedforward_acceleration_s2: float = 0.0,
        output: str = "travel",
        output_cutoff_hz: float = inf,
        angle: str = "knee_angle_rad",
        reference_angle: str = "ref_knee_angle_rad",
        reference_speed: str = "ref_knee_speed_rad_s",
        travel: str = "motor_travel_m",
        command: str = "cmd_motor_travel_m",
    ) -> None:
        if output not in ("travel", "speed", "torque"):
            raise ValueError(f"output: found {output!r}, expected travel, speed or torque")
        self._fed_forward = reference_speed if output == "speed" else reference_angle
        self.reads = tuple(dict.fromkeys((angle, reference_angle, reference_speed)))
        if output == "travel":
            self.reads += (travel,)
        self.writes = (command,)
        self.pid = Pid(_joint_gains(gains, lever_arm_m))
        self._is_travel = output == "travel"
        self._angle, self._reference_angle = angle, reference_angle
        self._travel, self._command = travel, command
        self._feedforward = feedforward_gain * lever_arm_m
        self._of_speed_m_s = feedforward_speed_s * lever_arm_m
        self._of_acceleration_m_s2 = feedforward_acceleration_s2 * lever_arm_m
        self._reference_speed, self._last_speed = reference_speed, nan
        self._cutoff_rad_s = 2.0 * pi * output_cutoff_hz
        self._is_smoothed = self._cutoff_rad_s != inf
        self._dt_s, self._share = nan, 0.0  # of the smoothing, fitted on the next step
        self._first = self._second = 0.0
        self._out = {command: 0.0}

    @property
    def saturated(self) -> int:
        """Steps in which the gains' limits cut the output, before it is smoothed."""
        return self.pid.saturated

    def reset(self, measured: Signals, commanded: Signals | None = None) -> None:
        """Start from the last command; where none is known from the measured travel, or from zero
        speed or torque.
        """
        rest = measured[self._travel] if self._is_travel else 0.0
        self._last_speed = nan
        self._first = self._second = _last(self._command, commanded, rest)
        self.pid.reset(measured[self._angle], self._first)

    def step(self, measured: Signals, reference: Signals, dt_s: float) -> dict[str, float]:
        """Command within the gains' limits, NaN where an input is NaN."""
        forward = self._feedforward * reference[self._fed_forward]
        if self._of_speed_m_s or self._of_acceleration_m_s2:
            speed, last = reference[self._reference_speed], self._last_speed
            acceleration = (speed - last) / dt_s if last == last else 0.0
            self._last_speed = speed
            forward += self._of_speed_m_s * speed + self._of_acceleration_m_s2 * acceleration
        wanted = self.pid.step(
            reference[self._reference_angle], measured[self._angle], forward, dt_s
        )
        if self._is_smoothed and wanted == wanted:  # one NaN must not stay in the filter
            if dt_s != self._dt_s:
                self._dt_s, self._share = dt_s, 1.0 - exp(-self._cutoff_rad_s * dt_s)
            share = self._share
            self._first = first = self._first + share * (wanted - self._first)
            self._second = wanted = self._second + share * (first - self._second)
        self._out[self._command] = wanted
        return self._out


def _joint_gains(gains: PidGains, lever_arm_m: float) -> PidGains:
    """Gains with the sign of the lever arm, so that files hold positive gains for either side of
    the joint.
    """
    if lever_arm_m >= 0.0:
        return gains
    return replace(gains, kp=-gains.kp, ki=-gains.ki, kd=-gains.kd)

"""The loop that is tuned: its signals, its gains, and its controller over frequency.

The controllers are those of epa_rt/control at their own period: sums and differences of samples,
not their continuous ideals. The plant is what lies between the sent command and the measured
output of the same cycle, so that bus, sampling and hold are in it.
"""

from dataclasses import dataclass, replace

import numpy as np

from epa_rt.config.rig import Rig
from epa_rt.experiments.coordinate import coordinate_of

JOINT, MOTOR = "joint", "motor"
LOOP_OF = {JOINT: "joint_angle", MOTOR: "motor_speed"}


class TuneError(Exception):
    """Why nothing can be said of a loop; one sentence."""


@dataclass(frozen=True)
class Gains:
    """Gains of one loop as the rig file has them: ``kp`` (1, or 1/s of the motor's loop), ``ki``
    1/s, ``kd`` s, cut-offs in Hz (infinite: none), feedforward of position (1), speed (s) and
    acceleration (s^2).
    """

    kp: float
    ki: float = 0.0
    kd: float = 0.0
    derivative_cutoff_hz: float = float("inf")
    output_cutoff_hz: float = float("inf")
    feedforward: float = 0.0
    feedforward_speed_s: float = 0.0
    feedforward_acceleration_s2: float = 0.0


@dataclass(frozen=True)
class Loop:
    """One loop of a rig. ``command_of``: command per output at gain one, the joint's lever arm (m
    per rad or 1), 1 for the motor.
    """

    kind: str
    name: str
    output: str
    reference: str
    reference_speed: str
    command: str
    si_unit: str
    command_of: float
    period_s: float
    gains: Gains


def loop_of(rig: Rig, kind: str) -> Loop:
    """The loop of a rig that ``kind`` names. Raises TuneError where the rig has none."""
    motor = rig.motor
    if kind == JOINT:
        if rig.joint is None:
            raise TuneError(f"found the rig '{rig.name}' without a joint, expected one that has it")
        if motor.position_target is None:
            raise TuneError(
                f"found the rig '{rig.name}' whose drive takes no position, expected one that does"
            )
        output, command, command_of = rig.joint.position, motor.position_target, rig.joint.lever_arm
        gains = gains_of_joint(rig)
    else:
        if motor.speed_target is None:
            raise TuneError(
                f"found the rig '{rig.name}' whose drive takes no speed, expected one that does"
            )
        output, command, command_of = motor.position, motor.speed_target, 1.0
        gains = Gains(motor.position_gain)
    coordinate = coordinate_of(rig, LOOP_OF[kind])
    return Loop(
        kind,
        LOOP_OF[kind],
        output,
        coordinate.position_key,
        coordinate.speed_key,
        command,
        coordinate.si_unit,
        command_of,
        rig.period_s,
        gains,
    )


def gains_of_joint(rig: Rig) -> Gains:
    """The gains of a rig that has a joint."""
    assert rig.joint is not None
    pid = rig.joint.pid
    return Gains(
        pid.kp,
        pid.ki,
        pid.kd,
        pid.derivative_cutoff or float("inf"),
        pid.output_cutoff or float("inf"),
        pid.feedforward,
        pid.feedforward_speed,
        pid.feedforward_acceleration,
    )


@dataclass(frozen=True)
class Controller:
    """A loop's controller over frequency, complex (n,): ``feedback`` command per output (its sign
    that of a negative feedback), ``forward`` command per reference.
    """

    feedback: np.ndarray
    forward: np.ndarray


def controller_of(loop: Loop, gains: Gains, frequency_hz: np.ndarray) -> Controller:
    """The controller with these gains at frequencies (n,) in Hz below half the sampling rate."""
    base = basis_of(loop, gains, frequency_hz)
    if loop.kind == MOTOR:
        return Controller(gains.kp * base.unit, gains.kp * base.unit + base.speed)
    by_error = gains.kp * base.unit + gains.ki * base.integral
    forward = (
        gains.feedforward * base.unit
        + gains.feedforward_speed_s * base.speed
        + gains.feedforward_acceleration_s2 * base.acceleration
    )
    return Controller(by_error + gains.kd * base.derivative, by_error + forward)


@dataclass(frozen=True)
class Basis:
    """What each gain is multiplied by, complex (n,), output filter and lever arm included."""

    unit: np.ndarray
    integral: np.ndarray
    derivative: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray


def basis_of(loop: Loop, gains: Gains, frequency_hz: np.ndarray) -> Basis:
    """The terms of the controller: only the cut-offs of ``gains`` are read."""
    dt_s, omega = loop.period_s, 2.0 * np.pi * frequency_hz
    back = np.exp(-1j * omega * dt_s)  # one cycle
    share = _share(gains.derivative_cutoff_hz, dt_s)
    smooth = _share(gains.output_cutoff_hz, dt_s)
    unit = loop.command_of * (smooth / (1.0 - (1.0 - smooth) * back)) ** 2
    difference = (1.0 - back) / dt_s
    return Basis(
        unit,
        unit * dt_s / (1.0 - back),
        unit * difference * share / (1.0 - (1.0 - share) * back),
        unit * 1j * omega,
        unit * 1j * omega * difference,
    )


def _share(cutoff_hz: float, dt_s: float) -> float:
    """What a first-order filter takes of each sample."""
    return float(1.0 - np.exp(-2.0 * np.pi * cutoff_hz * dt_s))


def written_gains(rig: Rig, loop: Loop, gains: Gains) -> Rig:
    """The rig with other gains of this loop."""
    if loop.kind == MOTOR:
        return rig.model_copy(
            update={"motor": rig.motor.model_copy(update={"position_gain": gains.kp})}
        )
    assert rig.joint is not None
    cutoff = gains.output_cutoff_hz
    pid = rig.joint.pid.model_copy(
        update={
            "kp": gains.kp,
            "ki": gains.ki,
            "kd": gains.kd,
            "derivative_cutoff": gains.derivative_cutoff_hz,
            "output_cutoff": cutoff if np.isfinite(cutoff) else None,
            "feedforward": gains.feedforward,
            "feedforward_speed": gains.feedforward_speed_s,
            "feedforward_acceleration": gains.feedforward_acceleration_s2,
        }
    )
    return rig.model_copy(update={"joint": rig.joint.model_copy(update={"pid": pid})})


def rounded(gains: Gains, digits: int = 3) -> Gains:
    """Gains to so many significant digits, as a file holds them."""
    names = Gains.__dataclass_fields__
    return replace(gains, **{n: float(f"{getattr(gains, n):.{digits}g}") for n in names})

"""From rig and experiment to the objects of a run. Backend and recording come from the caller."""

from dataclasses import dataclass

from epa_rt.config.rig import Muscle, Rig
from epa_rt.config.rig_homing import HomingOptions
from epa_rt.config.rig_rows import SignalRow
from epa_rt.control.motion import JointAngle, MotorPosition, MotorSpeed, MotorTorque
from epa_rt.control.pid import PidGains
from epa_rt.control.protocol import Controller
from epa_rt.control.valve import SetAndHold
from epa_rt.control.valve_settings import ValveSettings
from epa_rt.experiments.coordinate import coordinate_of
from epa_rt.experiments.experiment import Experiment
from epa_rt.experiments.sequence import Sequence
from epa_rt.logs.layout import SampleLayout
from epa_rt.loop.drives import drive_of
from epa_rt.loop.rest import RestWatch
from epa_rt.loop.supervisor import STATES, Supervisor
from epa_rt.safety.envelope import Envelope
from epa_rt.signals.codec import Decoder, Encoder

TARGET_OF_LOOP = {
    "motor_position": "position",
    "motor_speed": "speed",
    "motor_torque": "torque",
    "joint_angle": "position",
}


VALVE_FIELDS = {  # key of the rig file's valve section: field of ValveSettings
    "tolerance": "tolerance_pa",
    "settle": "settle_s",
    "settle_timeout": "settle_timeout_s",
    "fill_timeout": "fill_timeout_s",
    "pulse_min": "pulse_min_s",
    "pulse_max": "pulse_max_s",
    "lead": "lead_s",
    "drift": "drift_pa",
    "max_pulses": "max_pulses",
    "supply": "supply_pa",
    "vented": "vented_pa",
}


class WiringError(Exception):
    """A rig and an experiment that do not go together; one sentence."""


@dataclass(frozen=True)
class Assembly:
    """Everything of a run that is not backend or recording. ``homing``: what the backend is to set
    the drive's own homing to; None: to nothing that moves.
    """

    rig: Rig
    experiment: Experiment
    supervisor: Supervisor
    envelope: Envelope
    decoder: Decoder
    encoder: Encoder
    layout: SampleLayout
    homing: HomingOptions | None = None


def assemble(rig: Rig, experiment: Experiment) -> Assembly:
    """Builds and wires the run. Raises WiringError where a controller would read or write what is
    not there.
    """
    decoder, encoder = Decoder(rig), Encoder(rig)
    valves = {muscle.name: SetAndHold(valve_settings(muscle, rig)) for muscle in rig.muscles}
    sequence = Sequence(experiment, rig, valves)
    target = _target_kind(experiment, rig)
    motions = {loop: motion_of(rig, loop, target) for loop in experiment.loops}
    _check_wiring(rig, sequence, motions)
    vented_pa = {name: valve.settings.vented_pa for name, valve in valves.items()}
    rest = RestWatch(rig, decoder, vented_pa)
    supervisor = Supervisor(rig, sequence, valves, motions, drive_of(rig, target), rest)
    layout = SampleLayout(
        decoder.size,
        encoder.size,
        tuple(decoder.measured),
        tuple(supervisor.reference),
        tuple(supervisor.command),
        tuple(supervisor.estimate),
        STATES,
        experiment.phase_names,
    )
    return Assembly(
        rig, experiment, supervisor, Envelope(rig, decoder.reason), decoder, encoder, layout
    )


def valve_settings(muscle: Muscle, rig: Rig) -> ValveSettings:
    """The rig file's valve section over the defaults. Raises ValueError where they do not fit."""
    given = {
        field: value
        for key, field in VALVE_FIELDS.items()
        if (value := getattr(muscle.valves, key)) is not None
    }
    # what bring-up calls vented, a valve may not call full
    return ValveSettings(
        **(given | {"vented_pa": rig.vented_pa(muscle)}),
        over_pressure_pa=muscle.pressure_max,
        atmosphere_pa=rig.atmosphere_pa,
    )


def _target_kind(experiment: Experiment, rig: Rig) -> str:
    """What the drive is given through the whole run; its mode does not change under way."""
    kinds = {TARGET_OF_LOOP[loop] for loop in experiment.loops}
    if "position" in kinds and rig.motor.position_target is None:
        kinds = kinds - {"position"} | {"speed"}
    if len(kinds) != 1:
        raise WiringError(
            f"the loops {', '.join(experiment.loops)} of {experiment.name} need different drive"
            " modes in one run"
        )
    return kinds.pop()


def motion_of(rig: Rig, loop: str, target: str) -> Controller:
    """The controller of one loop, from the rig's gains and names."""
    motor = rig.motor
    travel, speed_key = f"ref_{motor.position}", coordinate_of(rig, "motor_position").speed_key
    if loop == "motor_torque":
        row = _row(rig, motor.torque_target, "motor.torque_target")
        return MotorTorque(
            reference="ref_motor_torque_nm",
            command=row.name,
            limit_n_m=_limits(row)[1],
            slew_n_m_s=row.slew or float("inf"),
        )
    if loop == "joint_angle":
        return _joint(rig)
    if target == "position":
        return MotorPosition(
            travel=motor.position,
            reference_travel=travel,
            command=_row(rig, motor.position_target, "motor.position_target").name,
            align_speed_m_s=motor.speed_max,
        )
    row = _row(rig, motor.speed_target, "motor.speed_target")
    return MotorSpeed(
        travel=motor.position,
        reference_travel=travel,
        reference_speed=speed_key,
        command=row.name,
        kp_position=motor.position_gain,
        limit_m_s=_limits(row)[1],
        align_speed_m_s=0.1 * motor.speed_max,
    )


def _joint(rig: Rig) -> JointAngle:
    joint, motor = rig.joint, rig.motor
    if joint is None:
        raise WiringError(f"the rig {rig.name} has no joint, which the loop joint_angle moves")
    coordinate, lever, pid = coordinate_of(rig, "joint_angle"), joint.lever_arm, joint.pid
    row = _row(rig, motor.position_target, "motor.position_target")
    low, high = _limits(row)
    size = abs(lever)
    gains = PidGains(
        kp=pid.kp * size,
        ki=pid.ki * size,
        kd=pid.kd * size,
        derivative_cutoff_hz=pid.derivative_cutoff,
        low=low,
        high=high,
    )
    return JointAngle(
        gains,
        lever_arm_m=lever,
        feedforward_gain=pid.feedforward,
        feedforward_speed_s=pid.feedforward_speed,
        feedforward_acceleration_s2=pid.feedforward_acceleration,
        output="travel",
        output_cutoff_hz=pid.output_cutoff or float("inf"),
        angle=joint.position,
        reference_angle=coordinate.position_key,
        reference_speed=coordinate.speed_key,
        travel=motor.position,
        command=row.name,
    )


def _row(rig: Rig, name: str | None, role: str) -> SignalRow:
    """The row that a loop writes; WiringError where the rig file names none."""
    if name is None:
        raise WiringError(f"the rig {rig.name} has no {role}, which a loop of the run writes")
    return rig.row(name)


def _limits(row: SignalRow) -> tuple[float, float]:
    if row.limits is None:
        raise WiringError(f"the row {row.name} has no limits, which a loop of the run keeps to")
    return row.limits


def _check_wiring(rig: Rig, sequence: Sequence, motions: dict[str, Controller]) -> None:
    known = {row.name for row in rig.signals} | set(sequence.reference_names)
    for loop, motion in motions.items():
        for name in (*motion.reads, *motion.writes):
            if name not in known:
                raise WiringError(
                    f"the loop {loop} needs the signal {name}, which neither rig nor experiment has"
                )

"""From rig and plan to the objects of a run that homes or jogs, on an experiment's own loop."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from epa_rt.config.rig import Rig, Zero
from epa_rt.config.rig_homing import homing_by_index, index_way
from epa_rt.control.motion import MotorSpeed
from epa_rt.control.valve import SetAndHold
from epa_rt.experiments.coordinate import coordinate_of
from epa_rt.experiments.experiment import Experiment
from epa_rt.experiments.homing import Homing, SettingZero, homing_speed
from epa_rt.experiments.index_homing import SeekingIndex
from epa_rt.experiments.jogging import HOLD_RATIO, Jogging, Source, distance_max
from epa_rt.experiments.speed_plan import SpeedPlan
from epa_rt.logs.layout import SampleLayout
from epa_rt.loop.assembly import Assembly, WiringError, valve_settings
from epa_rt.loop.drives import Drive, drive_of
from epa_rt.loop.homing_drive import HomingDrive
from epa_rt.loop.referenced import Referenced
from epa_rt.loop.rest import RestWatch
from epa_rt.loop.supervisor import STATES, Supervisor
from epa_rt.safety.index_guard import IndexGuard
from epa_rt.safety.recovery import RecoveryEnvelope, RecoveryGuard
from epa_rt.signals.codec import Decoder, Encoder

INFINITE = float("inf")


def assemble_jog(rig: Rig, source: Source, known: bool = True) -> tuple[Assembly, Jogging]:
    """A run by hand. ``known`` False: travel is said to have no zero, whatever the drive reports.

    Raises WiringError where the motor takes no speed.
    """
    referenced = Referenced(rig)
    guard = RecoveryGuard(
        rig,
        (lambda measured: known and referenced.holds(measured)),
        distance_max(rig),
        rig.motor.jog_speed_si * HOLD_RATIO,
    )
    valves = _valves(rig)
    jog = Jogging(rig, valves, source, guard)
    return _assembly(rig, "jog", jog, valves, guard, drive_of(rig, "speed"), jog.speed_max), jog


def assemble_homing(rig: Rig, zero: Zero) -> tuple[Assembly, Homing]:
    """A run that finds the place of zero and leaves the motor there. Raises WiringError."""
    guard = RecoveryGuard(rig, _no_zero, zero.distance_max or distance_max(rig), homing_speed(rig))
    valves = _valves(rig)
    plan = Homing(rig, valves, zero)
    drive = drive_of(rig, "speed")
    return _assembly(rig, "home", plan, valves, guard, drive, homing_speed(rig)), plan


def assemble_setting(rig: Rig, zero: Zero, place: float | None) -> tuple[Assembly, SettingZero]:
    """A run that lets a bus drive set its count to ``zero.at``; nothing moves. Raises
    WiringError.
    """
    if rig.drive.interface != "cia402":
        raise WiringError(f"the drive of {rig.name} is wired and has no homing of its own")
    guard = RecoveryGuard(rig, _no_zero, INFINITE, homing_speed(rig))
    valves = _valves(rig)
    plan = SettingZero(rig, valves, zero, place)
    drive = HomingDrive(rig.drive, rig.period_s, lambda: plan.go)
    speed = homing_speed(rig)
    return _assembly(rig, "set_zero", plan, valves, guard, drive, speed, setting=True), plan


def assemble_index(rig: Rig) -> tuple[Assembly, SeekingIndex]:
    """A run in which a bus drive seeks its index pulse and sets its count there. Raises
    WiringError.
    """
    if rig.drive.interface != "cia402":
        raise WiringError(f"the drive of {rig.name} is wired and has no homing of its own")
    way, valves = index_way(rig), _valves(rig)
    guard = IndexGuard(rig, way)
    plan = SeekingIndex(rig, valves, guard, way)
    drive = HomingDrive(rig.drive, rig.period_s, lambda: plan.go, lambda: plan.interrupted)
    assembly = _assembly(rig, "seek_index", plan, valves, guard, drive, way.speed, setting=True)
    return replace(assembly, homing=homing_by_index(rig)), plan


def _no_zero(measured: Mapping[str, float]) -> bool:
    """While it is homed a rig has no zero."""
    return False


def _valves(rig: Rig) -> dict[str, SetAndHold]:
    return {muscle.name: SetAndHold(valve_settings(muscle, rig)) for muscle in rig.muscles}


def _assembly(
    rig: Rig,
    name: str,
    plan: SpeedPlan,
    valves: Mapping[str, SetAndHold],
    guard: RecoveryGuard,
    drive: Drive,
    speed_max: float,
    setting: bool = False,
) -> Assembly:
    motor = rig.motor
    if motor.speed_target is None:
        raise WiringError(
            f"the rig {rig.name} has no motor.speed_target, expected one to {name} it"
        )
    coordinate = coordinate_of(rig, "motor_speed")
    motion = MotorSpeed(
        travel=motor.position,
        reference_travel=coordinate.position_key,
        reference_speed=coordinate.speed_key,
        command=motor.speed_target,
        kp_position=motor.position_gain,
        limit_m_s=HOLD_RATIO * speed_max,
        align_speed_m_s=0.1 * speed_max,
    )
    decoder, encoder = Decoder(rig), Encoder(rig)
    vented_pa = {name: valve.settings.vented_pa for name, valve in valves.items()}
    rest = RestWatch(rig, decoder, vented_pa)
    supervisor = Supervisor(
        rig,
        plan,
        valves,
        {plan.loop: motion},
        drive,
        rest,
        needs_zero=False,
        has_zero=lambda: bool(guard.has_zero),
    )
    layout = SampleLayout(
        decoder.size,
        encoder.size,
        tuple(decoder.measured),
        tuple(supervisor.reference),
        tuple(supervisor.command),
        tuple(supervisor.estimate),
        STATES,
        plan.phase_names,
    )
    envelope = RecoveryEnvelope(rig, decoder.reason, guard, setting)
    experiment = Experiment(name, "", 0, rig.period_s, (), Path(name))
    return Assembly(rig, experiment, supervisor, envelope, decoder, encoder, layout)

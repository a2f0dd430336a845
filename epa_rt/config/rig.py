"""The rig file: bus, table of signals, drive, muscles, joint, safety. Typed, frozen, unknown keys
refused.
"""

import struct
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, field_validator

from epa_rt.config.calibration_file import SignalCalibration
from epa_rt.config.devices import DEVICES
from epa_rt.config.fields import (
    Frozen,
    FrozenChoice,
    Hertz,
    Name,
    Pressure,
    PressureDifference,
    Seconds,
    pressure,
    quantity,
    written,
)
from epa_rt.config.generic_terminal import GENERIC, GenericTerminal
from epa_rt.config.rig_rows import SignalRow, si_unit_of
from epa_rt.config.rig_sensors import MuscleLaw, Sensors
from epa_rt.config.terminal import Device
from epa_rt.config.units import UnitError, parse_quantity

RowName = Name
JOG_SHARE = 0.1  # of speed_max: slow enough to let go of the key in time
SLOWEST_GAIN = 0.1  # 1/s: a loop of 10 s, as long as a run waits for rest; at 0 nothing moves
YEAR_S = 365 * 86400.0  # laboratories recalibrate load cells and gauges once a year
NO_LOAD = "no_load"  # the place where a muscle has its no-load length
OnAxis = Annotated[float, written("m or rad, as the position's")]


class AnalogCommand(Frozen):
    """An EPOS4 that takes its speed from an analog voltage and its enable from a digital input."""

    speed_per_volt: quantity("rad/s/V", 1e-3)


_SDO_CODES = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i"}


class StartupSdo(Frozen):
    """An object that is written before the bus runs, and read back: ``object: 0x8000:06``, its
    type, its value.
    """

    object: Annotated[str, Field(pattern=r"^0x[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2}$")]
    type: Literal["u8", "i8", "u16", "i16", "u32", "i32"]
    value: Annotated[int, Field(ge=-(1 << 31), lt=1 << 32)]

    @field_validator("value")
    @classmethod
    def _fits(cls, value: int, info: ValidationInfo) -> int:
        bits, signed = int(info.data.get("type", "u32")[1:]), info.data.get("type", "u32")[0] == "i"
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
        if not low <= value <= high:
            raise UnitError(f"found {value}, expected {low} to {high}, what the type holds")
        return value

    @property
    def place(self) -> tuple[int, int]:
        """Index and subindex."""
        index, subindex = self.object.split(":")
        return int(index, 16), int(subindex, 16)

    @property
    def data(self) -> bytes:
        """The value as it goes over the wire."""
        return struct.pack("<" + _SDO_CODES[self.type], self.value)


AnalogFilter = Literal[
    "off", "50 Hz", "60 Hz", "IIR 1", "IIR 2", "IIR 3", "IIR 4", "IIR 5", "IIR 6", "IIR 7", "IIR 8"
]


def _filter_word(value: Any) -> Any:
    """YAML reads ``off`` as false."""
    return "off" if value is False else value


def _device_names() -> list[str]:
    return sorted([*DEVICES, END_CAP, GENERIC])


def _known_device(name: str) -> str:
    if name not in _device_names():
        names = ", ".join(f"'{known}'" for known in _device_names())
        raise UnitError(f"found {name!r}, expected one of {names}")
    return name


def _device_schema(schema: dict[str, Any]) -> None:
    schema["enum"] = _device_names()


END_CAP = "EL9011"
DeviceName = Annotated[str, AfterValidator(_known_device), Field(json_schema_extra=_device_schema)]


class Slave(Frozen):
    """One slave on the wire, in bus order. EL9011 is an end cap: it may be listed, but it is not a
    slave. ``terminal``: what a generic one is. ``filter``: the digital filter of an analog input,
    for all its channels.
    """

    name: Name
    device: DeviceName
    terminal: Annotated[GenericTerminal | None, Field(validate_default=True)] = None
    revision: Annotated[int, Field(ge=0, le=0xFFFFFFFF)] | None = None
    product: Annotated[int, Field(ge=0, le=0xFFFFFFFF)] | None = None
    outputs: tuple[str, ...] | None = None
    inputs: tuple[str, ...] | None = None
    counts_per_turn: Annotated[int, Field(ge=4, le=1 << 24)] = 4096
    rated_torque: quantity("N*m", 1e-4, 100.0) = 0.170
    analog_command: AnalogCommand | None = None
    startup: Annotated[tuple[StartupSdo, ...], Field(max_length=64)] = ()
    filter: Annotated[AnalogFilter, BeforeValidator(_filter_word)] = "off"

    @field_validator("filter")
    @classmethod
    def _only_analog_in(cls, value: str, info: ValidationInfo) -> str:
        device = info.data.get("device")
        if device is not None and not _has_filter(device):
            names = " or ".join(name for name in DEVICES if _has_filter(name))
            raise UnitError(f"found a filter at an {device}, expected it at an {names}")
        return value

    @field_validator("terminal")
    @classmethod
    def _only_generic(
        cls, value: GenericTerminal | None, info: ValidationInfo
    ) -> GenericTerminal | None:
        device = info.data.get("device")
        if device == GENERIC and value is None:
            raise UnitError("found nothing, expected the key 'terminal', what a generic one is")
        if device not in (None, GENERIC) and value is not None:
            raise UnitError(f"found a description at an {device}, expected it at 'generic'")
        return value

    @property
    def description(self) -> Device:
        """What kind of slave it is. Raises KeyError for an end cap."""
        return DEVICES[self.device] if self.terminal is None else self.terminal.device


def _has_filter(device: str) -> bool:
    sampling = DEVICES[device].sampling if device in DEVICES else None
    return sampling is not None and sampling.has_filter


class Cia402Drive(FrozenChoice):
    """A drive enabled through its CiA 402 states over the bus; fields name rows of the table."""

    interface: Literal["cia402"]
    control_word: RowName
    status_word: RowName
    mode: RowName
    mode_display: RowName
    error_code: RowName | None = None
    transition_timeout: Seconds = 0.5


class AnalogDrive(FrozenChoice):
    """A drive enabled by a digital output and commanded by a voltage."""

    interface: Literal["analog"]
    enable: RowName
    enable_delay: Seconds = 0.1


def _axis_value(value: Any, info: ValidationInfo, rate: str = "") -> float:
    """A value on the axis of this section's ``position`` row (mm or deg), or its rate (mm/s,
    deg/s^2).
    """
    si_unit = si_unit_of(info.data.get("position", "x_m"))
    return parse_quantity(value, si_unit + rate)


def _positive_rate(value: Any, info: ValidationInfo, rate: str) -> float:
    result = _axis_value(value, info, rate)
    if not result > 0.0:
        raise UnitError(f"found '{value}', expected a value above zero")
    return result


class Axis(Frozen):
    """What motor and joint share: a measured position, named places, limits of motion."""

    position: RowName
    places: dict[Name, OnAxis] = {}
    speed_max: OnAxis
    acceleration_max: OnAxis
    following_error: OnAxis | None = None

    @field_validator("following_error", mode="before")
    @classmethod
    def _following_error(cls, value: Any, info: ValidationInfo) -> Any:
        return None if value is None else _positive_rate(value, info, "")

    @field_validator("places", mode="before")
    @classmethod
    def _places(cls, value: Any, info: ValidationInfo) -> Any:
        if not isinstance(value, dict):
            raise UnitError(f"found {value!r}, expected a mapping of names to positions")
        return {name: _axis_value(place, info) for name, place in value.items()}

    @field_validator("speed_max", mode="before")
    @classmethod
    def _speed(cls, value: Any, info: ValidationInfo) -> float:
        return _positive_rate(value, info, "/s")

    @field_validator("acceleration_max", mode="before")
    @classmethod
    def _acceleration(cls, value: Any, info: ValidationInfo) -> float:
        return _positive_rate(value, info, "/s^2")


class Zero(Frozen):
    """How the motor's travel gets its zero. ``at``: the travel where it is set, in m.

    ``here``: where the rig stands. ``index``: at the encoder's index pulse, to which the drive
    itself moves; ``current`` and ``force`` may not change by more on the way, and it ends after one
    motor turn at most. ``stop``: against an end stop, found by ``current``. ``taut_strap``: where
    the muscle, held at ``pressure``, begins to pull with ``force``. The last three move at
    ``speed`` in ``direction`` by ``distance_max`` at most, the last two ``approaches`` times.
    ``tolerance``: how far the approaches may scatter, the motor may creep before the zero is set,
    and the position may be off when read back. ``end_band``, for a drive that keeps no zero: how
    far the count may be from where the last run left it, which is also the error that passes
    unseen.
    """

    method: Literal["here", "index", "stop", "taut_strap"]
    at: quantity("m") = 0.0
    direction: Literal["increasing", "decreasing"] | None = None
    speed: quantity("m/s", 0.0) | None = None
    distance_max: quantity("m", 0.0) | None = None
    current: quantity("A", 0.0) | None = None
    pressure: Pressure | None = None
    force: quantity("N", 0.0) | None = None
    approaches: Annotated[int, Field(ge=1, le=20)] = 3
    tolerance: quantity("m", 1e-6) = 0.0002
    end_band: quantity("m", 1e-6) = 0.0005


class AppliedZero(Frozen):
    """What a run took from its zero file, in the log's copy of the rig file; not to be written by
    hand. ``offset``: counts added to what the encoder of a wired drive says. ``end``: the count
    where its last run ended, before that offset.
    """

    method: str
    when: str
    who: str = ""
    drive: str = ""
    offset: Annotated[int, Field(ge=-(1 << 31), lt=1 << 31)] = 0
    end: Annotated[int, Field(ge=-(1 << 31), lt=1 << 31)] | None = None


class Brake(Frozen):
    """A holding brake, closed without current: switched by the row ``output`` (1 = released), or by
    the ``drive`` itself. ``release_delay`` and ``close_delay``: how long it takes; the drive holds
    meanwhile.
    """

    output: RowName | None = None
    drive: bool = False
    release_delay: quantity("s", 0.0, 10.0) = 0.050
    close_delay: quantity("s", 0.0, 10.0) = 0.050


class Motor(Axis):
    """The motor's axis: measured rows, the command rows it has, and the loop around the drive.

    ``rest_place``: the place, by its name, where nothing pulls on the motor; before power goes it
    is moved there at ``let_down_speed`` where something does.
    """

    speed: RowName | None = None
    current: RowName | None = None
    position_target: RowName | None = None
    speed_target: RowName | None = None
    torque_target: RowName | None = None
    position_gain: quantity("1/s", SLOWEST_GAIN, 1000.0) = 10.0
    stop_deceleration: OnAxis | None = None
    jog_speed: OnAxis | None = None
    zero: Zero = Zero(method="here")
    brake: Brake | None = None
    rest_place: Name | None = None
    let_down_speed: OnAxis | None = None

    @field_validator("jog_speed", "let_down_speed", mode="before")
    @classmethod
    def _jog_speed(cls, value: Any, info: ValidationInfo) -> Any:
        return None if value is None else _positive_rate(value, info, "/s")

    @field_validator("stop_deceleration", mode="before")
    @classmethod
    def _stop_deceleration(cls, value: Any, info: ValidationInfo) -> Any:
        return None if value is None else _positive_rate(value, info, "/s^2")

    @property
    def stop_deceleration_si(self) -> float:
        """How hard a stop brakes, in m/s^2 or rad/s^2; ``acceleration_max`` where not given."""
        return self.stop_deceleration or self.acceleration_max

    @property
    def jog_speed_si(self) -> float:
        """How fast a key moves the motor, in m/s or rad/s; JOG_SHARE of ``speed_max`` where not
        given.
        """
        return self.jog_speed or JOG_SHARE * self.speed_max

    @property
    def let_down_speed_si(self) -> float:
        """How fast a load is let down, in m/s or rad/s. Where not given that of a jog: so fast a
        person may move the rig, standing beside it.
        """
        return self.let_down_speed or self.jog_speed_si

    @property
    def rest_place_name(self) -> str | None:
        """The place where nothing pulls: ``rest_place``, else NO_LOAD where there is one."""
        return self.rest_place or (NO_LOAD if NO_LOAD in self.places else None)


class JointPid(Frozen):
    """Gains from joint travel (lever arm x angle) to motor travel; the lever arm gives the
    feedforward too.
    """

    kp: quantity("1", 0.0) = 0.0
    ki: quantity("1/s", 0.0) = 0.0
    kd: quantity("s", 0.0) = 0.0
    derivative_cutoff: Hertz = 50.0
    output_cutoff: Hertz | None = None
    feedforward: quantity("1") = 1.0
    feedforward_speed: quantity("s") = 0.0
    feedforward_acceleration: quantity("s^2") = 0.0


class Joint(Axis):
    """The joint that the motor moves through a muscle. ``lever_arm``: motor travel per joint travel
    with the muscle's length held, m/rad for an angle, without unit for a position; its sign says
    which way the motor moves the joint.
    """

    lever_arm: Annotated[float, written("m/rad, or 1 where the joint moves straight")]
    pid: JointPid

    @field_validator("lever_arm", mode="before")
    @classmethod
    def _lever(cls, value: Any, info: ValidationInfo) -> float:
        is_angle = si_unit_of(info.data.get("position", "x_m")) == "rad"
        lever = parse_quantity(value, "m/rad" if is_angle else "1")
        if lever == 0.0:
            raise UnitError(f"found '{value}', expected a lever arm other than zero")
        return lever


class Valves(Frozen):
    """How a muscle's valves are switched to set a pressure and hold it; what is not given keeps the
    default of ``epa_rt.control.valve_settings.ValveSettings``, whose fields these are.
    """

    tolerance: PressureDifference | None = None
    settle: Seconds | None = None
    settle_timeout: Seconds | None = None
    fill_timeout: Seconds | None = None
    pulse_min: quantity("s", 1e-4, 1.0) | None = None
    pulse_max: quantity("s", 1e-4, 1.0) | None = None
    lead: Seconds | None = None
    drift: PressureDifference | None = None
    max_pulses: Annotated[int, Field(ge=1, le=1000)] | None = None
    supply: Pressure | None = None
    vented: PressureDifference | None = None


class Muscle(Frozen):
    """A muscle: its pressure, its two valves."""

    name: Name
    pressure: RowName
    inlet: RowName
    exhaust: RowName
    pressure_max: Pressure
    valves: Valves = Valves()
    law: MuscleLaw | None = None


class I2t(Frozen):
    """Thermal limit of the motor: tau dq/dt = I^2 - q; trips at q above the continuous current
    squared.
    """

    current: RowName
    continuous: quantity("A", 0.01, 100.0)
    time_constant: quantity("s", 0.01, 1e5)


class Safety(Frozen):
    """What the envelope watches beside each row's own limits. ``watchdog``: after how long without
    a frame the slaves themselves drop their outputs. ``lost_cycles``: how many cycles without sound
    process data may follow each other; ``lost_share``: how much of the time may be such cycles for
    ever; ``lost_time``: how much beyond that may gather (default 0.6 of ``reaction``).
    ``position_hold``: how long an encoder or a drive may hold a position before it renews it.

    How a run ends: ``rest_timeout`` is the longest wait for the rig to be vented and at rest under
    power, and again without it. A drive that brakes has lost the motor above ``stop_overspeed``
    times the limit of speed, or where it takes ``stop_time`` times as long as its ramp.
    ``current_off``: a drive on wires is off while the current stays this close to its zero.
    ``current_holding``: a motor that needs less than this to hold is pulled by nothing.
    """

    reaction: Seconds = 0.020
    watchdog: quantity("s", 1e-3, 6.0) = 0.100
    lost_cycles: Annotated[int, Field(ge=1, le=1000)] = 3
    lost_share: quantity("1", 0.0, 0.9) = 0.1  # sound networks lose none; interference comes short
    lost_time: Seconds | None = None
    position_hold: quantity("s", 0.0, 0.1) = 0.002  # encoders on serial lines renew every 2 ms
    i2t: I2t | None = None
    never_together: tuple[tuple[RowName, RowName], ...] = ()
    sensors: Sensors = Sensors()
    # an 8 bar muscle of a litre vents in some seconds; more means that an exhaust does not open
    rest_timeout: quantity("s", 0.5, 600.0) = 10.0
    # a trip at the limit overshoots it while the drive's loop takes up the load
    stop_overspeed: quantity("1", 1.0, 10.0) = 1.2
    # a ramp that the load disturbs takes longer than the ramp alone
    stop_time: quantity("1", 1.0, 100.0) = 2.0
    # twenty steps of a 12-bit terminal at 1 A/V
    current_off: quantity("A", 0.0, 100.0) = 0.1
    # half the no-load current of a motor of 120 W: friction alone holds it
    current_holding: quantity("A", 0.0, 100.0) = 0.1


class Overrun(Frozen):
    """When a cycle counts as late, and what to do about it: ``policy`` once ``in_a_row`` follow
    each other. A loop that is late for more than ``late_share`` of the time, by ``late_time``,
    ends the run under every policy (``count``: as ``stop``).
    """

    late: Seconds = 0.0003
    policy: Literal["count", "stop", "trip"] = "count"
    in_a_row: Annotated[int, Field(ge=1, le=100_000)] = 5
    late_share: quantity("1", 0.0, 0.9) = 0.8  # a busy machine is often late, never always
    late_time: quantity("s", 1e-3, 3600.0) = 1.0  # a busy machine's stalls are shorter


class Realtime(Frozen):
    """What the loop asks of the kernel where the user may: priority, core."""

    priority: Annotated[int, Field(ge=1, le=98)] = 80
    core: Annotated[int, Field(ge=0, le=1023)] | None = None


class Master(Frozen):
    """How a real or emulated bus is driven. ``recovery``: what happens when a terminal drops out of
    operation (a drive is never recovered within a run). ``clock``: the cycle follows the bus's
    distributed clock, or runs free. ``frame_timeout``: when a frame counts as lost (default: so
    that ``lost_cycles`` of them fit into the reaction time).
    """

    recovery: Literal["stop", "continue"] = "stop"
    clock: Literal["distributed", "free"] = "distributed"
    frame_timeout: quantity("s", 1e-4, 0.1) | None = None
    states_every: quantity("s", 1e-3, 1.0) = 0.010


def _reason(value: Any) -> str:
    """A reason that somebody can read at every start: a few words, one line."""
    if not isinstance(value, str) or len(value.split()) < LEAST_WORDS or not value.isprintable():
        raise UnitError(f"found {value!r}, expected a reason of at least {LEAST_WORDS} words")
    return value.strip()


LEAST_WORDS = 3
Reason = Annotated[str, BeforeValidator(_reason), Field(max_length=200)]


class Rig(Frozen):
    """A whole rig. ``row(name)`` finds a signal; ``inputs`` and ``outputs`` are its rows in table
    order. ``unprotected``: a rule of protection, or a row, to the reason why it is left without.
    ``calibrations``: files beside it whose lines hold in place of the rows' own; a run says which
    is older than ``calibration_valid_for``. ``applied_...``: what a run took, in the log's copy.
    """

    rig: Name
    description: str = ""
    period: quantity("s", 1e-4, 1.0)
    atmosphere: pressure(30e3, 120e3)
    plant: str
    bus: Annotated[tuple[Slave, ...], Field(min_length=1, max_length=64)]
    signals: Annotated[tuple[SignalRow, ...], Field(min_length=1, max_length=63)]
    drive: Annotated[Cia402Drive | AnalogDrive, Field(discriminator="interface")]
    motor: Motor
    muscles: Annotated[tuple[Muscle, ...], Field(max_length=2)] = ()
    joint: Joint | None = None
    safety: Safety = Safety()
    overrun: Overrun = Overrun()
    realtime: Realtime = Realtime()
    master: Master = Master()
    unprotected: dict[Name, Reason] = {}
    calibrations: Annotated[tuple[str, ...], Field(max_length=16)] = ()
    calibration_valid_for: quantity("s", 3600.0, 1e9) = YEAR_S
    applied_zero: AppliedZero | None = None
    applied_calibrations: Annotated[tuple[SignalCalibration, ...], Field(max_length=63)] = ()

    @property
    def name(self) -> str:
        return self.rig

    @property
    def period_s(self) -> float:
        return self.period

    @property
    def atmosphere_pa(self) -> float:
        return self.atmosphere

    @cached_property
    def slaves(self) -> tuple[Slave, ...]:
        return tuple(slave for slave in self.bus if slave.device != END_CAP)

    @cached_property
    def inputs(self) -> tuple[SignalRow, ...]:
        return tuple(row for row in self.signals if not row.is_output)

    @cached_property
    def outputs(self) -> tuple[SignalRow, ...]:
        return tuple(row for row in self.signals if row.is_output)

    def row(self, name: str) -> SignalRow:
        """The row of a signal. Raises KeyError."""
        return self._rows[name]

    def vented_pa(self, muscle: Muscle) -> float:
        """Up to which Pa gauge a muscle counts as vented: its valves' own number, else what
        bring-up takes a vented muscle's sensor to read at most.
        """
        own: float | None = muscle.valves.vented
        return self.safety.sensors.vented if own is None else own

    @cached_property
    def _rows(self) -> dict[str, SignalRow]:
        return {row.name: row for row in self.signals}


def load_rig(path: Path | str) -> Rig:
    """Reads and checks a rig file. Raises ConfigError: one sentence with file, line, found,
    expected.
    """
    from epa_rt.config.source import load_yaml

    return rig_from(load_yaml(path))


def rig_from(located: Any) -> Rig:
    """The rig of a YAML text already read (a file, or a log's attachment), with the calibration
    files that it names. Raises ConfigError.
    """
    from epa_rt.config.calibration_file import self_contained
    from epa_rt.config.kinds import expect_kind
    from epa_rt.config.rig_checks import check_rig
    from epa_rt.config.source import validate
    from epa_rt.config.units import parse_pressure

    expect_kind(located, "rig")
    located = self_contained(located)
    context = {}
    try:
        context["atmosphere_pa"] = parse_pressure(located.data.get("atmosphere"), 0.0)
    except UnitError:
        pass  # the field itself is reported with its line
    rig = validate(located, Rig, context)
    check_rig(rig, located)
    return rig

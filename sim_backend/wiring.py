"""Which entry of the process image is wired to which port of the plant, as tables for the compiled
devices.
"""

import numpy as np

from epa_rt.config.devices import Entry
from epa_rt.config.ports import DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT, VALVE_PORTS
from epa_rt.config.rig import Rig, Slave
from epa_rt.config.rig_checks import calibration_line
from epa_rt.config.source import ConfigError
from epa_rt.config.terminal import Sampling
from epa_rt.models.ports import SENSORS
from epa_rt.signals.drive_options import drive_options
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of
from sim_backend.input_filter import ANALOG_IN, filter_of, set_filter

POWER_UP_S = 0.020  # from the drive's supply to switch-on-disabled
RPM = 2.0 * np.pi / 60.0
HOMING_HERE = 37  # 0x6098
HOMING_SPEED_RPM, HOMING_RPM_S = 10, 1000  # EPOS4's defaults of 0x6099:02 and 0x609A

VALVE = np.dtype(
    [("byte", "i8"), ("bit", "i8"), ("inverted", "i8"), ("muscle", "i8"), ("exhaust", "i8")],
    align=True,
)
DRIVE = np.dtype(
    [
        ("bus", "i8"),
        ("control_byte", "i8"),
        ("mode_byte", "i8"),
        ("position_out_byte", "i8"),
        ("speed_out_byte", "i8"),
        ("torque_out_byte", "i8"),
        ("status_byte", "i8"),
        ("display_byte", "i8"),
        ("position_byte", "i8"),
        ("speed_byte", "i8"),
        ("torque_byte", "i8"),
        ("current_byte", "i8"),
        ("error_byte", "i8"),
        ("enable_byte", "i8"),
        ("enable_bit", "i8"),
        ("analog_byte", "i8"),
        ("analog_step", "f8"),  # counts of the terminal's converter
        ("rad_per_count", "f8"),
        ("rated_torque_nm", "f8"),
        ("analog_rad_s_per_count", "f8"),
        ("period_s", "f8"),
        ("power_up_cycles", "i8"),
        ("lost_master", "i8"),  # 0x6007
        ("quick_stop", "i8"),  # 0x605A
        ("shutdown", "i8"),  # 0x605B
        ("disable", "i8"),  # 0x605C
        ("fault", "i8"),  # 0x605E
        ("deceleration_rad_s2", "f8"),  # 0x6084
        ("quick_stop_rad_s2", "f8"),  # 0x6085
        ("homing_method", "i8"),  # 0x6098
        ("home_counts", "i8"),  # 0x30B0
        ("homing_speed_rad_s", "f8"),  # 0x6099:02
        ("homing_rad_s2", "f8"),  # 0x609A
        ("has_index", "i8"),  # does the encoder give a pulse once per turn?
    ],
    align=True,
)

_PORTS = {name: i for i, name in enumerate(SENSORS.names)}


def wire_analog_inputs(rig: Rig) -> np.ndarray:
    """One row per value that a terminal samples; values without a port stay at 0 counts. A value
    may come without its status. The filter is the one of the rig file's ``startup``.
    """
    image = image_of(rig, outputs=False)
    by_entry = {row.entry: row for row in rig.inputs}
    numbers = {slave.name: number for number, slave in enumerate(rig.slaves)}
    rows = []
    for key, place in image.places.items():
        slave = rig.slaves[numbers[place.slave]]
        if slave.description.is_drive or place.entry.code == "?" or place.entry.faults:
            continue
        row, status = by_entry.get(key), image.places.get(f"{key}_status")
        port, counts_per_si, offset = -1, 0.0, 0.0
        if row is not None and row.port is not None:
            slope, intercept = calibration_line(row, place.entry)
            if row.reads == "absolute":  # the plant's pressures are gauge
                intercept -= rig.atmosphere_pa
            port = _PORTS[row.port]
            counts_per_si = 1.0 / (slope * place.entry.per_count)
            offset = -intercept * counts_per_si
            if place.entry.offset:
                offset -= place.entry.offset / place.entry.per_count
        row_of = np.zeros(1, ANALOG_IN)
        row_of["slave"] = numbers[place.slave]
        row_of["status_byte"], row_of["value_byte"] = status.byte if status else -1, place.byte
        _write_conversion(slave, place.entry, rig.period_s, row_of)
        row_of["port"], row_of["counts_per_si"] = port, counts_per_si
        row_of["offset_counts"] = offset
        set_filter(row_of, filter_of(slave), rig.period_s)
        rows.append(row_of)
    return np.concatenate(rows) if rows else np.zeros(0, ANALOG_IN)


def _write_conversion(slave: Slave, entry: Entry, period_s: float, channel: np.ndarray) -> None:
    """How a terminal turns what it measures into counts and a status word."""
    sampling = slave.description.sampling or Sampling()
    low, high = entry.counts
    channel["value_size"], channel["step"] = entry.bits // 8, sampling.step
    channel["low"], channel["high"] = low, high
    channel["under"] = low if sampling.under is None else sampling.under
    channel["floor"] = low if sampling.floor is None else sampling.floor
    channel["over"] = high if sampling.over is None else sampling.over
    channel["over_error"] = channel["over"] if sampling.over_error is None else sampling.over_error
    channel["plain_conversion_ns"] = round((sampling.conversion_s or period_s) * 1e9)


def wire_valves(rig: Rig) -> np.ndarray:
    """One row per digital output that switches a valve of the plant."""
    image = image_of(rig, outputs=True)
    rows = []
    for row in rig.outputs:
        if row.port in VALVE_PORTS:
            place = image.places[row.entry]
            rows.append((place.byte, place.bit, row.inverted, *VALVE_PORTS[row.port]))
    return np.array(rows, VALVE)


def wire_drive(rig: Rig) -> np.ndarray:
    """The drive's entries in both images (-1 where it has none), and how it is commanded."""
    outputs, inputs = image_of(rig, outputs=True), image_of(rig, outputs=False)
    slave = next((s for s in rig.slaves if s.device == "EPOS4"), None)
    wired = np.zeros(1, DRIVE)
    wired[0] = -1
    drive = wired[0]
    if slave is None:
        raise ConfigError(rig.name, 1, "bus", "no EPOS4", "a drive for the simulated plant to move")
    for field, entry, image in (
        ("control_byte", "control_word", outputs),
        ("mode_byte", "mode", outputs),
        ("position_out_byte", "target_position", outputs),
        ("speed_out_byte", "target_speed", outputs),
        ("torque_out_byte", "target_torque", outputs),
        ("status_byte", "status_word", inputs),
        ("display_byte", "mode_display", inputs),
        ("position_byte", "position", inputs),
        ("speed_byte", "speed", inputs),
        ("torque_byte", "torque", inputs),
        ("current_byte", "current", inputs),
        ("error_byte", "error_code", inputs),
    ):
        place = image.places.get(f"{slave.name}.{entry}")
        drive[field] = place.byte if place else -1
    drive["bus"] = slave.analog_command is None
    drive["period_s"] = rig.period_s
    drive["power_up_cycles"] = max(1, round(POWER_UP_S / rig.period_s))
    if drive["bus"]:
        _write_options(rig, drive)
    drive["rad_per_count"] = 2 * np.pi / slave.counts_per_turn
    drive["rated_torque_nm"] = slave.rated_torque
    for row in rig.outputs:
        place = outputs.places[row.entry]
        if row.port == DRIVE_ENABLE_PORT:
            drive["enable_byte"], drive["enable_bit"] = place.byte, place.bit
        elif row.port == DRIVE_SPEED_PORT:
            drive["analog_byte"] = place.byte
            output = next(s for s in rig.slaves if s.name == place.slave)
            drive["analog_step"] = output.description.output_step
            if slave.analog_command is not None:
                volt_per_count = place.entry.per_count
                drive["analog_rad_s_per_count"] = (
                    slave.analog_command.speed_per_volt * volt_per_count
                )
    return wired


def _write_options(rig: Rig, drive: np.void) -> None:
    """What the driver writes into the drive before it runs (epa_rt/signals/drive_options.py), and
    homing at the place that the rig file names.
    """
    options = drive_options(rig)
    drive["lost_master"], drive["quick_stop"] = options.lost_master, options.quick_stop
    drive["shutdown"], drive["disable"] = options.shutdown, options.disable
    drive["fault"] = options.fault
    drive["deceleration_rad_s2"] = options.deceleration_rpm_s * RPM
    drive["quick_stop_rad_s2"] = options.quick_stop_rpm_s * RPM
    drive["homing_method"] = HOMING_HERE
    drive["home_counts"] = home_counts(rig)
    drive["homing_speed_rad_s"] = HOMING_SPEED_RPM * RPM
    drive["homing_rad_s2"] = HOMING_RPM_S * RPM
    drive["has_index"] = 1


def home_counts(rig: Rig) -> int:
    """Counts of the place where the rig file sets the zero of travel (``motor.zero.at``)."""
    row = rig.row(rig.motor.position)
    entry = image_of(rig, outputs=False).places[row.entry].entry
    return round(
        scaling_of(row, entry, rig).to_counts(rig.motor.zero.at if rig.motor.zero else 0.0)
    )

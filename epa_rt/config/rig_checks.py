"""What a rig file must fulfil across its sections: every name found, every limit sensible, safe means de-energised."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from epa_rt.config.devices import CONVERSION_S, DEVICES, Entry
from epa_rt.config.ports import DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT, MEASURED_PORTS, VALVE_PORTS
from epa_rt.config.rig_roles import check_roles
from epa_rt.config.rig_rows import SignalRow, native_pair, si_unit_of
from epa_rt.config.source import Located
from epa_rt.config.units import UnitError, parse_quantity

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig, Slave


def entries_of(slave: "Slave", outputs: bool) -> tuple[Entry, ...]:
    """The entries that a slave carries in one direction, in order (all of the device's, or the listed ones)."""
    device = DEVICES[slave.device]
    available = device.outputs if outputs else device.inputs
    chosen = slave.outputs if outputs else slave.inputs
    if chosen is None:
        return available
    by_name = {entry.name: entry for entry in available}
    return tuple(by_name[name] for name in chosen)


def calibration_line(row: SignalRow, entry: Entry) -> tuple[float, float]:
    """Slope and intercept from native unit to the row's SI unit (gauge where the row reads gauge). Raises UnitError."""
    if row.calibration is None:
        return 1.0, 0.0
    x0, x1 = native_pair(row.calibration.native, entry.unit)
    y0, y1 = (parse_quantity(value, row.si_unit or "1") for value in row.calibration.value)
    if x0 == x1 or y0 == y1:
        raise UnitError("found two calibration points that coincide, expected two different points")
    slope = (y1 - y0) / (x1 - x0)
    if not 1e-30 < abs(slope) < 1e30:
        raise UnitError(f"found a calibration of {slope:g} {row.si_unit or 1} per {entry.unit}, expected a line that is neither flat nor upright")
    return slope, y0 - slope * x0


def check_rig(rig: "Rig", located: Located) -> None:
    """Raises ConfigError for the first thing that does not fit together."""
    _check_bus(rig, located)
    _check_rows(rig, located)
    check_roles(rig, located)
    _check_muscles(rig, located)
    _check_drive(rig, located)


def _check_bus(rig: "Rig", located: Located) -> None:
    seen: set[str] = set()
    for i, slave in enumerate(rig.bus):
        where = ("bus", i)
        if slave.name in seen:
            raise located.error((*where, "name"), f"the slave name '{slave.name}' a second time", "each name once")
        seen.add(slave.name)
        if slave.device == "EPOS4" and any(other.device == "EPOS4" for other in rig.bus[:i]):
            raise located.error((*where, "device"), "a second EPOS4", "one drive")
        if slave.device == "EL9011":
            if i != len(rig.bus) - 1:
                raise located.error(where, "an end cap EL9011 in the middle", "the end cap last on the wire")
            continue
        _check_startup(slave, where, located)
        device = DEVICES[slave.device]
        for key, chosen, available in (("outputs", slave.outputs, device.outputs), ("inputs", slave.inputs, device.inputs)):
            names = [entry.name for entry in available]
            for j, name in enumerate(chosen or ()):
                if name not in names:
                    raise located.error((*where, key, j), f"the entry '{name}'", f"one of {slave.device}'s: {', '.join(names) or 'none'}")
                if name in chosen[:j]:
                    raise located.error((*where, key, j), f"the entry '{name}' twice", "each entry once")
    if not rig.slaves:
        raise located.error(("bus",), "no slave", "at least one slave")


def _check_startup(slave: "Slave", where: tuple, located: Located) -> None:
    """Objects are written to slaves that have any, and never behind the driver's own back."""
    for i, sdo in enumerate(slave.startup):
        if slave.device in ("EK1100", "EL2124"):
            raise located.error((*where, "startup"), f"'startup' on an {slave.device}, which has no objects", "no 'startup'")
        index = sdo.place[0]
        if 0x1600 <= index <= 0x1BFF or 0x1C10 <= index <= 0x1C33 or index == 0x60C2:
            raise located.error((*where, "startup", i, "object"), f"'{sdo.object}'",
                                "none of the objects of process data and cycle, which follow from this file")


def _check_rows(rig: "Rig", located: Located) -> None:
    slaves = {slave.name: slave for slave in rig.slaves}
    names: set[str] = set()
    ports: set[str] = set()
    entries: dict[str, str] = {}
    for i, row in enumerate(rig.signals):
        where = ("signals", i)
        if row.name.startswith(("ref_", "est_")):
            raise located.error((*where, "name"), f"'{row.name}'", "a measured signal (no prefix) or a command (cmd_)")
        if row.name in names:
            raise located.error((*where, "name"), f"the signal '{row.name}' a second time", "each name once")
        names.add(row.name)
        if row.entry in entries:
            raise located.error((*where, "entry"), f"'{row.entry}', already used by {entries[row.entry]}", "a free entry")
        entries[row.entry] = row.name
        slave_name, entry_name = row.entry.split(".")
        if slave_name not in slaves:
            raise located.error((*where, "entry"), f"the slave '{slave_name}'", f"one of {', '.join(slaves)}")
        available = {e.name: e for e in entries_of(slaves[slave_name], row.is_output)}
        if entry_name not in available:
            kind = "outputs" if row.is_output else "inputs"
            raise located.error((*where, "entry"), f"the entry '{entry_name}'", f"one of the {kind} of {slave_name}: {', '.join(available) or 'none'}")
        if row.is_output and row.port is not None:
            if row.port in ports:
                raise located.error((*where, "port"), f"the port '{row.port}' a second time", "each port of the plant driven once")
            ports.add(row.port)
        _check_row(row, available[entry_name], f"{entry_name}_status" in available, rig, where, located)


def _check_row(row: SignalRow, entry: Entry, has_toggle: bool, rig: "Rig", where: tuple, located: Located) -> None:
    _check_kind(row, entry, where, located)
    line = _of_row(calibration_line, "calibration", row, entry, where, located)
    if row.valid is not None:
        _of_row(_valid_counts, "valid", row, entry, where, located)
    if row.si_unit not in ("", "1") and entry.unit != row.si_unit and row.calibration is None:
        raise located.error(where, f"'{row.name}' without a calibration", f"two points from {entry.unit} to {row.si_unit}")
    _check_port(row, where, located)
    if row.is_output:
        _check_output(row, entry, line, rig, where, located)
    else:
        _check_input(row, has_toggle, rig, where, located)


def _of_row(read: Callable, key: str, row: SignalRow, entry: Entry, where: tuple, located: Located) -> tuple:
    try:
        return read(row, entry)
    except UnitError as error:
        found, expected = str(error).removeprefix("found ").split(", expected ", 1)
        raise located.error((*where, key), found, expected) from None


def _valid_counts(row: SignalRow, entry: Entry) -> tuple[float, float]:
    low, high = (native / entry.per_count for native in native_pair(row.valid, entry.unit))
    if not low < high:
        raise UnitError("found a valid range upside down, expected the lower end first")
    lowest, highest = entry.counts
    if high < lowest or low > highest:
        raise UnitError("found a valid range that the entry never reaches, expected one within its range")
    return low, high


def _check_kind(row: SignalRow, entry: Entry, where: tuple, located: Located) -> None:
    """What a row of bits or of counts cannot have, and what its name must say."""
    is_bit, is_raw = entry.code == "?", row.name.endswith("_raw")
    if row.name.endswith(("_open", "_enable")) and not is_bit or row.is_output and is_bit and is_raw:
        raise located.error((*where, "name"), f"'{row.name}' at an entry of {entry.bits} bits",
                            "a digital row (_open, _enable) at one bit, any other at more")
    if (row.si_unit == "Pa") != (row.reads is not None):
        if row.reads is None:
            raise located.error(where, f"the pressure '{row.name}' without 'reads'", "reads: gauge or reads: absolute")
        raise located.error((*where, "reads"), f"'reads' on '{row.name}'", "it on pressures only")
    for key in ("calibration", "valid", "limits", "slew"):
        if (is_bit or is_raw) and getattr(row, key) is not None:
            raise located.error((*where, key), f"'{key}' on a row of {'bits' if is_bit else 'counts'}", f"no '{key}'")
    if row.inverted and not is_bit:
        raise located.error((*where, "inverted"), "a row of more than one bit", "a digital row")


def _check_port(row: SignalRow, where: tuple, located: Located) -> None:
    if row.port is None:
        return
    known = (*VALVE_PORTS, DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT) if row.is_output else MEASURED_PORTS
    if row.port not in known:
        raise located.error((*where, "port"), f"the port '{row.port}'", f"one of {', '.join(known)}")
    if not row.is_output and si_unit_of(row.port) != row.si_unit:
        raise located.error((*where, "port"), f"the port '{row.port}' on a row in {row.si_unit or 'counts'}", "a port of the row's own unit")


def _check_input(row: SignalRow, has_toggle: bool, rig: "Rig", where: tuple, located: Located) -> None:
    for key in ("slew", "safe"):
        if key in row.model_fields_set:
            raise located.error((*where, key), f"'{key}' on a measured row", "it on commands only")
    if row.stale_after is None:
        return
    if not has_toggle:
        raise located.error((*where, "stale_after"), f"'stale_after' at {row.entry}, which has no toggle bit", "no 'stale_after'")
    # the toggle flips with each conversion: seen once per period, it rests where nearly two (four, ...) fall into one
    flips = rig.period_s / CONVERSION_S
    seen = abs(flips - 2.0 * round(flips / 2.0))
    if seen * row.stale_after < 1.0 - 1e-9:
        text = f"'stale_after: {row.stale_after}' at a period of {rig.period_s * 1e3:g} ms"
        raise located.error((*where, "stale_after"), text, "another period, more cycles or no 'stale_after': the terminal converts every "
                            f"{CONVERSION_S * 1e3:g} ms, so that its toggle can look at rest for that long")


def _check_output(row: SignalRow, entry: Entry, line: tuple[float, float], rig: "Rig", where: tuple, located: Located) -> None:
    for key in ("valid", "stale_after"):
        if getattr(row, key) is not None:
            raise located.error((*where, key), f"'{key}' on a command", "it on measured rows only")
    # A slave whose watchdog runs out drops digital and analog outputs to zero: safe must be the same thing
    if entry.code == "?":
        if row.safe not in (0.0, 1.0) or (row.safe != 0.0) != row.inverted:
            raise located.error((*where, "safe"), f"{row.safe:g} with inverted: {row.inverted}".lower(),
                                "the de-energised state, to which the terminal's watchdog drops too")
        return
    if row.name.endswith("_raw"):
        return
    if row.limits is None:
        raise located.error(where, f"the command '{row.name}' without limits", "limits: [low, high]")
    if not row.limits[0] <= row.safe <= row.limits[1]:
        raise located.error((*where, "safe"), f"{row.safe:g}", "a safe value within the row's limits")
    slope, intercept = line[0] * entry.per_count, line[1] + (rig.atmosphere_pa if row.reads == "gauge" else 0.0)
    counts = sorted((limit - intercept) / slope for limit in row.limits)
    if counts[0] < entry.counts[0] - 1 or counts[1] > entry.counts[1] + 1:
        raise located.error((*where, "limits"), f"limits that take {counts[0]:.6g} to {counts[1]:.6g} counts",
                            f"limits within the entry's {entry.counts[0]} to {entry.counts[1]} counts")
    if entry.unit == "V" and abs((row.safe - intercept) / slope) > 1e-3:
        raise located.error((*where, "safe"), f"{row.safe:g}", "the value at 0 V, to which the terminal's watchdog drops too")


def _check_muscles(rig: "Rig", located: Located) -> None:
    seen: set[str] = set()
    for i, muscle in enumerate(rig.muscles):
        if muscle.name in seen or muscle.name == "all":
            raise located.error(("muscles", i, "name"), f"the muscle name '{muscle.name}'", "a name of its own, not 'all'")
        seen.add(muscle.name)
        limits = rig.row(muscle.pressure).limits
        if limits is None:
            raise located.error(("muscles", i, "pressure"), f"'{muscle.pressure}', a row without limits", "a row with limits, so that over-pressure trips")
        if muscle.pressure_max > limits[1]:
            raise located.error(("muscles", i, "pressure_max"), f"{muscle.pressure_max / 1e3:g} kPa abs", f"at most the row's limit, {limits[1] / 1e3:g} kPa abs")


def _check_drive(rig: "Rig", located: Located) -> None:
    motor = rig.motor
    if not (motor.position_target or motor.speed_target or motor.torque_target):
        raise located.error(("motor",), "no target row", "position_target, speed_target or torque_target")
    if motor.position_target and rig.row(motor.position_target).slew is None:
        raise located.error(("motor", "position_target"), f"'{motor.position_target}', a row without slew", "a row with slew, so that the motor cannot jump")
    for section, axis in (("motor", motor), ("joint", rig.joint)):
        if axis is None:
            continue
        limits = rig.row(axis.position).limits
        if limits is None:
            raise located.error((section, "position"), f"'{axis.position}', a row without limits", "a row with limits, so that over-travel trips")
        for name, place in axis.places.items():
            if not limits[0] <= place <= limits[1]:
                raise located.error((section, "places", name), f"{place:g}", f"a place within [{limits[0]:g}, {limits[1]:g}], the limits of {axis.position}")
    if rig.joint and motor.position_target is None:
        raise located.error(("joint",), "a joint on a motor without position_target", "a motor that takes a position")

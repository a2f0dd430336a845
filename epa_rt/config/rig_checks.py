"""What a rig file must fulfil across its sections: every name found, every limit sensible, safe means de-energised."""

from typing import TYPE_CHECKING

from epa_rt.config.devices import DEVICES, Entry
from epa_rt.config.rig_rows import SignalRow, native_pair
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
    return slope, y0 - slope * x0


def check_rig(rig: "Rig", located: Located) -> None:
    """Raises ConfigError for the first thing that does not fit together."""
    _check_bus(rig, located)
    _check_rows(rig, located)
    _check_names(rig, located)
    _check_muscles(rig, located)
    _check_drive(rig, located)


def _check_bus(rig: "Rig", located: Located) -> None:
    seen: set[str] = set()
    for i, slave in enumerate(rig.bus):
        where = ("bus", i)
        if slave.name in seen:
            raise located.error((*where, "name"), f"the slave name '{slave.name}' a second time", "each name once")
        seen.add(slave.name)
        if slave.device == "EL9011":
            if i != len(rig.bus) - 1:
                raise located.error(where, "an end cap EL9011 in the middle", "the end cap last on the wire")
            continue
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


def _check_rows(rig: "Rig", located: Located) -> None:
    slaves = {slave.name: slave for slave in rig.slaves}
    names: set[str] = set()
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
        _check_row(row, available[entry_name], where, located)


def _check_row(row: SignalRow, entry: Entry, where: tuple, located: Located) -> None:
    try:
        slope, intercept = calibration_line(row, entry)
        if row.valid is not None:
            low, high = native_pair(row.valid, entry.unit)
            if not low < high:
                raise UnitError("found a valid range upside down, expected the lower end first")
    except UnitError as error:
        found, expected = str(error).removeprefix("found ").split(", expected ", 1)
        raise located.error((*where, "calibration" if row.valid is None else "valid"), found, expected) from None
    if row.si_unit == "Pa" and row.reads is None:
        raise located.error(where, f"the pressure '{row.name}' without 'reads'", "reads: gauge or reads: absolute")
    if row.si_unit not in ("", "1") and entry.unit != row.si_unit and row.calibration is None:
        raise located.error(where, f"'{row.name}' without a calibration", f"two points from {entry.unit} to {row.si_unit}")
    if row.is_output and row.limits is None and entry.code != "?" and not row.name.endswith("_raw"):
        raise located.error(where, f"the command '{row.name}' without limits", "limits: [low, high]")
    if row.limits and row.is_output and not row.limits[0] <= row.safe <= row.limits[1]:
        raise located.error((*where, "safe"), f"{row.safe:g}", "a safe value within the row's limits")
    if row.inverted and entry.code != "?":
        raise located.error((*where, "inverted"), "a row of more than one bit", "a digital row")
    # A slave whose watchdog runs out drops digital and analog outputs to zero: safe must be the same thing
    if row.is_output and entry.code == "?" and (row.safe != 0.0) != row.inverted:
        raise located.error((*where, "safe"), f"{row.safe:g} with inverted: {row.inverted}".lower(),
                            "the de-energised state, to which the terminal's watchdog drops too")
    if row.is_output and entry.unit == "V" and abs((row.safe - intercept) / slope) > 1e-9:
        raise located.error((*where, "safe"), f"{row.safe:g}", "the value at 0 V, to which the terminal's watchdog drops too")


def _check_names(rig: "Rig", located: Located) -> None:
    outputs = {row.name for row in rig.outputs}
    inputs = {row.name for row in rig.inputs}
    uses = [(("motor", k), getattr(rig.motor, k), k.endswith("_target"))
            for k in ("position", "speed", "current", "position_target", "speed_target", "torque_target")]
    drive = rig.drive
    keys = {"cia402": (("control_word", True), ("status_word", False), ("mode", True), ("mode_display", False), ("error_code", False)),
            "analog": (("enable", True),)}[drive.interface]
    uses += [(("drive", k), getattr(drive, k), out) for k, out in keys]
    if rig.joint:
        uses.append((("joint", "position"), rig.joint.position, False))
    for i, muscle in enumerate(rig.muscles):
        uses += [(("muscles", i, k), getattr(muscle, k), k != "pressure") for k in ("pressure", "inlet", "exhaust")]
    if rig.safety.i2t:
        uses.append((("safety", "i2t", "current"), rig.safety.i2t.current, False))
    for i, pair in enumerate(rig.safety.never_together):
        uses += [(("safety", "never_together", i, j), name, True) for j, name in enumerate(pair)]
    for where, name, is_output in uses:
        if name is not None and name not in (outputs if is_output else inputs):
            raise located.error(where, f"'{name}'", f"the name of a {'command' if is_output else 'measured'} row in signals")


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
    if rig.row(motor.position).limits is None:
        raise located.error(("motor", "position"), f"'{motor.position}', a row without limits", "a row with limits, so that over-travel trips")
    for section, axis in (("motor", motor), ("joint", rig.joint)):
        if axis is None:
            continue
        limits = rig.row(axis.position).limits
        for name, place in axis.places.items():
            if limits and not limits[0] <= place <= limits[1]:
                raise located.error((section, "places", name), f"{place:g}", f"a place within [{limits[0]:g}, {limits[1]:g}], the limits of {axis.position}")
    if rig.joint and motor.position_target is None:
        raise located.error(("joint",), "a joint on a motor without position_target", "a motor that takes a position")

"""What a rig file must fulfil across its sections: every name found, every limit sensible, safe
means de-energised.
"""

from typing import TYPE_CHECKING

from epa_rt.config.devices import Entry
from epa_rt.config.rig_calibrations import check_calibrations
from epa_rt.config.rig_let_down import check_let_down
from epa_rt.config.rig_roles import check_roles
from epa_rt.config.rig_row_checks import calibration_line, check_row
from epa_rt.config.rig_zero import check_zero
from epa_rt.config.source import Located
from epa_rt.config.terminal import GAP
from epa_rt.config.units import readable, readable_range

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig, Slave

__all__ = ["calibration_line", "check_rig", "entries_of"]


def entries_of(slave: "Slave", outputs: bool) -> tuple[Entry, ...]:
    """The entries that a slave carries in one direction, in order (all of the device's, or the
    listed ones).
    """
    device = slave.description
    available = device.outputs if outputs else device.inputs
    chosen = slave.outputs if outputs else slave.inputs
    if chosen is None:
        return available
    by_name = {entry.name: entry for entry in available}
    return tuple(by_name[name] for name in chosen)


def conversion_of(slave: "Slave", entry_name: str) -> float | None:
    """Seconds between two samples of an input that tells by a toggle bit when it has a new one (0:
    one in each cycle); None where it does not tell.
    """
    names = {entry.name for entry in entries_of(slave, outputs=False) if entry.faults}
    if f"{entry_name}_status" not in names:
        return None
    sampling = slave.description.sampling
    return 0.0 if sampling is None else sampling.conversion_s


def check_rig(rig: "Rig", located: Located) -> None:
    """Raises ConfigError for the first thing that does not fit together."""
    _check_bus(rig, located)
    _check_rows(rig, located)
    check_calibrations(rig, located)
    check_roles(rig, located)
    _check_muscles(rig, located)
    _check_drive(rig, located)
    _check_safety(rig, located)
    check_zero(rig, located)
    check_let_down(rig, located)


def _check_bus(rig: "Rig", located: Located) -> None:
    seen: set[str] = set()
    for i, slave in enumerate(rig.bus):
        where = ("bus", i)
        if slave.name in seen:
            raise located.error(
                (*where, "name"), f"the slave name '{slave.name}' a second time", "each name once"
            )
        seen.add(slave.name)
        if slave.device == "EPOS4" and any(other.device == "EPOS4" for other in rig.bus[:i]):
            raise located.error((*where, "device"), "a second EPOS4", "one drive")
        if slave.device == "EL9011":
            if i != len(rig.bus) - 1:
                raise located.error(
                    where, "an end cap EL9011 in the middle", "the end cap last on the wire"
                )
            continue
        _check_startup(slave, where, located)
        device = slave.description
        for key, chosen, available in (
            ("outputs", slave.outputs, device.outputs),
            ("inputs", slave.inputs, device.inputs),
        ):
            names = [entry.name for entry in available if entry.code != GAP]
            for j, name in enumerate(chosen or ()):
                if name not in names:
                    raise located.error(
                        (*where, key, j),
                        f"the entry '{name}'",
                        f"one of {slave.device}'s: {', '.join(names) or 'none'}",
                    )
                if name in chosen[:j]:
                    raise located.error(
                        (*where, key, j), f"the entry '{name}' twice", "each entry once"
                    )
            _check_choice(slave, key, chosen, tuple(names), where, located)
    if not rig.slaves:
        raise located.error(("bus",), "no slave", "at least one slave")


def _check_choice(
    slave: "Slave",
    key: str,
    chosen: tuple[str, ...] | None,
    names: tuple[str, ...],
    where: tuple,
    located: Located,
) -> None:
    """Only a drive and an analog input leave out what is not listed; the bits of others would stand
    for their neighbours.
    """
    described = slave.description
    may_choose = described.is_drive or described.chooses and described.neutral
    if chosen is not None and chosen != names and not may_choose:
        raise located.error(
            (*where, key),
            f"a part of the process data of {slave.device}, which are fixed",
            f"no '{key}'",
        )


def _check_startup(slave: "Slave", where: tuple, located: Located) -> None:
    """Objects are written to slaves that have any, and never behind the driver's own back."""
    for i, sdo in enumerate(slave.startup):
        if not slave.description.serves_objects:
            raise located.error(
                (*where, "startup"),
                f"'startup' on an {slave.device}, which has no objects",
                "no 'startup'",
            )
        index = sdo.place[0]
        if 0x1600 <= index <= 0x1BFF or 0x1C10 <= index <= 0x1C33 or index == 0x60C2:
            raise located.error(
                (*where, "startup", i, "object"),
                f"'{sdo.object}'",
                "none of the objects of process data and cycle, which follow from this file",
            )


def _check_rows(rig: "Rig", located: Located) -> None:
    slaves = {slave.name: slave for slave in rig.slaves}
    names: set[str] = set()
    ports: set[str] = set()
    entries: dict[str, str] = {}
    for i, row in enumerate(rig.signals):
        where = ("signals", i)
        if row.name.startswith(("ref_", "est_")):
            raise located.error(
                (*where, "name"),
                f"'{row.name}'",
                "a measured signal (no prefix) or a command (cmd_)",
            )
        if row.name in names:
            raise located.error(
                (*where, "name"), f"the signal '{row.name}' a second time", "each name once"
            )
        names.add(row.name)
        if row.entry in entries:
            raise located.error(
                (*where, "entry"),
                f"'{row.entry}', already used by {entries[row.entry]}",
                "a free entry",
            )
        entries[row.entry] = row.name
        slave_name, entry_name = row.entry.split(".")
        if slave_name not in slaves:
            raise located.error(
                (*where, "entry"), f"the slave '{slave_name}'", f"one of {', '.join(slaves)}"
            )
        available = {
            e.name: e for e in entries_of(slaves[slave_name], row.is_output) if e.code != GAP
        }
        if entry_name not in available:
            kind = "outputs" if row.is_output else "inputs"
            raise located.error(
                (*where, "entry"),
                f"the entry '{entry_name}'",
                f"one of the {kind} of {slave_name}: {', '.join(available) or 'none'}",
            )
        if row.is_output and row.port is not None:
            if row.port in ports:
                raise located.error(
                    (*where, "port"),
                    f"the port '{row.port}' a second time",
                    "each port of the plant driven once",
                )
            ports.add(row.port)
        check_row(
            row,
            available[entry_name],
            conversion_of(slaves[slave_name], entry_name),
            rig,
            where,
            located,
        )


def _check_muscles(rig: "Rig", located: Located) -> None:
    seen: set[str] = set()
    for i, muscle in enumerate(rig.muscles):
        if muscle.name in seen or muscle.name == "all":
            raise located.error(
                ("muscles", i, "name"),
                f"the muscle name '{muscle.name}'",
                "a name of its own, not 'all'",
            )
        seen.add(muscle.name)
        limits = rig.row(muscle.pressure).limits
        if limits is None:
            raise located.error(
                ("muscles", i, "pressure"),
                f"'{muscle.pressure}', a row without limits",
                "a row with limits, so that over-pressure trips",
            )
        if muscle.pressure_max > limits[1]:
            raise located.error(
                ("muscles", i, "pressure_max"),
                readable(muscle.pressure_max, "Pa abs"),
                f"at most the row's limit, {readable(limits[1], 'Pa abs')}",
            )


def _check_drive(rig: "Rig", located: Located) -> None:
    motor = rig.motor
    if not (motor.position_target or motor.speed_target or motor.torque_target):
        raise located.error(
            ("motor",), "no target row", "position_target, speed_target or torque_target"
        )
    if motor.position_target and rig.row(motor.position_target).slew is None:
        raise located.error(
            ("motor", "position_target"),
            f"'{motor.position_target}', a row without slew",
            "a row with slew, so that the motor cannot jump",
        )
    for section, axis in (("motor", motor), ("joint", rig.joint)):
        if axis is None:
            continue
        limits, unit = rig.row(axis.position).limits, rig.row(axis.position).si_unit
        if limits is None:
            raise located.error(
                (section, "position"),
                f"'{axis.position}', a row without limits",
                "a row with limits, so that over-travel trips",
            )
        for name, place in axis.places.items():
            if not limits[0] <= place <= limits[1]:
                raise located.error(
                    (section, "places", name),
                    readable(place, unit),
                    f"a place within {readable_range(limits, unit)}, the limits of {axis.position}",
                )
    if rig.joint and motor.position_target is None:
        raise located.error(
            ("joint",),
            "a joint on a motor without position_target",
            "a motor that takes a position",
        )


def _check_safety(rig: "Rig", located: Located) -> None:
    """Lost cycles are only judged once there are enough of them: by then the reaction must still be
    possible.
    """
    reaction, most = rig.safety.reaction, int(rig.safety.reaction / rig.period_s + 1e-9)
    if rig.safety.lost_cycles > most:
        raise located.error(
            ("safety", "lost_cycles"),
            f"{rig.safety.lost_cycles} cycles of {1e3 * rig.period_s:g} ms",
            f"at most {most}, which fit into the reaction time of {1e3 * reaction:g} ms",
        )

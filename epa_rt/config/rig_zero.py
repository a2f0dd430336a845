"""What ``motor.zero`` must fulfil: every method has what it needs, within what the rig can do."""

from typing import TYPE_CHECKING

from epa_rt.config.rig_homing import RETREAT_SHARE, index_way, room_behind
from epa_rt.config.source import Located
from epa_rt.config.units import readable, readable_range

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

NEEDS = {
    "here": (),
    "index": ("direction", "speed", "current"),
    "stop": ("direction", "speed", "distance_max", "current"),
    "taut_strap": ("direction", "speed", "distance_max", "pressure", "force"),
}
_WHERE = ("motor", "zero")


def check_zero(rig: "Rig", located: Located) -> None:
    """Raises ConfigError where a method lacks a field or a signal, or asks for too much."""
    zero = rig.motor.zero
    for field in NEEDS[zero.method]:
        if getattr(zero, field) is None:  # a field of the file, by its name
            raise located.error(
                _WHERE, f"method {zero.method} without '{field}'", ", ".join(NEEDS[zero.method])
            )
    row = rig.row(rig.motor.position)
    limits = row.limits or (-float("inf"), float("inf"))
    if not limits[0] <= zero.at <= limits[1]:
        raise located.error(
            (*_WHERE, "at"),
            readable(zero.at, row.si_unit),
            f"a place within {readable_range(limits, row.si_unit)}, the limits of {row.name}",
        )
    if zero.speed is not None and not 0.0 < zero.speed <= rig.motor.speed_max:
        raise located.error(
            (*_WHERE, "speed"),
            readable(zero.speed, f"{row.si_unit}/s"),
            f"above 0 and at most speed_max, {readable(rig.motor.speed_max, f'{row.si_unit}/s')}",
        )
    _check_distance(rig, located)
    _check_felt(rig, located)
    if zero.method in ("stop", "index") and rig.motor.current is None:
        raise located.error(
            (*_WHERE, "method"),
            f"'{zero.method}' on a motor without a current row",
            "motor.current",
        )
    if zero.method == "index":
        _check_index(rig, located)
    if zero.method == "taut_strap":
        _check_strap(rig, located)


def _check_distance(rig: "Rig", located: Located) -> None:
    """A search no longer than all of the travel, and room to let go behind the place of zero."""
    zero, row = rig.motor.zero, rig.row(rig.motor.position)
    if zero.distance_max is None:
        return
    where, found = (*_WHERE, "distance_max"), readable(zero.distance_max, row.si_unit)
    if not zero.distance_max > 0.0:
        raise located.error(where, found, f"above 0 {row.si_unit}")
    if row.limits is None:
        return
    span = row.limits[1] - row.limits[0]
    if zero.distance_max > span:
        raise located.error(
            where,
            found,
            f"at most {readable(span, row.si_unit)}, from limit to limit of {row.name}",
        )
    back, room = RETREAT_SHARE * zero.distance_max, room_behind(rig, zero)
    if zero.method in ("stop", "taut_strap") and back > room:
        raise located.error(
            (*_WHERE, "at"),
            f"{readable(room, row.si_unit)} between it and the limit of {row.name} behind it",
            f"at least {readable(back, row.si_unit)}, a tenth of distance_max, by which the motor"
            " goes back between two touches",
        )


def _check_felt(rig: "Rig", located: Located) -> None:
    """What a touch is felt by comes before the limit that trips."""
    zero = rig.motor.zero
    currents = (rig.motor.current,) if rig.motor.current is not None else ()
    forces = tuple(row.name for row in rig.inputs if row.si_unit == "N")
    for key, value, names in (("force", zero.force, forces), ("current", zero.current, currents)):
        for row in map(rig.row, names):
            if value is not None and row.limits is not None and not value < row.limits[1]:
                raise located.error(
                    (*_WHERE, key),
                    readable(value, row.si_unit),
                    f"below {readable(row.limits[1], row.si_unit)}, where {row.name} trips",
                )


def _check_index(rig: "Rig", located: Located) -> None:
    """A drive that can home by itself, a speed to watch it by, and a way that the rig has room
    for.
    """
    zero, motor = rig.motor.zero, rig.motor
    if rig.drive.interface != "cia402":
        raise located.error(
            (*_WHERE, "method"), "'index' on a wired drive", "here, stop or taut_strap"
        )
    entry = rig.row(motor.position).entry
    drive = next((s.device for s in rig.slaves if s.name == entry.partition(".")[0]), "")
    if drive != "EPOS4":
        raise located.error(
            (*_WHERE, "method"),
            f"'index' where {motor.position} is {entry}",
            "a position that the drive itself counts",
        )
    if motor.speed is None:
        raise located.error(
            (*_WHERE, "method"), "'index' on a motor without a speed row", "motor.speed"
        )
    if zero.force is None and any(row.si_unit == "N" for row in rig.inputs):
        raise located.error(
            _WHERE,
            "method index without 'force' on a rig that measures one",
            "direction, speed, current, force",
        )
    way, unit = index_way(rig), rig.row(motor.position).si_unit
    if not way.speed > 0.0:
        raise located.error(
            (*_WHERE, "speed"),
            readable(zero.speed or 0.0, f"{unit}/s"),
            "at least one rpm of the motor",
        )
    if way.landing > 0.5 * way.turn:
        raise located.error(
            (*_WHERE, "speed"),
            f"{readable(zero.speed or 0.0, f'{unit}/s')}, at which the drive needs"
            f" {readable(way.landing, unit)} to stop",
            f"one at which it stops within half a motor turn, {readable(0.5 * way.turn, unit)}",
        )
    low, high = rig.row(motor.position).limits or (-float("inf"), float("inf"))
    if way.most > high - low:
        raise located.error(
            (*_WHERE, "method"),
            f"'index' that may move by {readable(way.most, unit)}",
            f"room for it within the limits of {motor.position}"
            f" ({readable(high - low, unit)}), or a distance_max",
        )


def _check_strap(rig: "Rig", located: Located) -> None:
    """One muscle to fill and one row to feel its pull."""
    zero = rig.motor.zero
    forces = [row.name for row in rig.inputs if row.si_unit == "N"]
    if len(forces) != 1 or not rig.muscles:
        raise located.error(
            (*_WHERE, "method"),
            f"'taut_strap' with {len(forces)} force rows and {len(rig.muscles)} muscles",
            "one force row and a muscle (the first is filled)",
        )
    muscle = rig.muscles[0]
    if zero.pressure is not None and zero.pressure >= muscle.pressure_max:
        raise located.error(
            (*_WHERE, "pressure"),
            readable(zero.pressure, "Pa abs"),
            f"below {readable(muscle.pressure_max, 'Pa abs')}, pressure_max of {muscle.name}",
        )

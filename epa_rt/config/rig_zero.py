"""What ``motor.zero`` must fulfil: every method has what it needs, within what the rig can do."""

from typing import TYPE_CHECKING

from epa_rt.config.rig_homing import index_way
from epa_rt.config.source import Located

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
    low, high = rig.row(rig.motor.position).limits or (-float("inf"), float("inf"))
    if not low <= zero.at <= high:
        raise located.error(
            (*_WHERE, "at"), f"{zero.at:g}", f"a place within [{low:g}, {high:g}], its limits"
        )
    if zero.speed is not None and not 0.0 < zero.speed <= rig.motor.speed_max:
        raise located.error(
            (*_WHERE, "speed"), f"{zero.speed:g}", f"above 0 and at most {rig.motor.speed_max:g}"
        )
    if zero.distance_max is not None and not zero.distance_max > 0.0:
        raise located.error((*_WHERE, "distance_max"), f"{zero.distance_max:g}", "above 0")
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
    way = index_way(rig)
    if not way.speed > 0.0:
        raise located.error((*_WHERE, "speed"), f"{zero.speed:g}", "at least one rpm of the motor")
    if way.landing > 0.5 * way.turn:
        raise located.error(
            (*_WHERE, "speed"),
            f"{zero.speed:g}, at which the drive needs {way.landing:.3g} to stop",
            f"one at which it stops within half a motor turn, {0.5 * way.turn:.3g}",
        )
    low, high = rig.row(motor.position).limits or (-float("inf"), float("inf"))
    if way.most > high - low:
        raise located.error(
            (*_WHERE, "method"),
            f"'index' that may move by {way.most:.3g}",
            f"room for it within the limits of {motor.position} ({high - low:.3g}), or a"
            " distance_max",
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
            f"{zero.pressure / 1e3:g} kPa abs",
            f"below {muscle.pressure_max / 1e3:g} kPa abs, pressure_max of {muscle.name}",
        )

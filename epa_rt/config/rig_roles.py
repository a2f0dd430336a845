"""Which rows drive, motor, joint, muscles and safety use, and whether each is of the right kind for
it.
"""

from typing import TYPE_CHECKING

from epa_rt.config.ports import DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT
from epa_rt.config.rig_sensor_roles import sensor_uses
from epa_rt.config.source import Located, Location
from epa_rt.config.units import readable

if TYPE_CHECKING:
    from epa_rt.config.rig import Axis, Rig

Use = tuple[
    Location, str | None, bool, str
]  # where, row, whether a command, what it must be: a unit, 'bit' or '.entry'
BIT = "bit"
AXIS_UNITS = ("m", "rad")
_WORDS = ("control_word", "status_word", "mode", "mode_display", "error_code")


def check_roles(rig: "Rig", located: Located) -> None:
    """Raises ConfigError for the first role whose row is missing or of another kind."""
    for where, name, is_output, kind in _uses(rig):
        if name is not None:
            _check_use(rig, located, where, name, is_output, kind)
    _check_words(rig, located)
    _check_wiring_of_drive(rig, located)
    _check_valves(rig, located)
    _check_brake(rig, located)


def _uses(rig: "Rig") -> list[Use]:
    motor, drive = rig.motor, rig.drive
    uses: list[Use] = [(("motor", "position"), motor.position, False, "m or rad")]
    uses += [
        (("motor", key), getattr(motor, key), key.endswith("_target"), unit)
        for key, unit in (
            ("speed", _unit(motor, "/s")),
            ("current", "A"),
            ("position_target", _unit(motor, "")),
            ("speed_target", _unit(motor, "/s")),
            ("torque_target", "N*m"),
        )
    ]
    if drive.interface == "cia402":
        uses += [
            (("drive", key), getattr(drive, key), key in ("control_word", "mode"), f".{key}")
            for key in _WORDS
        ]
    else:
        uses.append((("drive", "enable"), drive.enable, True, BIT))
    if motor.brake:
        uses.append((("motor", "brake", "output"), motor.brake.output, True, BIT))
    if rig.joint:
        uses.append((("joint", "position"), rig.joint.position, False, "m or rad"))
    for i, muscle in enumerate(rig.muscles):
        uses.append((("muscles", i, "pressure"), muscle.pressure, False, "Pa"))
        uses += [
            (("muscles", i, key), getattr(muscle, key), True, BIT) for key in ("inlet", "exhaust")
        ]
    uses += sensor_uses(rig)
    if rig.safety.i2t:
        uses.append((("safety", "i2t", "current"), rig.safety.i2t.current, False, "A"))
    for i, pair in enumerate(rig.safety.never_together):
        uses += [
            (("safety", "never_together", i, j), name, True, BIT) for j, name in enumerate(pair)
        ]
    return uses


def _unit(axis: "Axis", rate: str) -> str:
    from epa_rt.config.rig_rows import si_unit_of

    return si_unit_of(axis.position) + rate


def _check_use(
    rig: "Rig", located: Located, where: Location, name: str, is_output: bool, kind: str
) -> None:
    if name not in {row.name for row in (rig.outputs if is_output else rig.inputs)}:
        raise located.error(
            where,
            f"'{name}'",
            f"the name of a {'command' if is_output else 'measured'} row in signals",
        )
    row = rig.row(name)
    if kind == BIT:
        if not row.name.endswith(("_open", "_enable")):
            raise located.error(
                where, f"'{name}'", "a digital row, whose name ends in _open or _enable"
            )
    elif kind.startswith("."):
        if not row.entry.endswith(kind) or not name.endswith("_raw"):
            raise located.error(
                where,
                f"'{name}' at {row.entry}",
                f"a row of counts (_raw) at the drive's entry {kind[1:]}",
            )
    elif row.si_unit not in kind.split(" or "):
        raise located.error(where, f"'{name}'", f"a row in {kind}")


def _check_words(rig: "Rig", located: Located) -> None:
    """A command in counts is let through word by word, so only the drive's own two words may be
    one.
    """
    known = (rig.drive.control_word, rig.drive.mode) if rig.drive.interface == "cia402" else ()
    for i, row in enumerate(rig.signals):
        if row.is_output and row.name.endswith("_raw"):
            if row.name not in known:
                raise located.error(
                    ("signals", i, "name"),
                    f"'{row.name}'",
                    "no command in counts but the drive's control word and mode",
                )
            if row.safe != 0.0:
                raise located.error(
                    ("signals", i, "safe"),
                    f"{row.safe:g}",
                    "0, which takes the drive's voltage off",
                )
        if row.name in (rig.motor.speed_target, rig.motor.torque_target) and row.safe != 0.0:
            raise located.error(
                ("signals", i, "safe"),
                readable(row.safe, row.si_unit),
                "0, so that power comes on at rest",
            )


def _check_wiring_of_drive(rig: "Rig", located: Located) -> None:
    wired = rig.drive.interface == "analog"
    for i, slave in enumerate(rig.bus):
        if slave.device == "EPOS4" and (slave.analog_command is not None) != wired:
            found = "analog_command" if slave.analog_command else "no analog_command"
            raise located.error(
                ("bus", i),
                f"{found} on a drive with interface: {rig.drive.interface}",
                "analog_command where the interface is analog, and only there",
            )
    if not wired:
        return
    if rig.row(rig.drive.enable).inverted:
        raise located.error(
            ("drive", "enable"),
            f"'{rig.drive.enable}', an inverted row",
            "an enable that is off without current",
        )
    for port in (DRIVE_ENABLE_PORT, DRIVE_SPEED_PORT):
        if not any(row.port == port for row in rig.outputs):
            raise located.error(
                ("signals",), "an analog drive without its wires", f"a row with port: {port}"
            )


def _check_valves(rig: "Rig", located: Located) -> None:
    used: dict[str, str] = {}
    for i, muscle in enumerate(rig.muscles):
        for key in ("pressure", "inlet", "exhaust"):
            name = getattr(muscle, key)
            if name in used:
                raise located.error(
                    ("muscles", i, key),
                    f"'{name}', already used as {used[name]}",
                    "a row of its own",
                )
            used[name] = f"{key} of {muscle.name}"
    for i, (first, second) in enumerate(rig.safety.never_together):
        if first == second:
            raise located.error(
                ("safety", "never_together", i), f"'{first}' twice", "two different rows"
            )


def _check_brake(rig: "Rig", located: Located) -> None:
    """A brake that holds without current, on a row of its own or switched by the drive."""
    brake, where = rig.motor.brake, ("motor", "brake")
    if brake is None:
        return
    if (brake.output is None) != brake.drive:
        found = "both" if brake.drive else "neither"
        raise located.error(
            where, f"{found} of 'output' and 'drive: true'", "one of them: who switches the brake"
        )
    if brake.output is None:
        return
    row = rig.row(brake.output)
    if row.safe != 0.0 or row.inverted:
        raise located.error(
            (*where, "output"),
            f"'{brake.output}', a row whose safe value releases the brake",
            "a brake that is closed without current (safe: 0, not inverted)",
        )
    taken = [m.inlet for m in rig.muscles] + [m.exhaust for m in rig.muscles]
    taken += [rig.drive.enable] if rig.drive.interface == "analog" else []
    if brake.output in taken:
        raise located.error(
            (*where, "output"),
            f"'{brake.output}', which switches something else",
            "a row of its own",
        )

"""Rules on what stops the rig: following errors, i2t, the valves without power, the drive's own
protection.
"""

from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

from epa_rt.config.rig_protection_rule import Breach, Rule, of_row, shown

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig, StartupSdo

# the highest towns lie at 5100 m (54 kPa), the highest pressure at sea level was 108.5 kPa
ATMOSPHERES_PA = (50e3, 110e3)
FOLLOWING_SHARE = 0.5  # of the axis's range: an error as large as that is a run through all of it
DRIFT_SHARE = 0.1  # of pressure_max above atmosphere: a leak that lets more go is never told


def _safety(rig: "Rig") -> Iterator[Breach]:
    if "safety" not in rig.model_fields_set:
        yield Breach("", ("safety",), "no section 'safety'", "safety: {reaction: ..., i2t: ...}")


def _i2t(rig: "Rig") -> Iterator[Breach]:
    if rig.safety.i2t is None:
        expected = "i2t: {current: ROW, continuous: ..., time_constant: ...} of the motor's winding"
        yield Breach("", ("safety", "i2t"), "no thermal limit of the motor", expected)


def _following_error(rig: "Rig", section: str) -> Iterator[Breach]:
    axis = rig.motor if section == "motor" else rig.joint
    if axis is not None:
        row = rig.row(axis.position)
        if axis.following_error is None:
            yield Breach(
                "",
                (section,),
                f"no 'following_error' of the {section}",
                f"following_error: how far {row.name} may stay away from what is asked for",
            )
        elif row.limits is not None:
            most = FOLLOWING_SHARE * (row.limits[1] - row.limits[0])
            if axis.following_error > most:
                yield Breach(
                    "",
                    (section, "following_error"),
                    f"{shown(axis.following_error, row.si_unit)} of the {section}",
                    f"at most half of the range of {row.name}, {shown(most, row.si_unit)}",
                )


def _valves_without_power(rig: "Rig") -> Iterator[Breach]:
    """Without power the air must get out, and none may get in."""
    for muscle in rig.muscles:
        exhaust, inlet = rig.row(muscle.exhaust), rig.row(muscle.inlet)
        if exhaust.safe == 0.0:
            yield of_row(
                rig,
                exhaust,
                "safe",
                f"an exhaust of '{muscle.name}' that is shut without power, which traps the air",
                "a normally open valve: inverted: true, safe: 1",
            )
        if inlet.safe != 0.0:
            yield of_row(
                rig,
                inlet,
                "safe",
                f"an inlet of '{muscle.name}' that is open without power, which fills it",
                "a normally closed valve: no 'inverted', safe: 0",
            )


def _pressures(rig: "Rig") -> Iterator[Breach]:
    for i, muscle in enumerate(rig.muscles):
        where = ("muscles", i, "valves")
        valves, most = muscle.valves, muscle.pressure_max
        if most <= rig.atmosphere_pa:
            yield Breach(
                "",
                ("muscles", i, "pressure_max"),
                f"{shown(most, 'Pa')} of '{muscle.name}'",
                f"a pressure above the atmosphere, {shown(rig.atmosphere_pa, 'Pa')}",
            )
            continue
        if valves.supply is not None and valves.supply <= most:
            yield Breach(
                "",
                (*where, "supply"),
                f"a supply of {shown(valves.supply, 'Pa')} for '{muscle.name}'",
                f"more than its pressure_max, {shown(most, 'Pa')}",
            )
        widest = DRIFT_SHARE * (most - rig.atmosphere_pa)
        for key, value in (("tolerance", valves.tolerance), ("drift", valves.drift)):
            if value is not None and value > widest:
                yield Breach(
                    "",
                    (*where, key),
                    f"a {key} of {value / 1e3:g} kPa for '{muscle.name}'",
                    f"at most {widest / 1e3:.4g} kPa, a tenth of its pressure_max above atmosphere",
                )


def _atmosphere(rig: "Rig") -> Iterator[Breach]:
    low, high = ATMOSPHERES_PA
    if not low <= rig.atmosphere_pa <= high:
        yield Breach(
            "",
            ("atmosphere",),
            shown(rig.atmosphere_pa, "Pa"),
            f"{shown(low, 'Pa')} to {shown(high, 'Pa')}, what the weather makes of it where people"
            " live",
        )


def _disables(device: str, sdo: "StartupSdo") -> str:
    """What a start-up object takes away of a slave's own protection; '' where nothing.

    Sources: maxon EPOS4 firmware specification; Beckhoff documentation of EL3004 and EL4034.
    """
    index, subindex = sdo.place
    value = sdo.value & 0xFFFFFFFF
    if device == "EPOS4":
        if (index, subindex) == (0x6065, 0) and value == 0xFFFFFFFF:
            return "switches the drive's following error off"
        if (index, subindex) == (0x6007, 0) and value == 0:
            return "lets the drive go on when its master is lost"
        if index in (0x605A, 0x605E) and value == 0:
            return "lets the motor coast where the drive should brake"
        if index == 0x607D and value in (0x80000000, 0x7FFFFFFF):
            return "switches the drive's limit of position off"
        if index in (0x607F, 0x6080) and value >= 0x7FFFFFFF:
            return "switches the drive's limit of speed off"
    elif 0x8000 <= index <= 0x80FF and index & 0xF == 0:
        if device == "EL4034" and subindex == 0x05 and value == 2:
            return "keeps the last output when the master is lost"
        if subindex == 0x02 and value != 0:
            return "shows its numbers otherwise than they are read here"
        if subindex == 0x01 and value != 0:
            return "puts a scale of the terminal's own on top of the calibration"
    return ""


def _startup(rig: "Rig") -> Iterator[Breach]:
    for i, slave in enumerate(rig.bus):
        for j, sdo in enumerate(slave.startup):
            if lost := _disables(slave.device, sdo):
                yield Breach(
                    "",
                    ("bus", i, "startup", j),
                    f"{sdo.object} = {sdo.value}, which {lost}",
                    "no start-up object that takes a protection away",
                )


def _plant_path(rig: "Rig") -> Iterator[Breach]:
    """A rig file names a plant of its own tree, or says outright where another one stands."""
    path = PurePosixPath(rig.plant)
    if path.parts.count("..") > 1 or path.suffix not in (".yaml", ".yml"):
        yield Breach(
            "",
            ("plant",),
            f"'{rig.plant}'",
            "a plant file (*.yaml) beside the rig's folder, as ../plants/NAME.yaml",
        )


STOP_RULES = (
    Rule("safety", _safety, "there is a section `safety`"),
    Rule("i2t", _i2t, "the motor has a thermal limit"),
    Rule(
        "following_error",
        lambda rig: _following_error(rig, "motor"),
        "the motor has `following_error`, at most half of its range",
    ),
    Rule(
        "joint_following_error",
        lambda rig: _following_error(rig, "joint"),
        "the joint has `following_error`, at most half of its range",
    ),
    Rule("without_power", _valves_without_power, "without power exhausts are open and inlets shut"),
    Rule(
        "pressures",
        _pressures,
        "`supply` is above `pressure_max`, that above the atmosphere; narrow `tolerance`, `drift`",
    ),
    Rule("atmosphere", _atmosphere, "50 to 110 kPa abs"),
    Rule("startup", _startup, "no start-up object switches a protection of drive or terminal off"),
    Rule(
        "plant", _plant_path, "`plant` names a YAML file beside the rig's folder", excusable=False
    ),
)

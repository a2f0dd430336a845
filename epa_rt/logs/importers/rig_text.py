"""The rig file that a mapping names: its text for the log, checked as far as this room knows it,
and the atmosphere that it says.
"""

from typing import TYPE_CHECKING

from epa_rt.config.calibration_file import self_contained
from epa_rt.config.fields import STANDARD_ATMOSPHERE_PA
from epa_rt.config.rig import rig_from
from epa_rt.config.source import Located, load_yaml, named_file
from epa_rt.config.units import UnitError, parse_quantity

if TYPE_CHECKING:
    from epa_rt.logs.importers.mapping import Mapping

SAME_ATMOSPHERE = 1e-6  # relative: one pressure written in two units


def rig_text(mapping: "Mapping", located: Located) -> str:
    """Raises ConfigError where its name, or of a rig of ours its rows, are not those of the
    mapping.
    """
    rig = _rig(mapping, located)
    if rig.data.get("rig") != mapping.rig:
        raise rig.error(
            ("rig",),
            repr(rig.data.get("rig")),
            f"'{mapping.rig}', as the mapping {located.path} says",
        )
    if _is_ours(rig):
        rows = {row.name for row in rig_from(rig).signals}
        for section in ("measured", "commands"):
            for name in getattr(mapping, section):
                if name not in rows:
                    raise located.error(
                        (section, name),
                        f"'{name}'",
                        f"a signal of the rig {mapping.rig}: {', '.join(sorted(rows))}",
                    )
    elif "answered_after" in mapping.model_fields_set:
        raise located.error(
            ("answered_after",),
            f"{mapping.answered_after} rows for a rig of others",
            "none: their commands and readings are compared row by row, and a shift of the rows is"
            " fitted",
        )
    return self_contained(rig).text if _is_ours(rig) else rig.text


def atmosphere_of(mapping: "Mapping", located: Located) -> float:
    """What gauge pressures are against, Pa: the rig file's where one is named and says it, else the
    mapping's, else the standard one.

    Raises ConfigError where the two say another: one of them would be wrong by the difference in
    every pressure.
    """
    said = _said(_rig(mapping, located)) if mapping.rig_file is not None else None
    if said is None or mapping.atmosphere is None:
        return said or mapping.atmosphere or STANDARD_ATMOSPHERE_PA
    if abs(said / mapping.atmosphere - 1.0) > SAME_ATMOSPHERE:
        raise located.error(
            ("atmosphere",),
            f"{mapping.atmosphere / 1e3:.6g} kPa abs",
            f"{said / 1e3:.6g} kPa abs, as the rig file {mapping.rig_file} says (without this line"
            " it is taken from there)",
        )
    return said


def _rig(mapping: "Mapping", located: Located) -> Located:
    return load_yaml(named_file(located, ("rig_file",), located.path.parent / mapping.rig_file))


def _is_ours(rig: Located) -> bool:
    return "bus" in rig.data and "signals" in rig.data


def _said(rig: Located) -> float | None:
    """A rig of ours says it at the top, one of others among its settings, or not at all."""
    if _is_ours(rig):
        return rig_from(rig).atmosphere_pa
    settings = rig.data.get("settings")
    if not isinstance(settings, dict) or "atmosphere" not in settings:
        return None
    try:
        value = parse_quantity(settings["atmosphere"], "Pa")
    except UnitError as error:
        found, _, expected = str(error).removeprefix("found ").partition(", expected ")
        raise rig.error(("settings", "atmosphere"), found, expected) from None
    if not value > 0.0:
        raise rig.error(
            ("settings", "atmosphere"), f"'{settings['atmosphere']}'", "a pressure above zero"
        )
    return value

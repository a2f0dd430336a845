"""Which Subject a rig file opens: one of this house's rigs, or a component of somebody else's."""

from pathlib import Path

from epa_rt.gap.rig.foreign import is_foreign, open_foreign
from epa_rt.gap.subject import Subject


def open_subject(
    rig: Path, plant: Path | None = None, leave_out: frozenset[str] = frozenset()
) -> Subject:
    """``plant`` None: the file that the rig names. Raises ConfigError with file and line."""
    if is_foreign(rig):
        return open_foreign(rig, plant, leave_out)
    from epa_rt.gap.rig.house import open_house

    return open_house(rig, plant or named_plant(rig), leave_out)


def named_plant(rig: Path) -> Path | None:
    """The plant file that a rig file names; None where one of others names none. Raises
    ConfigError.
    """
    if is_foreign(rig):
        from epa_rt.gap.rig.foreign.rig_file import load_rig

        return load_rig(rig).plant
    from epa_rt.config.rig import rig_from
    from epa_rt.config.source import load_yaml

    return rig.parent / rig_from(load_yaml(rig)).plant

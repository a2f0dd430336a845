"""From files to a Subject."""

from pathlib import Path

from epa_rt.config.source import ConfigError, load_yaml, named_file
from epa_rt.gap.rig.foreign.plant_file import load_plant
from epa_rt.gap.rig.foreign.rig_file import load_rig
from epa_rt.gap.rig.foreign.subject import ForeignSubject


def open_subject(
    rig_path: Path, plant_path: Path | None, leave_out: frozenset[str]
) -> ForeignSubject:
    """Raises ConfigError (file, line, found, expected), also where ``leave_out`` names no effect of
    this kind.
    """
    rig = load_rig(rig_path)
    path = plant_path or rig.plant
    if path is None:
        raise ConfigError(
            rig_path, 1, "", "no plant", "the key 'plant', or a plant file beside the rig"
        )
    if plant_path is None and not path.exists():
        named_file(load_yaml(rig_path), ("plant",), path)
    known = {effect.name for effect in rig.component.effects}
    for name in sorted(leave_out - known):
        raise ConfigError(
            rig_path,
            1,
            "",
            f"no effect '{name}' of a {rig.component.kind} to leave out",
            "one of " + ", ".join(sorted(known)),
        )
    return ForeignSubject(rig, load_plant(path, rig), leave_out)

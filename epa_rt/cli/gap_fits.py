"""What belongs together: a plant file to its rig, logs to a rig of others, and no output on top of an input."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from epa_rt.cli.exits import VerbError

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig
    from epa_rt.gap.recording import Recording

_LOADS = ("a muscle held by the load cell", "a mass on a line", "a joint")  # by kind_code of the plant's load
_PLACES = ("", "load_position_m", "joint_angle_rad")                        # the port that measures where such a load is


def check_plant(rig: "Rig", plant: Path) -> None:
    """Raises ConfigError where the plant moves another load than the rig, or lacks one of its muscles: no block could be judged."""
    from epa_rt.config.source import load_yaml
    from epa_rt.models.plant_file import read_plant

    source = load_yaml(plant)
    params = read_plant(source).params
    ports = {row.port for row in rig.inputs}
    kind, expected = int(params["load"]["kind_code"][0]), next((i for i in (2, 1) if _PLACES[i] in ports), 0)
    if kind != expected:
        raise source.error(("load", "kind_code"), f"{_LOADS[kind]} (kind_code {kind}), a plant of another rig",
                           f"{_LOADS[expected]} (kind_code {expected}), which the rig '{rig.name}' has")
    present = int((params["muscle"]["present"][0] > 0.5).sum())
    if present < len(rig.muscles):
        raise source.error(("muscle1", "present"), f"a plant with {present} muscle{'s' * (present != 1)}", f"{len(rig.muscles)}, which the rig '{rig.name}' has")


def check_columns(subject, rig_file: Path, recordings: "Sequence[Recording]") -> None:
    """Raises VerbError where a log was recorded on another component rig, or lacks a column that its kind cannot do without."""
    needed = {subject.rig.channels[channel.role] for channel in subject.rig.component.channels if channel.required}
    for recording in recordings:
        if recording.rig and recording.rig != subject.name:
            raise VerbError(f"{recording.path}: found a log of the rig '{recording.rig}', expected '{subject.name}', as {rig_file} says")
        missing = sorted(needed - recording.columns.keys())
        if missing:
            raise VerbError(f"{recording.path}: found no column {', '.join(missing)}, expected what {rig_file} names under channels")


def check_judged(places: Sequence, subject) -> None:
    """Raises VerbError where not one block was judged: that would read as if there were no gap."""
    if not places:
        raise VerbError(f"found no stretch of these logs on which a block of the rig {subject.name} can be judged, expected longer logs, or such with fewer holes")


def check_spares(out: Path | None, inputs: "Sequence[Path | None]") -> None:
    """Raises VerbError where a file to be written is one of those that are read."""
    for path in inputs:
        if out is not None and path is not None and out.exists() and path.exists() and out.samefile(path):
            raise VerbError(f"{out}: found a file that is read here, expected another name (it stays as it is)")

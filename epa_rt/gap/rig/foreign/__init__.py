"""Rigs that are not ours, cut into blocks with measured inputs and outputs: carriage, shaft, sealed
chamber, piston, servo joint.
"""

import os
from pathlib import Path


def is_foreign(rig_path: str | os.PathLike) -> bool:
    """Whether a rig file describes a component rig (it has 'kind:' and no 'bus:'). Raises
    ConfigError where it is no YAML.
    """
    from epa_rt.config.source import load_yaml

    data = load_yaml(Path(rig_path)).data
    return "kind" in data and "bus" not in data


def open_foreign(
    rig_path: str | os.PathLike,
    plant_path: str | os.PathLike | None = None,
    leave_out: frozenset[str] = frozenset(),
):
    """The Subject of a component rig. ``plant_path`` None: the one that the rig file names. Raises
    ConfigError.
    """
    from epa_rt.gap.rig.foreign.open import open_subject

    return open_subject(
        Path(rig_path), Path(plant_path) if plant_path is not None else None, frozenset(leave_out)
    )

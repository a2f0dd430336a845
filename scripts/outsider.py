"""What an outsider's simulator gives of one machine: what it has, its logs and its files."""

from collections.abc import Sequence
from dataclasses import dataclass

from epa_rt.gap.recording import Recording


@dataclass(frozen=True)
class Outsider:
    """``has``: effects that its plant file lacks. ``bits``: of its encoder. ``plant``, ``rig``:
    texts of its files; the rig file names the other as plant.yaml.
    """

    has: tuple[str, ...]
    bits: int
    logs: Sequence[Recording]
    plant: str
    rig: str

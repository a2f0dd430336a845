"""What healthy runs of one rig differ by: the noise of a diagnosis where it was measured and need
not be assumed.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable


@dataclass(frozen=True)
class Usual:
    """``runs``: how many there were; spreads of a subject's nominal parameters are theirs.
    ``off``: by link by how much chi-square per sample differs from one run to the next, a
    deviation.
    """

    runs: int
    off: Mapping[str, float]


@runtime_checkable
class WithRuns(Protocol):
    """A subject that may know its healthy runs."""

    usual: Usual | None


def usual_of(subject: object) -> Usual | None:
    """What a subject knows of its healthy runs; None where it has none."""
    return subject.usual if isinstance(subject, WithRuns) else None

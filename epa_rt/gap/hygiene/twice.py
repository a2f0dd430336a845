"""One recording under two names, or a piece of it as another: it would weigh twice, or judge itself
as its own holdout.
"""

from collections.abc import Sequence

import numpy as np

from epa_rt.gap.finding import Finding, measured_names, seconds
from epa_rt.gap.recording import Recording

# over all channels, that a piece from amid a recording must have: two rests without noise are alike
# and yet two
_CHANGES = 20
_LOOKED_AT = (
    50  # changes of a channel by which places are looked for, before whole pieces are compared
)


def check_twice(recordings: Sequence[Recording]) -> list[Finding]:
    """Refusals of recordings every row of which stands in another one."""
    found = []
    for i, one in enumerate(recordings):
        for other in recordings[i + 1 :]:
            longer, shorter = (one, other) if other.samples <= one.samples else (other, one)
            names = [name for name in measured_names(one) if name in other.columns]
            at = (
                _place(
                    [(longer.columns[name], shorter.columns[name]) for name in names],
                    shorter.samples,
                )
                if shorter.samples and names
                else None
            )
            if at is not None:
                where = f", from {seconds(longer, at):.3f} s on" if at else ""
                found.append(
                    Finding(
                        "refuse",
                        "twice",
                        shorter.name,
                        "",
                        f"{shorter.name}: found every one of its {shorter.samples} rows in"
                        f" {longer.name} too{where}, expected another recording",
                    )
                )
    return found


def _place(columns: list[tuple[np.ndarray, np.ndarray]], rows: int) -> int | None:
    """The row of the longer recording at which the shorter one of so many ``rows`` stands, of
    (longer, shorter) columns; None where nowhere.
    """
    if _stands(columns, 0, rows):
        return 0
    at, known = np.arange(1, len(columns[0][0]) - rows + 1), 0
    for whole, piece in columns:
        changes = np.flatnonzero(np.abs(np.diff(piece)) > 0.0)
        looked_at = changes[
            np.linspace(0, len(changes) - 1, min(len(changes), _LOOKED_AT)).astype(int)
        ]
        for row in (*looked_at, *(looked_at + 1)):
            at = at[whole[at + row] == piece[row]]
        known += len(changes)
    return (
        next((int(row) for row in at if _stands(columns, row, rows)), None)
        if known >= _CHANGES
        else None
    )


def _stands(columns: list[tuple[np.ndarray, np.ndarray]], at: int, rows: int) -> bool:
    return all(
        np.array_equal(whole[at : at + rows], piece, equal_nan=True) for whole, piece in columns
    )

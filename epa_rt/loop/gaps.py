"""Counting cycles that brought no sound process data; the run survives a few of them, the operator
shall know.
"""


class Gaps:
    """Rows of bad cycles. ``count`` of all bad cycles; ``step`` answers with one sentence when a
    row has ended.
    """

    __slots__ = ("count", "in_a_row")

    def __init__(self) -> None:
        self.count = self.in_a_row = 0

    def step(self, bus_ok: bool) -> str:
        """Takes one cycle."""
        if not bus_ok:
            self.count += 1
            self.in_a_row += 1
            return ""
        row, self.in_a_row = self.in_a_row, 0
        return (
            f"{row} cycle{'s' if row > 1 else ''} without sound process data; the last good ones"
            " stood in"
            if row
            else ""
        )

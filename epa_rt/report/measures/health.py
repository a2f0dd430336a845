"""Sensors that were not to be believed, commands that were held back, and how much of each range
was used.
"""

from dataclasses import dataclass

import numpy as np

from epa_rt.config.rig_rows import SignalRow
from epa_rt.report.run import Run


@dataclass(frozen=True)
class SignalHealth:
    """One row: lowest and highest value and limits in SI, cycles invalid and stale, cycles clamped
    and slewed by the gate (``clamped``, ``slewed``), and before it by the controllers. These counts
    are None where the log did not close with them.
    """

    row: SignalRow
    low: float
    high: float
    invalid: int
    stale: int
    clamped: int | None
    slewed: int | None
    controller_clamped: int | None
    controller_slewed: int | None

    @property
    def margin(self) -> float:
        """How far the range stayed from the nearer limit (SI), below zero where it passed one; NaN
        without limits.
        """
        if self.row.limits is None:
            return float("nan")
        return min(self.low - self.row.limits[0], self.row.limits[1] - self.high)


def health_of(run: Run) -> list[SignalHealth]:
    """Every row of the rig's table that the log has, inputs first."""
    summary = next((event.data for event in reversed(run.events) if event.kind == "summary"), None)
    healths = []
    for rows, is_output in ((run.rig.inputs, False), (run.rig.outputs, True)):
        for i, row in enumerate(rows):
            if row.name in run.signals:
                healths.append(_health(run, row, i, is_output, summary))
    return healths


def _health(
    run: Run, row: SignalRow, i: int, is_output: bool, summary: dict | None
) -> SignalHealth:
    values = run.signals[row.name]
    has = bool(len(values)) and bool(np.isfinite(values).any())
    low, high = (
        (float(np.nanmin(values)), float(np.nanmax(values)))
        if has
        else (float("nan"), float("nan"))
    )
    invalid, stale = (
        (0, 0) if is_output else (_marked(run, name, i) for name in ("invalid_mask", "stale_mask"))
    )
    counted = summary is not None and is_output
    held = [
        int(summary.get(key, {}).get(row.name, 0)) if counted else None
        for key in ("clamped", "slewed")
    ]
    before = [
        sum(summary[key].get(row.name, {}).values()) if counted and key in summary else None
        for key in ("controller_clamped", "controller_slewed")
    ]
    return SignalHealth(row, low, high, invalid, stale, *held, *before)


def _marked(run: Run, mask: str, i: int) -> int:
    return int(np.count_nonzero(run.cycle[mask] & np.uint64(1 << i)))

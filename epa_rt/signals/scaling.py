"""The straight line between counts and SI for one row: calibration, gauge pressure and count size
in one.
"""

from dataclasses import dataclass

from epa_rt.config.devices import Entry
from epa_rt.config.rig import Rig
from epa_rt.config.rig_row_checks import reading_line
from epa_rt.config.rig_rows import SignalRow, native_pair


@dataclass(frozen=True)
class Scaling:
    """SI = slope x counts + intercept; ``valid`` counts [low, high] outside of which the sensor is
    not believed.
    """

    slope: float
    intercept: float
    valid_low: int
    valid_high: int

    def to_si(self, counts: int) -> float:
        return self.slope * counts + self.intercept

    def to_counts(self, value: float) -> float:
        """Counts, not yet rounded."""
        return (value - self.intercept) / self.slope


def scaling_of(row: SignalRow, entry: Entry, rig: Rig) -> Scaling:
    """The row's scaling, by its calibration file where it has one. Pressures that are read as
    gauge come out absolute (the rig's atmosphere is added).
    """
    slope, intercept = reading_line(row, entry, rig)
    if row.reads == "gauge":
        intercept += rig.atmosphere_pa
    low, high = entry.counts
    if row.valid is not None:
        native_low, native_high = native_pair(row.valid, entry.unit)
        low = max(low, round(entry.to_counts(native_low)))
        high = min(high, round(entry.to_counts(native_high)))
    if rig.applied_zero is not None and row.name == rig.motor.position:
        intercept += slope * entry.per_count * rig.applied_zero.offset
    if entry.offset:
        intercept += slope * entry.offset
    return Scaling(slope * entry.per_count, intercept, low, high)

"""The i²t limit of a motor winding: a first-order thermal model of the squared current."""

import math


class ThermalLimit:
    """tau dq/dt = I² - q, exact for a current held over each cycle; over once q exceeds the
    continuous current squared.

    ``heat_ratio`` is q over its limit: 1 is the trip. Starts cold; a rig that restarts hot keeps
    its own margin.
    """

    def __init__(self, continuous_a: float, time_constant_s: float, period_s: float):
        self.heat_a2 = 0.0
        self._limit_a2 = continuous_a * continuous_a
        self._gain = -math.expm1(-period_s / time_constant_s)

    def step(self, current_a: float) -> bool:
        """Takes one cycle's current; True where the limit is passed (or the current is NaN)."""
        self.heat_a2 += self._gain * (current_a * current_a - self.heat_a2)
        return not self.heat_a2 <= self._limit_a2

    @property
    def heat_ratio(self) -> float:
        return self.heat_a2 / self._limit_a2

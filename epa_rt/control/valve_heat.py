"""How far the pressure of gas shut in can still go by heat, after what flowed in and out before."""

from math import e, exp

from epa_rt.control.valve_settings import ValveSettings


class HeatAccount:
    """``warm_pa``: the most that the pressure can still fall, for gas is warm; ``cool_pa``: rise.

    Gas that is let in warms by gamma at most: 1 - 1/gamma of the rise is lost again. Gas that
    expands cools alike. How fast walls take it back is not known, and need not be.
    """

    __slots__ = ("warm_pa", "cool_pa", "_share", "_most", "_time_s")

    def __init__(self, settings: ValveSettings) -> None:
        self._share = self._most = settings.relax_ratio
        self._time_s = settings.heat_s
        self.warm_pa = self.cool_pa = 0.0

    def forget(self) -> None:
        """The gas is as warm as its walls."""
        self.warm_pa = self.cool_pa = 0.0

    def flowed(self, before_pa: float, after_pa: float) -> None:
        """Takes a flow from one absolute pressure to another."""
        change_pa = after_pa - before_pa
        if change_pa > 0.0:
            self.warm_pa = min(self.warm_pa + self._share * change_pa, self._most * after_pa)
        elif before_pa > 0.0:
            self.warm_pa *= after_pa / before_pa  # what is left of the gas is as warm as before
            self.cool_pa -= self._share * change_pa

    def moved(self, change_pa: float) -> None:
        """Takes what the pressure did by itself, Pa: so much less is left."""
        self.warm_pa = max(self.warm_pa + min(change_pa, 0.0), 0.0)
        self.cool_pa = max(self.cool_pa - max(change_pa, 0.0), 0.0)

    def stood(self, seconds: float) -> None:
        """Takes a time in which the slowest of walls brought back their part."""
        left = exp(-seconds / self._time_s)
        self.warm_pa *= left
        self.cool_pa *= left

    def fall_pa_s(self, elapsed_s: float) -> float:
        """The fastest fall by heat so long after closing.

        A exp(-t/T)/T is largest at T = t, whatever the walls: A/(e t).
        """
        return self.warm_pa / (e * elapsed_s)

    def rise_pa_s(self, elapsed_s: float) -> float:
        """The fastest rise by heat so long after closing."""
        return self.cool_pa / (e * elapsed_s)

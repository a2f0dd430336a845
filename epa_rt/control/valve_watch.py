"""Filters of the valve set-and-hold: for flow a ramp follower, for settling block averages, for
holding a slow watch.
"""

from math import exp, nan


def share(dt_s: float, time_constant_s: float) -> float:
    """Weight of a new sample in a first-order filter, exact for the period."""
    return 1.0 - exp(-dt_s / time_constant_s)


class RampFollower:
    """Level and rate of a pressure that rises or falls steadily, from two filters in a row (no ramp
    lag).
    """

    __slots__ = ("level_pa", "rate_pa_s", "_first_pa", "_second_pa", "_share", "_to_rate")

    def start(self, pressure_pa: float, dt_s: float, time_constant_s: float = 0.008) -> None:
        """Begin at rest at this pressure."""
        self.level_pa = self._first_pa = self._second_pa = pressure_pa
        self.rate_pa_s = 0.0
        self._share = min(share(dt_s, time_constant_s), 0.8)
        self._to_rate = self._share / ((1.0 - self._share) * dt_s)

    def step(self, pressure_pa: float) -> None:
        """Take one sample in Pa."""
        self._first_pa += self._share * (pressure_pa - self._first_pa)
        self._second_pa += self._share * (self._first_pa - self._second_pa)
        lag_pa = self._first_pa - self._second_pa
        self.level_pa = self._first_pa + lag_pa
        self.rate_pa_s = lag_pa * self._to_rate


class BlockAverage:
    """Averages over blocks of `block_s`, with the change across the last four of them."""

    __slots__ = (
        "mean_pa",
        "change_pa",
        "rate_pa_s",
        "_block_s",
        "_sum",
        "_count",
        "_elapsed_s",
        "_older",
    )

    def __init__(self, block_s: float) -> None:
        self._block_s = block_s
        self.start()

    def start(self) -> None:
        """Forget everything."""
        self.mean_pa = self.change_pa = self.rate_pa_s = nan
        self._sum = self._elapsed_s = 0.0
        self._count = 0
        self._older = (nan, nan, nan)

    def step(self, pressure_pa: float, dt_s: float) -> bool:
        """Take one sample; True when a block is full and the averages are new."""
        self._sum += pressure_pa
        self._count += 1
        self._elapsed_s += dt_s
        if self._elapsed_s < self._block_s:
            return False
        first, second, third = self._older
        mean_pa = self._sum / self._count
        self.change_pa = mean_pa - first
        self.rate_pa_s = self.change_pa / (3.0 * self._elapsed_s)
        self._older = (second, third, mean_pa)
        self.mean_pa = mean_pa
        self._sum = self._elapsed_s = 0.0
        self._count = 0
        return True


class HoldWatch:
    """Slow average with both valves closed, and a slower one that tells a dump from a drift."""

    __slots__ = (
        "slow_pa",
        "_slower_pa",
        "_share",
        "_slower_share",
        "_lost_ratio",
        "_atmosphere_pa",
    )

    def __init__(self, lost_ratio: float, atmosphere_pa: float) -> None:
        self._lost_ratio = lost_ratio
        self._atmosphere_pa = atmosphere_pa
        self._share = self._slower_share = 0.0
        self.slow_pa = self._slower_pa = nan

    def set_period(self, dt_s: float, average_s: float, reference_s: float) -> None:
        """Fit the filters to the cycle."""
        self._share = share(dt_s, average_s)
        self._slower_share = share(dt_s, reference_s)

    def start(self, pressure_pa: float) -> None:
        """Begin at this pressure."""
        self.slow_pa = self._slower_pa = pressure_pa

    def step(self, pressure_pa: float) -> int:
        """Take one sample; +1 when pressure was gained, -1 when it was lost, else 0."""
        slow = self.slow_pa + self._share * (pressure_pa - self.slow_pa)
        slower = self._slower_pa + self._slower_share * (slow - self._slower_pa)
        self.slow_pa = slow
        self._slower_pa = slower
        change = slow - slower
        lost = self._lost_ratio * slower
        if change >= 0.0:
            return 1 if change > lost else 0
        # Near atmosphere no share of the absolute pressure can be lost: there it is three quarters
        # of the gauge one.
        gauge = slower - self._atmosphere_pa
        if change < -lost or change < -0.75 * gauge < -7500.0:
            return -1
        return 0

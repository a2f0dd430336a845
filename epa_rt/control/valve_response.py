"""What one valve has been seen to do: pressure per second open, and how long flow outlasts the
command.
"""

from math import sqrt

# Shape only: one typical critical pressure ratio, since each valve's strength is learned (ISO 6358
# gives the form).
_CRITICAL_RATIO = 0.4


def flow_shape(upstream_pa: float, downstream_pa: float) -> float:
    """Flow through an orifice over its choked flow at the same upstream pressure, at least 0.1."""
    ratio = downstream_pa / upstream_pa
    if ratio <= _CRITICAL_RATIO:
        return 1.0
    if ratio >= 1.0:
        return 0.1
    part = (ratio - _CRITICAL_RATIO) / (1.0 - _CRITICAL_RATIO)
    return max(0.1, sqrt(1.0 - part * part))


class ValveResponse:
    """Learned rate of one valve in Pa/s, scaled over pressure by the shape of the flow, and its
    lead in s.
    """

    __slots__ = ("lead_s", "_strength", "_inlet", "_supply_pa", "_atmosphere_pa")

    def __init__(
        self, inlet: bool, rate_pa_s: float, lead_s: float, supply_pa: float, atmosphere_pa: float
    ) -> None:
        self.lead_s = lead_s
        self._strength = rate_pa_s
        self._inlet = inlet
        self._supply_pa = supply_pa
        self._atmosphere_pa = atmosphere_pa

    def rate_pa_s(self, pressure_pa: float) -> float:
        """Size of the pressure change per second of opening at this pressure, always positive."""
        return self._strength * self._shape(pressure_pa)

    def learn_rate(self, pressure_pa: float, rate_pa_s: float) -> None:
        """Take a rate seen during long flow."""
        self._strength = max(rate_pa_s, 1e3) / self._shape(pressure_pa)

    def learn_pulse(self, pressure_pa: float, width_s: float, change_pa: float) -> None:
        """Take the settled change after one pulse, in the valve's own direction; small ones weigh
        less: noise.
        """
        expected_pa = self.rate_pa_s(pressure_pa) * width_s
        ratio = min(max(change_pa / expected_pa, 0.35), 3.0)
        weight = expected_pa / (expected_pa + 1000.0)
        self._strength *= 1.0 + weight * (ratio - 1.0)

    def learn_lead(self, carried_pa: float, rate_pa_s: float) -> None:
        """Take how far the pressure went on after closing at that rate."""
        if rate_pa_s > 0.0:
            seen_s = min(max(carried_pa / rate_pa_s, 0.0), 0.15)
            self.lead_s += 0.5 * (seen_s - self.lead_s)

    def _shape(self, pressure_pa: float) -> float:
        if self._inlet:
            return flow_shape(self._supply_pa, pressure_pa)
        return pressure_pa / self._supply_pa * flow_shape(pressure_pa, self._atmosphere_pa)

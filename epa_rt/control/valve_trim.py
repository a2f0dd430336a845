"""What to do about a settled pressure that is off its target: one pulse, a longer flow, or nothing
more.
"""

from enum import Enum

from epa_rt.control.valve_response import ValveResponse
from epa_rt.control.valve_settings import ValveCause, ValveSettings

_DEAD_PULSES = 5  # long ones in a row


class TrimStep(Enum):
    """The answer of `Trim.decide`."""

    HOLD = "within tolerance"
    ACCEPT = "as near as pulses get"
    FLOW = "fill or exhaust"
    PULSE = "one pulse"
    FAIL = "give up"


class Trim:
    """Learned responses of both valves and the count of openings; pressures in Pa, widths in s.

    After `decide`: `direction` (+1 inlet, -1 exhaust), `width_s` of a pulse, `cause` and `text` of
    a failure or acceptance.
    """

    __slots__ = (
        "settings",
        "inlet",
        "exhaust",
        "direction",
        "pulses",
        "width_s",
        "cause",
        "text",
        "_dead",
        "_before_pa",
    )

    def __init__(self, settings: ValveSettings) -> None:
        s = self.settings = settings
        bounds = (s.response_pa_s, s.lead_s, s.supply_pa, s.atmosphere_pa)
        self.inlet, self.exhaust = ValveResponse(True, *bounds), ValveResponse(False, *bounds)
        self.cause, self.text = ValveCause.NONE, ""
        self.start()

    def start(self) -> None:
        """Begin a new target; what the valves have been seen to do is kept."""
        self.pulses = self._dead = self.direction = 0
        self.width_s = self._before_pa = 0.0

    @property
    def response(self) -> ValveResponse:
        """Of the valve that was opened last."""
        return self.inlet if self.direction > 0 else self.exhaust

    def learn(self, mean_pa: float) -> None:
        """Take the settled pressure after a pulse; without effect after a longer flow."""
        if self.width_s == 0.0:
            return
        response = self.response
        change = self.direction * (mean_pa - self._before_pa)
        if change >= 0.25 * response.rate_pa_s(self._before_pa) * self.width_s:
            self._dead = 0
        elif self.width_s >= 0.9 * self.settings.pulse_max_s:
            self._dead += 1
        response.learn_pulse(self._before_pa, self.width_s, change)
        self.width_s = 0.0

    def decide(self, mean_pa: float, target_pa: float, shortest_s: float) -> TrimStep:
        """What a settled average asks for; shortest_s is one cycle."""
        error = target_pa - mean_pa
        if abs(error) <= self.settings.tolerance_pa:
            return TrimStep.HOLD
        if self.pulses >= self.settings.max_pulses:
            return self._as_near(error, f"after {self.pulses} openings")
        return self._open(mean_pa, error, max(shortest_s, self.settings.pulse_min_s))

    def _open(self, mean_pa: float, error_pa: float, shortest_s: float) -> TrimStep:
        s = self.settings
        sign = 1 if error_pa > 0.0 else -1
        size = abs(error_pa)
        rate = (self.inlet if sign > 0 else self.exhaust).rate_pa_s(mean_pa)
        if size <= 3.0 * s.tolerance_pa and rate * shortest_s > 1.8 * size:
            return self._as_near(
                error_pa, f"the shortest pulse moves {rate * shortest_s / 1e3:.1f} kPa"
            )
        if sign != self.direction:
            self._dead = 0
        elif self._dead >= _DEAD_PULSES:
            self.cause = (
                ValveCause.INLET_STUCK_CLOSED if sign > 0 else ValveCause.EXHAUST_STUCK_CLOSED
            )
            self.text = f"{self._dead} long pulses without an effect at {mean_pa / 1e3:.1f} kPa abs"
            return TrimStep.FAIL
        self.direction = sign
        self.pulses += 1
        self._before_pa = mean_pa
        if size > rate * s.pulse_max_s and size > 3.0 * s.no_rise_pa:
            self.width_s = 0.0
            return TrimStep.FLOW
        # Near atmosphere a slow valve moves too little in pulse_max_s to be told from a dead one:
        # up to 8 times that.
        self.width_s = min(max(size / rate, shortest_s), s.pulse_max_s * (1 << min(self._dead, 3)))
        return TrimStep.PULSE

    def _as_near(self, error_pa: float, why: str) -> TrimStep:
        if abs(error_pa) > 3.0 * self.settings.tolerance_pa:
            self.cause = ValveCause.TIME_OUT
            self.text = f"{error_pa / 1e3:+.1f} kPa still to go {why}"
            return TrimStep.FAIL
        self.text = f"held {error_pa / 1e3:+.1f} kPa short of the target: {why}"
        return TrimStep.ACCEPT

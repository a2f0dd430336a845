"""PID with the derivative on the measurement and an integral that cannot wind up."""

from dataclasses import dataclass
from math import exp, inf, isfinite, nan, pi


@dataclass(frozen=True, slots=True)
class PidGains:
    """Gains and limits of one PID.

    Output unit U, error unit E: kp in U/E, ki in U/(E s), kd in U s/E, low and high in U.
    ValueError if a gain is not finite, the cut-off is not above zero (infinite: no filter) or low
    >= high.
    """

    kp: float
    ki: float = 0.0
    kd: float = 0.0
    derivative_cutoff_hz: float = inf
    low: float = -inf
    high: float = inf

    def __post_init__(self) -> None:
        for name in ("kp", "ki", "kd"):
            if not isfinite(getattr(self, name)):
                raise ValueError(f"{name}: found {getattr(self, name)}, expected a finite number")
        if not self.derivative_cutoff_hz > 0.0:
            raise ValueError(
                f"derivative_cutoff_hz: found {self.derivative_cutoff_hz}, expected above zero"
            )
        if not self.low < self.high:
            raise ValueError(f"low, high: found {self.low}, {self.high}, expected low < high")


class Pid:
    """One PID loop; the output is within [low, high], or NaN when an input was not finite.

    `saturated` counts the steps in which the output or the integral was clamped.
    """

    __slots__ = (
        "gains",
        "saturated",
        "_kp",
        "_ki",
        "_kd",
        "_low",
        "_high",
        "_integral",
        "_error",
        "_measurement",
        "_rate",
        "_start",
        "_dt_s",
        "_share",
    )

    def __init__(self, gains: PidGains) -> None:
        self.saturated = 0
        self._integral = self._error = self._rate = 0.0
        self._measurement = nan
        self._start: float | None = None
        self._take(gains)

    def reset(self, measurement: float, output: float) -> None:
        """Start over so that the next step yields `output`, whatever its error and feedforward."""
        self._measurement = measurement
        self._rate = 0.0
        self._start = output

    def set_gains(self, gains: PidGains) -> None:
        """Change the gains without moving the output; new limits hold from the next step."""
        # The integral is kept in output units, so only the P and D terms move, and it takes up the
        # difference.
        self._integral += (self._kp - gains.kp) * self._error - (self._kd - gains.kd) * self._rate
        self._take(gains)

    def step(self, reference: float, measurement: float, feedforward: float, dt_s: float) -> float:
        """Output of this cycle; dt_s in s, ValueError if not above zero. NaN in gives NaN out,
        state untouched.
        """
        if dt_s != self._dt_s:
            self._set_period(dt_s)
        previous = self._measurement
        error = reference - measurement
        # A constant slope between samples makes this discretisation of the first-order filter
        # exact.
        slope = (measurement - previous) / dt_s if previous == previous else 0.0
        rate = self._rate + self._share * (slope - self._rate)
        without_integral = self._kp * error - self._kd * rate + feedforward
        if without_integral - without_integral != 0.0:  # true for NaN and for infinity
            return nan
        self._measurement = measurement
        self._rate = rate
        self._error = error
        if self._start is not None:
            integral = self._seed(without_integral)
        else:
            integral = self._integral + self._ki * error * dt_s
        return self._limit(without_integral, integral)

    def _limit(self, without_integral: float, integral: float) -> float:
        low = self._low
        high = self._high
        # Headroom after P + D + F, never negative: a P term beyond the limit must not drag the
        # integral the other way.
        up = high - without_integral
        down = low - without_integral
        clamped = False
        if integral > up:
            clamped = True
            integral = up if up > 0.0 else min(integral, 0.0)
        elif integral < down:
            clamped = True
            integral = down if down < 0.0 else max(integral, 0.0)
        self._integral = integral
        output = without_integral + integral
        # Not elif: rounding of (limit - x) + x can leave the sum one ulp outside.
        if output > high:
            output = high
        elif output < low:
            output = low
        if clamped:
            self.saturated += 1
        return output

    def _seed(self, without_integral: float) -> float:
        start, self._start = self._start, None
        return start - without_integral if start is not None and start == start else 0.0

    def _take(self, gains: PidGains) -> None:
        self.gains = gains
        self._kp, self._ki, self._kd = gains.kp, gains.ki, gains.kd
        self._low, self._high = gains.low, gains.high
        self._dt_s, self._share = nan, 0.0  # fitted on the next step

    def _set_period(self, dt_s: float) -> None:
        if not 0.0 < dt_s < inf:
            raise ValueError(f"dt_s: found {dt_s}, expected above zero")
        self._dt_s = dt_s
        self._share = 1.0 - exp(-2.0 * pi * self.gains.derivative_cutoff_hz * dt_s)

"""The cycle edges of a real bus: on the monotonic clock, steered to the reference clock of the
bus.
"""

import time


class Edges:
    """Cycle edges without drift: each one period after the last, plus what ``steer`` adds. Edges
    missed whole are skipped.
    """

    def __init__(self, period_ns: int):
        self._period_ns = period_ns
        self._next_ns = self._mark_ns = 0

    def start(self) -> None:
        self._mark_ns = time.monotonic_ns()
        self._next_ns = self._mark_ns + self._period_ns

    def wait(self) -> tuple[int, int]:
        """Sleeps to the next edge. Gives that edge on the monotonic clock and how late the wake-up
        is, both in ns.
        """
        now_ns, edge_ns = time.monotonic_ns(), self._next_ns
        if now_ns < edge_ns:
            time.sleep((edge_ns - now_ns) * 1e-9)
            now_ns = time.monotonic_ns()
        lateness_ns = max(0, now_ns - edge_ns)
        self._next_ns = edge_ns + self._period_ns * (1 + lateness_ns // self._period_ns)
        return edge_ns, lateness_ns

    def busy_ns(self) -> int:
        """Since ``mark``: what everything above the backend took."""
        return time.monotonic_ns() - self._mark_ns

    def mark(self) -> None:
        """The exchange is done."""
        self._mark_ns = time.monotonic_ns()

    def steer(self, correction_ns: int) -> None:
        """Moves the edges to come."""
        self._next_ns += correction_ns


class ReferenceClock:
    """PI loop from the bus's distributed clock to a correction of the next edge; reads no clock
    itself.

    It wants the frame of each cycle at the reference clock half a period after SYNC0. What is
    steered is the planned edge: how long after it the frame was sent is taken out, and a frame
    whose round trip was long is not believed, for nobody knows where it waited. Gains: SOEM's
    example (P 0.01, I 0.00002 per cycle, half a period of offset), ten times faster until the
    offset, averaged over ``NEAR_CYCLES``, is small. ``offset_ns`` is the last offset believed.
    """

    P, I = 0.01, 0.00002
    FASTER = 10.0
    NEAR_NS, NEAR_CYCLES = 10_000, 50
    STEP_NS = 100_000  # once locked, an offset larger than this counts as this
    SLOW_NS = 5_000  # beyond one and a half times the usual round trip

    def __init__(self, period_ns: int):
        self._period_ns = period_ns
        self._target_ns = period_ns // 2
        self._limit = period_ns / 10
        self._integral = self._rest = 0.0  # both in ns of correction
        self._spread_ns = float(period_ns)
        self._usual_ns = 0.0
        self._last_ns: int | None = None
        self.offset_ns = 0
        self.locked = False

    def is_new(self, dc_time_ns: int) -> bool:
        """False for a reference time that does not follow the last one: the frame is an old one
        that came again.
        """
        return self._last_ns is None or dc_time_ns > self._last_ns

    def step(self, dc_time_ns: int, sent_after_ns: int, round_trip_ns: int) -> int:
        """Takes the reference time that a cycle's frame brought, how long after the planned edge it
        was sent and how long it took; gives what to add to the next edge. All in ns.
        """
        self._last_ns = dc_time_ns
        wanted = self._integral
        if self._is_quick(round_trip_ns):
            half = self._period_ns // 2
            offset = self.offset_ns = (
                dc_time_ns - sent_after_ns - self._target_ns + half
            ) % self._period_ns - half
            wanted = self._steer(offset)
        wanted = max(-self._limit, min(self._limit, wanted)) + self._rest
        correction = round(wanted)
        self._rest = wanted - correction  # parts of a nanosecond add up: 1 ppm is one per cycle
        return correction

    def _is_quick(self, round_trip_ns: int) -> bool:
        """Follows the usual round trip down quickly and up slowly, whatever single frames do."""
        usual = self._usual_ns or float(round_trip_ns)
        slower = min(round_trip_ns, 2 * usual) - usual
        self._usual_ns = usual + slower / (16 if slower < 0 else 256)
        return round_trip_ns < 1.5 * usual + self.SLOW_NS

    def _steer(self, offset: int) -> float:
        if not self.locked:
            self._spread_ns += (abs(offset) - self._spread_ns) / self.NEAR_CYCLES
            self.locked = self._spread_ns < self.NEAR_NS
        faster = 1.0 if self.locked else self.FASTER
        if self.locked:
            offset = max(-self.STEP_NS, min(self.STEP_NS, offset))
        self._integral = max(
            -self._limit, min(self._limit, self._integral - self.I * faster**2 * offset)
        )
        return self._integral - self.P * faster * offset

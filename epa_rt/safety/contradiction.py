"""The motor's position against its speed: a jump of the encoder, a position or a speed that stands
while it moves.
"""

import math

from epa_rt.config.rig import Rig

JUMP_SHARE = 1.5  # of what the speed row's limit allows in the time between two positions
APART_S = 0.004  # of travel at that limit, by which the two may differ: the drive filters its speed
FORGET_S = 0.050  # an error of the speed's scale must not add up for ever

Refusal = tuple[str, str, str]  # cause, signal, sentence


class MotionCheck:
    """``step`` once per cycle; a refusal, or None. Without a speed row that has limits it never
    speaks.

    The difference between travel and integrated speed is kept with a fading memory; both in SI.
    A speed that is off by d m/s is found after -FORGET_S ln(1 - APART_S limit / (FORGET_S d)), and
    not at all where d is less than APART_S / FORGET_S of the limit, 8 %. A position that stands is
    off by the whole speed, one of the wrong sign by twice that.
    """

    def __init__(self, rig: Rig):
        motor = rig.motor
        limits = rig.row(motor.speed).limits if motor.speed else None
        self._speaks = limits is not None
        self._fastest = max(abs(limits[0]), abs(limits[1])) if limits is not None else 0.0
        self._position, self._speed, self._dt_s = motor.position, motor.speed or "", rig.period_s
        self._jump = JUMP_SHARE * self._fastest
        self._most_apart = APART_S * self._fastest
        self._hold_s = rig.safety.position_hold
        self._last: float | None = None
        self._last_speed = self._apart = self._age_s = 0.0
        self._cycles = self._last_ns = 0

    def step(self, measured: dict[str, float], bus_ok: bool, now_ns: int = 0) -> Refusal | None:
        """Takes one cycle that was read at ``now_ns`` (0: by a backend without a clock). Without
        ``bus_ok`` the values are old and only the time goes on.

        The speed counts for the time between two sound reads, by the clock: cycles that come late
        and those behind them have no bias. What it did between the two reads is known no better
        than by half its change. A jump is what no time that may have passed between the two
        positions allows: cycles or clock, or as long as the last position may have been held.
        """
        if not self._speaks:
            return None
        self._cycles += 1
        if not bus_ok:
            return None
        position, speed = measured[self._position], measured[self._speed]
        by_cycles_s, by_clock_s = self._cycles * self._dt_s, 1e-9 * (now_ns - self._last_ns)
        last, last_speed = self._last, self._last_speed
        self._last, self._last_speed, self._cycles, self._last_ns = position, speed, 0, now_ns
        if last is None:
            return None
        moved = position - last
        longest_s = by_clock_s if by_clock_s > by_cycles_s else by_cycles_s
        self._age_s += longest_s
        could_move_s = max(longest_s, min(self._age_s, self._hold_s))
        if moved != 0.0:
            self._age_s = longest_s
        self._add(
            moved, speed, last_speed, by_clock_s if now_ns and by_clock_s > 0.0 else by_cycles_s
        )
        if not abs(moved) <= self._jump * could_move_s:
            return (
                "position jump",
                self._position,
                f"{self._position} jumped by {moved:.4g} in {1e3 * could_move_s:.3g} ms",
            )
        if not abs(self._apart) <= self._most_apart:
            text = f"{self._position} and {self._speed} contradict each other by {self._apart:.4g}"
            return "contradiction", self._position, text
        return None

    def _add(self, moved: float, speed: float, last_speed: float, elapsed_s: float) -> None:
        """Lets the memory fade, and adds what the two differ by in this time."""
        difference = moved - 0.5 * (speed + last_speed) * elapsed_s
        unknown = 0.5 * abs(speed - last_speed) * elapsed_s
        if abs(difference) <= unknown:
            difference = 0.0
        else:  # NaN comes here as well, and stays
            difference -= math.copysign(unknown, difference)
        self._apart = max(0.0, 1.0 - elapsed_s / FORGET_S) * self._apart + difference

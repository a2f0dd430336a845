"""The motor's position against its speed: a jump of the encoder, a position or a speed that stands
while it moves.
"""

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import reading

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
        self._last_speed = self._apart = 0.0
        self._age_s = self._hold_s  # of a position that was there before the first read
        self._cycles_s, self._last_ns = self._dt_s, 0

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
        if not bus_ok:
            self._cycles_s += self._dt_s
            return None
        position, speed, last = measured[self._position], measured[self._speed], self._last
        elapsed_s, longest_s = 1e-9 * (now_ns - self._last_ns), self._cycles_s
        change, self._last_speed = speed - self._last_speed, speed
        self._last, self._cycles_s, self._last_ns = position, self._dt_s, now_ns
        if last is None:
            return None
        if elapsed_s > longest_s:
            longest_s = elapsed_s
        elif elapsed_s <= 0.0:
            elapsed_s = longest_s
        moved, half = position - last, 0.5 * change
        unknown = (half if half > 0.0 else -half) * elapsed_s
        difference = moved - (speed - half) * elapsed_s
        if difference > unknown:
            difference -= unknown
        elif difference < -unknown:
            difference += unknown
        elif difference == difference:  # what is not a number stays
            difference = 0.0
        if elapsed_s < FORGET_S:
            difference += (1.0 - elapsed_s / FORGET_S) * self._apart
        self._apart = difference
        held_s = self._age_s + longest_s
        self._age_s = longest_s if moved else held_s
        far, apart = self._jump * longest_s, self._most_apart
        if -far <= moved <= far and -apart <= difference <= apart:
            return None
        return self._judge(moved, max(longest_s, min(held_s, self._hold_s)))

    def _judge(self, moved: float, could_move_s: float) -> Refusal | None:
        """What is too far for one cycle: a jump, unless the last position may have been held."""
        if not abs(moved) <= self._jump * could_move_s:
            far = reading(self._position, moved)
            return (
                "position jump",
                self._position,
                f"{self._position} jumped by {far} in {1e3 * could_move_s:g} ms",
            )
        if not abs(self._apart) <= self._most_apart:
            apart = reading(self._position, self._apart)
            text = f"{self._position} and {self._speed} contradict each other by {apart}"
            return "contradiction", self._position, text
        return None

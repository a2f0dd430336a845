"""The motor's position against its speed: a jump of the encoder, a position or a speed that stands
while it moves.
"""

from epa_rt.config.rig import Rig

JUMP_SHARE = 1.5  # of what the speed row's limit allows in the time since the last good cycle
APART_S = 0.004  # of travel at that limit, by which the two may differ: the drive filters its speed
FORGET_S = 0.050  # an error of the speed's scale must not add up for ever

Refusal = tuple[str, str, str]  # cause, signal, sentence


class MotionCheck:
    """``step`` once per cycle; a refusal, or None. Without a speed row that has limits it never
    speaks.

    The difference between travel and integrated speed is kept with a fading memory; both in SI.
    """

    def __init__(self, rig: Rig):
        motor = rig.motor
        limits = rig.row(motor.speed).limits if motor.speed else None
        self._speaks = limits is not None
        self._fastest = max(abs(limits[0]), abs(limits[1])) if limits is not None else 0.0
        self._position, self._speed, self._dt_s = motor.position, motor.speed, rig.period_s
        self._keep = 1.0 - rig.period_s / FORGET_S
        self._last: float | None = None
        self._apart, self._cycles, self._last_ns = 0.0, 0, 0

    def step(self, measured: dict[str, float], bus_ok: bool, now_ns: int = 0) -> Refusal | None:
        """Takes one cycle that was read at ``now_ns``. Without ``bus_ok`` the values are old and
        only the time goes on.

        A loop that wakes late reads positions that are further apart: what has passed is the longer
        of cycles and clock.
        """
        if not self._speaks:
            return None
        self._cycles += 1
        if not bus_ok:
            return None
        position, elapsed_s = (
            measured[self._position],
            max(self._cycles * self._dt_s, 1e-9 * (now_ns - self._last_ns)),
        )
        last, self._last, self._cycles, self._last_ns = self._last, position, 0, now_ns
        if last is None:
            return None
        moved = position - last
        self._apart = self._keep * self._apart + moved - measured[self._speed] * elapsed_s
        if not abs(moved) <= JUMP_SHARE * self._fastest * elapsed_s:
            return (
                "position jump",
                self._position,
                f"{self._position} jumped by {moved:.4g} in {1e3 * elapsed_s:g} ms",
            )
        if not abs(self._apart) <= APART_S * self._fastest:
            text = f"{self._position} and {self._speed} contradict each other by {self._apart:.4g}"
            return "contradiction", self._position, text
        return None

"""Two muscles whose hoses are exchanged: each pressure follows the other muscle's volume."""

from epa_rt.config.rig import Muscle
from epa_rt.safety.gas_watch import CAUSE, Refusal
from epa_rt.safety.muscle_law import MuscleGeometry

SLOW_S, FORGET_S, REST_S = 1.0, 5.0, 0.5  # as where a pressure is held against its own volume
ENOUGH_S = 2e-5  # of squared relative change of either volume over time: 0.45 % for a second
OTHERS = 0.4  # squared correlation with the other's volume: so much of a pressure is explained
OUT_S = 0.4  # for so long


class HoseWatch:
    """``step`` once per ``dt_s``; a refusal where, with all valves shut, both pressures fall with
    their own muscle's stretch and follow the other's. A sound muscle's never falls with it.
    """

    def __init__(
        self, muscles: tuple[Muscle, ...], geometries: tuple[MuscleGeometry, ...], dt_s: float
    ):
        self._muscles, self._geometries, self._dt_s = muscles, geometries, dt_s
        self._valves = tuple(valve for m in muscles for valve in (m.inlet, m.exhaust))
        self._follow, self._keep = dt_s / SLOW_S, 1.0 - dt_s / FORGET_S
        self._shut_s = self._out_s = 0.0
        self._slow = [1.0, 1.0, 1.0, 1.0]  # pressures, then what volumes make of them
        self._squares = [0.0, 0.0, 0.0, 0.0]
        self._own, self._other = [0.0, 0.0], [0.0, 0.0]

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample."""
        one, two = self._muscles
        first, second = self._geometries
        now = (
            measured[one.pressure],
            measured[two.pressure],
            1.0 / first.volume_ratio(first.length(measured)),
            1.0 / second.volume_ratio(second.length(measured)),
        )
        for valve in self._valves:
            if outputs[valve]:
                self._shut_s = 0.0
        self._shut_s += self._dt_s
        slow = self._slow
        if self._shut_s < REST_S:
            slow[:] = now
            for sums in (self._squares, self._own, self._other):
                sums[:] = [0.0] * len(sums)
            return None
        dt_s, keep, squares = self._dt_s, self._keep, self._squares
        for i in range(4):
            slow[i] += self._follow * (now[i] - slow[i])
        change = [now[i] / slow[i] - 1.0 for i in range(4)]
        for i in range(4):
            squares[i] = keep * squares[i] + dt_s * change[i] * change[i]
        for i in range(2):
            self._own[i] = keep * self._own[i] + dt_s * change[i] * change[2 + i]
            self._other[i] = keep * self._other[i] + dt_s * change[i] * change[3 - i]
        self._out_s = self._out_s + dt_s if self._exchanged() else 0.0
        if self._out_s < OUT_S:
            return None
        return (
            CAUSE,
            one.pressure,
            f"{one.pressure} follows the volume of {two.name}, and {two.pressure} that of"
            f" {one.name}; check the hoses of {one.name} and {two.name} (exchanged)",
        )

    def _exchanged(self) -> bool:
        squares, other = self._squares, self._other
        if min(squares[2], squares[3]) < ENOUGH_S or max(self._own) >= 0.0 or min(other) <= 0.0:
            return False
        one = other[0] * other[0] >= OTHERS * squares[0] * squares[3]
        return one and other[1] * other[1] >= OTHERS * squares[1] * squares[2]

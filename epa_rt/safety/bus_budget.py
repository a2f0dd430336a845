"""How much sound process data may be missing: in a row, and over time.

A bus that loses two of three frames never loses many in a row, and yet nothing holds the rig any
more.
"""

from epa_rt.config.rig import Rig

LOST_TIME_SHARE = 0.6  # of the reaction time: two of three cycles lost pass it within that time


def frame_timeout_s(rig: Rig) -> float:
    """When a frame counts as lost: as the rig file says, or so that the allowed number of them fits
    into the reaction time.
    """
    if rig.master.frame_timeout is not None:
        return float(rig.master.frame_timeout)
    return float(max(rig.period_s, rig.safety.reaction / (rig.safety.lost_cycles + 1)))


class BusBudget:
    """``step`` once per cycle; a sentence once too much is missing, else an empty one.

    In a row: ``safety.lost_cycles``. Over time: a bad cycle adds the time that it took, a sound one
    takes off as much as lets ``safety.lost_share`` of the time be bad for ever; what may gather is
    ``safety.lost_time``, by default 0.6 of the reaction time, and never less than a row may take.
    A bad cycle takes no longer than a frame is waited for, and one period until the next begins:
    beyond that this machine stood still, which is the overruns' matter and is said.
    ``clear``: nothing is missing, so that a sound cycle need not be told. ``allowed_s``: what may
    gather over time.
    """

    def __init__(self, rig: Rig):
        safety, frame_s = rig.safety, rig.master.frame_timeout or 0.0
        self.clear = True
        self._row, self._row_allowed = 0, safety.lost_cycles
        lost_s = safety.lost_time
        self.allowed_s: float = max(
            LOST_TIME_SHARE * safety.reaction if lost_s is None else lost_s,
            safety.lost_cycles * max(frame_s, rig.period_s),
        )
        self._share = safety.lost_share
        self._leak = safety.lost_share / (1.0 - safety.lost_share)
        self._level_s, self._dt_s, self._since_ns = 0.0, rig.period_s, 0
        self._longest_s = max(rig.period_s, frame_timeout_s(rig)) + rig.period_s
        self._stalled_s = 0.0

    def step(self, bus_ok: bool, now_ns: int) -> str:
        """Takes one cycle that began at ``now_ns`` (0: by a backend without a clock). How long a
        bad one took shows when the next one begins.
        """
        if self._row:
            took_s = 1e-9 * (now_ns - self._since_ns)
            self._level_s += max(0.0, min(took_s, self._longest_s) - self._dt_s)
            self._stalled_s += max(0.0, took_s - self._longest_s)
        self._since_ns = now_ns
        if bus_ok:
            self._row = 0
            self._level_s -= self._leak * self._dt_s
            if self._level_s < 1e-9:
                self._level_s, self._stalled_s, self.clear = 0.0, 0.0, True
        else:
            self.clear = False
            self._row += 1
            self._level_s += self._dt_s
        if self._row >= self._row_allowed:
            return f"the working counter was wrong in {self._row} cycles in a row{self._stall()}"
        if self._level_s > self.allowed_s:
            return (
                f"the working counter was wrong for {1e3 * self._level_s:.3g} ms more than"
                f" {100.0 * self._share:g} % of the time, of {1e3 * self.allowed_s:g} ms"
                f" allowed{self._stall()}"
            )
        return ""

    def _stall(self) -> str:
        """What this machine added to it, as a clause; nothing where it did not stand still."""
        if not self._stalled_s:
            return ""
        return f", while this machine let the loop stand still for {1e3 * self._stalled_s:.3g} ms"

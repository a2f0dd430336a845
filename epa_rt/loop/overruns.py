"""Counting late cycles, and what the rig file says to do about them."""

from epa_rt.config.rig import Overrun


class Overruns:
    """A cycle whose exchange began more than ``late`` after its edge is an overrun.

    ``count`` of all, ``in_a_row`` now, ``worst_ns``. Once too many follow each other, ``step``
    answers with the policy's word "stop" or "trip" ("count" does not answer). Once the loop is late
    all the time it answers under every policy, and with "stop" under "count": late cycles add the
    periods that they took, others take off as much as lets ``late_share`` of the time be late for
    ever, and ``late_time`` may gather (``level_s``). ``wants_stop`` stays set after "stop", and
    ``text`` says why.
    """

    __slots__ = (
        "count",
        "in_a_row",
        "worst_ns",
        "wants_stop",
        "level_s",
        "text",
        "_late_ns",
        "_allowed",
        "_policy",
        "_always",
        "_leak_s",
        "_allowed_s",
        "_period_ns",
        "_period_s",
        "_share",
    )

    def __init__(self, overrun: Overrun, period_s: float):
        self.count = self.in_a_row = self.worst_ns = 0
        self.wants_stop, self.level_s, self.text = False, 0.0, ""
        self._late_ns = round(overrun.late * 1e9)
        self._allowed = overrun.in_a_row
        self._policy = "" if overrun.policy == "count" else overrun.policy
        self._always = self._policy or "stop"
        self._share = overrun.late_share
        self._leak_s = period_s * overrun.late_share / (1.0 - overrun.late_share)
        self._allowed_s = overrun.late_time
        self._period_ns, self._period_s = round(period_s * 1e9), period_s

    def step(self, lateness_ns: int) -> str:
        """Takes one cycle's lateness."""
        if lateness_ns > self.worst_ns:
            self.worst_ns = lateness_ns
        if lateness_ns <= self._late_ns:
            self.in_a_row = 0
            if self.level_s > 0.0:
                self.level_s = max(0.0, self.level_s - self._leak_s)
            return ""
        self.count += 1
        self.in_a_row += 1
        self.level_s += self._period_s * (1 + lateness_ns // self._period_ns)
        answer = ""
        if self.level_s > self._allowed_s:
            answer = self._always
            self.text = (
                f"this machine let the loop be late for {self.level_s:.3g} s more than"
                f" {100.0 * self._share:g} % of the time, of {self._allowed_s:g} s allowed, the"
                f" last cycle by {lateness_ns / 1e6:.3f} ms"
            )
        elif self._policy and self.in_a_row >= self._allowed:
            answer = self._policy
            self.text = (
                f"{self.in_a_row} late cycles in a row, the last by {lateness_ns / 1e6:.3f} ms"
            )
        self.wants_stop = self.wants_stop or answer == "stop"
        return answer

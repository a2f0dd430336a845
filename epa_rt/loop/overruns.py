"""Counting late cycles, and what the rig file says to do about them."""

from epa_rt.config.rig import Overrun


class Overruns:
    """A cycle whose exchange began more than ``late`` after its edge is an overrun.

    ``count`` of all, ``in_a_row`` now, ``worst_ns``. Once too many follow each other, ``step``
    answers with the policy's word "stop" or "trip" ("count" never answers), and ``wants_stop``
    stays set for the policy "stop".
    """

    __slots__ = ("count", "in_a_row", "worst_ns", "wants_stop", "_late_ns", "_allowed", "_policy")

    def __init__(self, overrun: Overrun):
        self.count = self.in_a_row = self.worst_ns = 0
        self.wants_stop = False
        self._late_ns = round(overrun.late * 1e9)
        self._allowed = overrun.in_a_row
        self._policy = "" if overrun.policy == "count" else overrun.policy

    def step(self, lateness_ns: int) -> str:
        """Takes one cycle's lateness."""
        if lateness_ns > self.worst_ns:
            self.worst_ns = lateness_ns
        if lateness_ns <= self._late_ns:
            self.in_a_row = 0
            return ""
        self.count += 1
        self.in_a_row += 1
        if self.in_a_row < self._allowed:
            return ""
        self.wants_stop = self.wants_stop or self._policy == "stop"
        return self._policy

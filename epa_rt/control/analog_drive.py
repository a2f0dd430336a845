"""A drive that is enabled by one digital output and commanded by a voltage."""


class OutputEnabler:
    """Switches the enable output on and calls the targets live after `delay_cycles`.

    Same protocol as the CiA 402 enabler: `step` takes the drive's ready input (1 where there is
    none) and returns the enable output, 0 or 1. A ready input that falls once the targets are live,
    or has not risen by then, ends the request with `cause`. ValueError if delay_cycles is below
    zero.
    """

    __slots__ = (
        "cause",
        "lost",
        "delay_cycles",
        "enabled",
        "fault",
        "_wanted",
        "_stopping",
        "_waited",
    )

    quick_stop_active = False  # such a drive has none

    def __init__(self, delay_cycles: int) -> None:
        if delay_cycles < 0:
            raise ValueError(f"delay_cycles: found {delay_cycles}, expected zero or more")
        self.delay_cycles = delay_cycles
        self.cause = self.lost = ""
        self.enabled = self.fault = self._wanted = self._stopping = False
        self._waited = 0

    @property
    def targets_live(self) -> bool:
        """True when the drive follows the voltage; at any other time the command must be zero."""
        return self.enabled

    def enable(self, reset_fault: bool = True) -> None:
        """Switch the output on; the delay starts anew, and an earlier fault is forgotten if
        `reset_fault`.
        """
        if reset_fault:
            self.fault = False
        self.cause = self.lost = ""
        self._wanted, self._stopping, self.enabled = True, False, False
        self._waited = 0

    def disable(self, controlled: bool = False) -> None:
        """Switch the output off at once, or `controlled`: hold it for the delay with zero command,
        then off.
        """
        self._stopping = controlled and self._wanted
        self._wanted = self.enabled = False
        self._waited = 0

    def step(self, status_word: int = 1) -> int:
        """Enable output of this cycle, 0 or 1."""
        if self.enabled and status_word:
            return 1
        if self._stopping:
            self._waited += 1
            self._stopping = self._waited <= self.delay_cycles
            return int(self._stopping)
        if not self._wanted:
            return 0
        return self._up(status_word)

    def _up(self, status_word: int) -> int:
        if self.fault:
            return self._give_up("the drive is in fault, and a reset was not asked for")
        if self.enabled:
            self.lost = "the drive's ready input fell while it was enabled"
            return self._give_up(self.lost)
        self._waited += 1
        if self._waited <= self.delay_cycles:
            return 1
        if not status_word:
            return self._give_up(
                f"the drive's ready input has not risen {self.delay_cycles} cycles after enable"
            )
        self.enabled = True
        return 1

    def _give_up(self, cause: str) -> int:
        self.cause = cause
        self.fault = True
        self._wanted = self.enabled = self._stopping = False
        return 0

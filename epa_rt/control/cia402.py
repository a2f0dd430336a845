"""CiA 402: from status word to state, and one transition at a time to operation enabled and back.

Source: IEC 61800-7-201, power drive system state machine.
"""

from enum import Enum

CONTROL_DISABLE_VOLTAGE = 0x0000
CONTROL_QUICK_STOP = 0x0002
CONTROL_SHUTDOWN = 0x0006
CONTROL_SWITCH_ON = 0x0007
CONTROL_ENABLE_OPERATION = 0x000F
CONTROL_FAULT_RESET = 0x0080


class DriveState(Enum):
    """States of the power drive system, with the words an operator reads."""

    NOT_READY = "not ready to switch on"
    SWITCH_ON_DISABLED = "switch on disabled"
    READY = "ready to switch on"
    SWITCHED_ON = "switched on"
    OPERATION_ENABLED = "operation enabled"
    QUICK_STOP_ACTIVE = "quick stop active"
    FAULT_REACTION = "fault reaction active"
    FAULT = "fault"
    UNKNOWN = "unknown"


_BY_0X4F = {
    0x00: DriveState.NOT_READY,
    0x40: DriveState.SWITCH_ON_DISABLED,
    0x0F: DriveState.FAULT_REACTION,
    0x08: DriveState.FAULT,
}
_BY_0X6F = {
    0x21: DriveState.READY,
    0x23: DriveState.SWITCHED_ON,
    0x27: DriveState.OPERATION_ENABLED,
    0x07: DriveState.QUICK_STOP_ACTIVE,
}
# Indexed by status & 0x6F: one look-up per cycle in place of two masks and eight comparisons.
_STATES = tuple(
    _BY_0X4F.get(bits & 0x4F) or _BY_0X6F.get(bits) or DriveState.UNKNOWN for bits in range(0x70)
)
_OPERATION_ENABLED = DriveState.OPERATION_ENABLED

# Up: the word that asks for the next state only. Any other word would skip one.
_UP = {
    DriveState.SWITCH_ON_DISABLED: CONTROL_SHUTDOWN,
    DriveState.READY: CONTROL_SWITCH_ON,
    DriveState.SWITCHED_ON: CONTROL_ENABLE_OPERATION,
    DriveState.OPERATION_ENABLED: CONTROL_ENABLE_OPERATION,
}
# Controlled down: the drive brakes by its own option codes at each step.
_DOWN = {
    DriveState.OPERATION_ENABLED: CONTROL_SWITCH_ON,
    DriveState.SWITCHED_ON: CONTROL_SHUTDOWN,
    DriveState.READY: CONTROL_SHUTDOWN,
}
OFF = (
    DriveState.SWITCH_ON_DISABLED,
    DriveState.READY,
    DriveState.FAULT,
)  # what a drive must say to count as off: a status word of zeros, 'not ready', says nothing
_FAULTS = (DriveState.FAULT, DriveState.FAULT_REACTION)


def decode(status_word: int) -> DriveState:
    """State of the drive from object 0x6041."""
    return _STATES[status_word & 0x6F]


class DriveEnabler:
    """Walks a drive up to operation enabled and down again; call `step` once per cycle.

    A drive that stays in one state for more than `timeout_cycles`, or does not arrive within eight
    times as many, ends the request with `cause`; so does one that leaves operation enabled by
    itself (`lost`). `enabled`: operation is both asked for and reported by the drive. ValueError if
    not above 0.
    """

    __slots__ = (
        "state",
        "cause",
        "lost",
        "enabled",
        "timeout_cycles",
        "_wanted",
        "_controlled",
        "_braking",
        "_may_reset",
        "_holding",
        "_resetting",
        "_waited",
        "_total",
    )

    def __init__(self, timeout_cycles: int = 1000) -> None:
        if timeout_cycles < 1:
            raise ValueError(f"timeout_cycles: found {timeout_cycles}, expected at least 1")
        self.timeout_cycles = timeout_cycles
        self.state = DriveState.UNKNOWN
        self.cause = ""
        self.lost = ""
        self._wanted = self.enabled = self._controlled = False
        self._braking = self._holding = self._may_reset = self._resetting = False
        self._waited = self._total = 0

    @property
    def targets_live(self) -> bool:
        """True when the drive follows targets; at any other time they must be kept equal to the
        actual values.
        """
        return self.enabled

    @property
    def fault(self) -> bool:
        """True while the drive reports a fault or its reaction to one."""
        return self.state in _FAULTS

    @property
    def quick_stop_active(self) -> bool:
        """True while the drive brakes by its quick-stop ramp."""
        return self.state is DriveState.QUICK_STOP_ACTIVE

    @property
    def holds(self) -> bool:
        """True while the drive follows targets, or holds after a quick stop that was asked for."""
        return self.enabled or self._holding

    def quick_stop(self) -> None:
        """From operation enabled: brake on the drive's own ramp and hold there, until disabled.
        Without effect on a drive that is not enabled.
        """
        self._holding, self.enabled = self._holding or self.enabled, False
        self._waited = 0

    def enable(self, reset_fault: bool = True) -> None:
        """Ask for operation enabled; a fault in the way is reset once at most, and only if
        `reset_fault`.
        """
        self._wanted = True
        self.enabled = self._braking = self._holding = self._resetting = False
        self._may_reset = reset_fault
        self._waited = self._total = 0
        self.cause = self.lost = ""

    def disable(self, controlled: bool = False) -> None:
        """Torque off at once, or `controlled`: by way of switched on and ready to switch on."""
        self._wanted = self.enabled = self._braking = self._holding = False
        self._controlled = controlled
        self._waited = 0

    def step(self, status_word: int) -> int:
        """Control word (0x6040) of this cycle for the status word (0x6041) just read."""
        state = _STATES[status_word & 0x6F]
        if self.enabled and state is _OPERATION_ENABLED:
            return CONTROL_ENABLE_OPERATION
        self._waited = self._waited + 1 if state is self.state else 0
        self.state = state
        if self._holding:
            return self._hold(state)
        if not self._wanted:
            return self._down(state)
        if self.enabled:
            self.lost = f"the drive left operation enabled by itself: {state.value}"
            self._braking = state is DriveState.QUICK_STOP_ACTIVE
            return self._give_up(self.lost)
        return self._up(state)

    def _hold(self, state: DriveState) -> int:
        if state is DriveState.QUICK_STOP_ACTIVE or state is _OPERATION_ENABLED:
            return CONTROL_QUICK_STOP
        self._holding = False
        self.lost = f"the drive left its quick stop by itself: {state.value}"
        return self._give_up(self.lost)

    def _up(self, state: DriveState) -> int:
        self._total += 1
        if state is DriveState.FAULT:
            word = self._reset_fault()
        else:
            self._resetting = False
            word = _UP.get(state, CONTROL_DISABLE_VOLTAGE)
        if state is _OPERATION_ENABLED:
            self.enabled = True
        elif self._wanted and (
            self._waited > self.timeout_cycles or self._total > 8 * self.timeout_cycles
        ):
            return self._give_up(
                f"stuck in {state.value} for {self._waited} cycles under control word 0x{word:04X},"
                f" {self._total} cycles after enable"
            )
        return word

    def _reset_fault(self) -> int:
        """Bit 7 acts on its rising edge: one cycle low, then high until the fault is gone."""
        if self._resetting:
            return CONTROL_FAULT_RESET
        if not self._may_reset:
            return self._give_up("the drive is in fault, which is reset once at most")
        self._may_reset = False
        self._resetting = True
        return CONTROL_DISABLE_VOLTAGE

    def _down(self, state: DriveState) -> int:
        if state is _OPERATION_ENABLED and self._waited > self.timeout_cycles:
            self.cause = f"still in operation enabled {self._waited} cycles after disable"
            self._controlled = False
        if self._braking and state is DriveState.QUICK_STOP_ACTIVE:
            return CONTROL_QUICK_STOP  # let the drive finish its own ramp
        return (
            _DOWN.get(state, CONTROL_DISABLE_VOLTAGE)
            if self._controlled
            else CONTROL_DISABLE_VOLTAGE
        )

    def _give_up(self, cause: str) -> int:
        self.cause = cause
        self._wanted = self.enabled = self._controlled = False
        return self._down(self.state)

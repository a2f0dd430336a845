"""The gate that every command passes: NaN, limits, slew, forbidden combinations, enabling with a
jump.
"""

from epa_rt.config.rig import Cia402Drive, Rig
from epa_rt.config.rig_rows import reading

INFINITE = float("inf")
ENABLE_OPERATION = 0x0F
QUICK_STOP = 0x02
# CiA 402 control words that this stack has a use for; anything else is a fault above
CONTROL_WORDS = frozenset((0x00, 0x02, 0x06, 0x07, 0x0F, 0x80))
MODES = frozenset((0, 8, 9, 10))
POSITION_MODE = 8
# a run that sets the drive's zero, and no other: CiA 402 homing, started by bit 4
HOMING_MODE, START_HOMING = 6, 0x1F
JUMP_S = 0.010

Refusal = tuple[str, str, str]  # cause, signal, sentence


class CommandGate:
    """Limits a command in place of the caller and counts it, or refuses it.

    ``homing``: for a run that sets the drive's zero; only such a run may use the homing mode, and
    no other mode.
    ``outputs``: the limited command, valid after pass_through returned None. ``clamped`` and
    ``slewed``: how often each row was cut. ``jump_si`` is how far a position target may stand from
    the measured position when power comes on: what ten milliseconds at full slew cover. Speed and
    torque targets must then be at rest. ``powered``: whether the last command that was let through
    had power on.
    """

    def __init__(self, rig: Rig, homing: bool = False):
        words, modes = CONTROL_WORDS, MODES
        if homing:  # the drive's own homing, in which no target moves it
            words, modes = words | {START_HOMING}, frozenset((0, HOMING_MODE))
        self.outputs = {row.name: row.safe for row in rig.outputs}  # a command that may leave
        self._safe = dict(self.outputs)
        drive = rig.drive
        self._mode = drive.mode if isinstance(drive, Cia402Drive) else ""
        self._power_row = drive.control_word if isinstance(drive, Cia402Drive) else drive.enable
        self._power_on: tuple[float, ...] = (
            (ENABLE_OPERATION, START_HOMING) if isinstance(drive, Cia402Drive) else (1.0,)
        )
        self._analog: list[tuple[str, float, float, float]] = []
        self._switches: list[str] = []
        self._words: list[tuple[str, frozenset[int]]] = []
        for row in rig.outputs:
            if row.name.endswith("_raw"):
                self._words.append((row.name, modes if row.name == self._mode else words))
            elif row.limits is None:
                self._switches.append(row.name)
            else:
                self._analog.append((row.name, *row.limits, (row.slew or INFINITE) * rig.period_s))
        self.clamped = dict.fromkeys((row[0] for row in self._analog), 0)
        self.slewed = dict.fromkeys((row[0] for row in self._analog), 0)
        pairs = [(muscle.inlet, muscle.exhaust) for muscle in rig.muscles]
        self._forbidden = tuple(pairs) + rig.safety.never_together
        motor = rig.motor
        self._target, self._position = motor.position_target, motor.position
        self._rates = tuple(name for name in (motor.speed_target, motor.torque_target) if name)
        self.jump_si = JUMP_S * (rig.row(self._target).slew or 0.0) if self._target else 0.0
        self._brake = motor.brake.output if motor.brake else None
        self.powered = self._follows = self._holds = False
        self.mode_under_power = 0.0  # of a drive on the bus; it does not change under power

    def pass_through(self, measured: dict[str, float], command: dict[str, float]) -> Refusal | None:
        """Fills ``outputs`` from the command; None, or (cause, signal, sentence) where the command
        is refused.
        """
        outputs = self.outputs
        was_powered, mode = self.powered, outputs.get(self._mode, POSITION_MODE)
        refusal = self._words_and_switches(command)
        if refusal is not None:
            return refusal
        powered = outputs[self._power_row] in self._power_on
        mode_now = outputs.get(self._mode, POSITION_MODE)
        if powered and was_powered and mode_now != mode:
            return (
                "mode change",
                self._mode,
                f"{self._mode} = {mode_now} under power, expected {mode}",
            )
        self._follows = not powered or mode_now != POSITION_MODE
        refusal = self._limits(command)
        if powered != was_powered and refusal is None:
            if powered:
                refusal = self._jump(measured, command) or self._jump(measured, self.outputs)
                self.mode_under_power = self.outputs.get(self._mode, 0.0)
            if refusal is None:
                self.powered = powered
        if self._brake is not None and refusal is None and not (was_powered and powered):
            refusal = self._brake_without_power(self._brake, powered)
        return refusal

    def _brake_without_power(self, brake: str, powered: bool) -> Refusal | None:
        """The brake opens under power that has been on for a cycle, and closes before it goes. A
        quick stop from there keeps the power.
        """
        brake = self._brake or ""
        held = self._holds and self.outputs[self._power_row] == QUICK_STOP
        self._holds = powered or held
        if self.outputs[brake] == 0.0 or held:
            return None
        return "forbidden combination", brake, f"{brake} on without power"

    def _words_and_switches(self, command: dict[str, float]) -> Refusal | None:
        outputs = self.outputs
        for name, allowed in self._words:
            value = command[name]
            if value not in allowed:
                return "bad command", name, f"{name} = {value!r}, expected one of {sorted(allowed)}"
            outputs[name] = value
        for name in self._switches:
            if command[name] != outputs[name]:  # also NaN
                return self._switch(command)
        return None

    def _switch(self, command: dict[str, float]) -> Refusal | None:
        """Takes the switches over, all or none: those in ``outputs`` have been judged."""
        for name in self._switches:
            value = command[name]
            if value != 0.0 and value != 1.0:  # also NaN
                return "bad command", name, f"{name} = {value!r}, expected 0 or 1"
        for first, second in self._forbidden:
            if command[first] != 0.0 and command[second] != 0.0:
                return "forbidden combination", first, f"{first} and {second} on together"
        for name in self._switches:
            self.outputs[name] = command[name]
        return None

    def _jump(self, measured: dict[str, float], targets: dict[str, float]) -> Refusal | None:
        """What must hold when power comes on: a mode chosen, the position target where the rig is,
        the rest at rest.
        """
        if self.outputs.get(self._mode, POSITION_MODE) == 0:
            return (
                "bad command",
                self._mode,
                f"{self._mode} = 0 when power comes on, expected a mode",
            )
        if (
            self._target
            and not abs(targets[self._target] - measured[self._position]) <= self.jump_si
        ):
            far = reading(self._target, abs(targets[self._target] - measured[self._position]))
            text = f"{self._target} stands {far} from {self._position} when power comes on"
            return "jump at enable", self._target, text
        for name in self._rates:
            if targets[name] != self._safe[name]:
                return (
                    "jump at enable",
                    name,
                    f"{name} = {reading(name, targets[name])} when power comes on",
                )
        return None

    def _limits(self, command: dict[str, float]) -> Refusal | None:
        outputs = self.outputs
        # where the drive does not listen the target follows the rig, however fast that is moved
        follows = self._target if self._follows else None
        for name, low, high, step in self._analog:
            value, last = command[name], outputs[name]
            if value == last:  # which has been judged
                continue
            if value != value:
                return "NaN command", name, f"{name} is not a number"
            if name == follows:
                outputs[name] = value if low <= value <= high else (low if value < low else high)
                continue
            if value > last + step or value < last - step:
                self.slewed[name] += 1
                value = last + step if value > last else last - step
            if value < low or value > high:
                self.clamped[name] += 1
                value = low if value < low else high
            outputs[name] = value
        return None

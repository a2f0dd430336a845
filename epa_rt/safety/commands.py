"""The gate that every command passes: NaN, limits, slew, forbidden combinations, enabling with a jump."""

from epa_rt.config.rig import Rig

INFINITE = float("inf")
ENABLE_OPERATION = 0x0F
# CiA 402 control words that this stack has a use for; anything else is a fault above
CONTROL_WORDS = frozenset((0x00, 0x02, 0x06, 0x07, 0x0F, 0x80))
MODES = frozenset((0, 8, 9, 10))

Refusal = tuple[str, str, str]  # cause, signal, sentence


class CommandGate:
    """Limits a command in place of the caller and counts it, or refuses it.

    ``outputs``: the limited command, valid after pass_through returned None. ``clamped`` and ``slewed``: how often each
    row was cut. ``jump_si`` is how far a position target may stand from the measured position when power comes on.
    """

    def __init__(self, rig: Rig):
        self.outputs = {row.name: row.safe for row in rig.outputs}
        self._analog, self._switches, self._words = [], [], []
        for row in rig.outputs:
            if row.name.endswith("_raw"):
                self._words.append((row.name, MODES if self._is_mode(rig, row.name) else CONTROL_WORDS))
            elif row.limits is None:
                self._switches.append(row.name)
            else:
                self._analog.append((row.name, *row.limits, (row.slew or INFINITE) * rig.period_s))
        self.clamped = dict.fromkeys((row[0] for row in self._analog), 0)
        self.slewed = dict.fromkeys((row[0] for row in self._analog), 0)
        pairs = [(muscle.inlet, muscle.exhaust) for muscle in rig.muscles]
        self._forbidden = tuple(pairs) + rig.safety.never_together
        self._control = rig.drive.control_word if rig.drive.interface == "cia402" else ""
        self._target, self._position = rig.motor.position_target or "", rig.motor.position
        self._powered = False
        # a target may stand off by what a tenth of a second at full slew would cover
        self.jump_si = 100.0 * next((row[3] for row in self._analog if row[0] == self._target), INFINITE)

    @staticmethod
    def _is_mode(rig: Rig, name: str) -> bool:
        return rig.drive.interface == "cia402" and name == rig.drive.mode

    def pass_through(self, measured: dict[str, float], command: dict[str, float]) -> Refusal | None:
        """Fills ``outputs`` from the command; None, or (cause, signal, sentence) where the command is refused."""
        refusal = self._words_and_switches(command) or self._power(measured, command)
        return refusal or self._limits(measured, command)

    def _words_and_switches(self, command: dict[str, float]) -> Refusal | None:
        outputs = self.outputs
        for name, allowed in self._words:
            value = command[name]
            if value not in allowed:
                return "bad command", name, f"{name} = {value!r}, expected one of {sorted(allowed)}"
            outputs[name] = value
        for name in self._switches:
            value = command[name]
            if value != 0.0 and value != 1.0:  # also NaN
                return "bad command", name, f"{name} = {value!r}, expected 0 or 1"
            outputs[name] = value
        for first, second in self._forbidden:
            if outputs[first] != 0.0 and outputs[second] != 0.0:
                return "forbidden combination", first, f"{first} and {second} on together"
        return None

    def _power(self, measured: dict[str, float], command: dict[str, float]) -> Refusal | None:
        powered = bool(self._control) and command[self._control] == ENABLE_OPERATION
        if powered and not self._powered and self._target:
            distance = abs(command[self._target] - measured[self._position])
            if not distance <= self.jump_si:
                text = f"{self._target} stands {distance:.4g} from {self._position} when power comes on"
                return "jump at enable", self._target, text
        self._powered = powered
        return None

    def _limits(self, measured: dict[str, float], command: dict[str, float]) -> Refusal | None:
        outputs = self.outputs
        for name, low, high, step in self._analog:
            value = command[name]
            if value != value:
                return "NaN command", name, f"{name} is not a number"
            if name == self._target and not self._powered:
                outputs[name] = value if low <= value <= high else (low if value < low else high)
                continue  # without power the target follows the measured position, however fast that is moved
            last = outputs[name]
            if value > last + step or value < last - step:
                self.slewed[name] += 1
                value = last + step if value > last else last - step
            if value < low or value > high:
                self.clamped[name] += 1
                value = low if value < low else high
            outputs[name] = value
        return None

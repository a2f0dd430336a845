"""What leaves after a trip: outputs that brake and hold under power, those that let a load down, or
the safe ones without power.

Stop categories as in IEC 60204-1. Category 1: the drive brakes and holds while the muscles vent,
moves to its rest place where something still pulls, then power goes. Category 0: power goes at
once, for good.
"""

from epa_rt.config.rig import Cia402Drive, Rig
from epa_rt.config.rig_rows import reading
from epa_rt.safety.commands import ENABLE_OPERATION, QUICK_STOP, CommandGate
from epa_rt.safety.let_down import SPEED_MODE, LetDown

INFINITE = float("inf")
# Status word as in CiA 402: the drive has power and says so. 0x27: operation enabled, 0x07: quick
# stop active.
STATE_MASK = 0x6F
UNDER_POWER = (0x27, 0x07)
SLOW_SHARE = 0.2  # of the limit of speed: a drive that brakes, or holds, is slower than that

BRAKING, OFF = 1, 0
NO_ZERO = "travel has no zero"  # and so no rest place


class Stopping:
    """``begin`` in the cycle of the trip, ``step`` in it and in every one after it.

    ``category`` is BRAKING or OFF; ``why`` is a sentence once it is OFF, empty where nothing was
    lost (power was not on, or the supervisor asked for it). OFF is latched.
    ``let_down``: the motion to the rest place, once asked for by ``ask_to_let_down``; ``has_zero``
    False forbids it.
    """

    def __init__(self, rig: Rig):
        self.category, self.why = BRAKING, ""
        self.has_zero = True
        self.let_down = LetDown(rig)
        self._is_asked = self._lets_down = False
        motor, safety = rig.motor, rig.safety
        drive = rig.drive
        bus = isinstance(drive, Cia402Drive)
        self._safe = {row.name: row.safe for row in rig.outputs}
        self._stop = dict(self._safe)
        self._status = drive.status_word if isinstance(drive, Cia402Drive) else None
        self._mode = drive.mode if isinstance(drive, Cia402Drive) else None
        self._word = drive.control_word if isinstance(drive, Cia402Drive) else drive.enable
        self._target = motor.position_target
        self._stop[self._word] = QUICK_STOP if bus else 1.0
        self._slewed = [
            (name, (rig.row(name).slew or INFINITE) * rig.period_s)
            for name in (motor.speed_target, motor.torque_target)
            if name and not bus
        ]
        self._brake = motor.brake.output if motor.brake else None
        self._position, self._speed = motor.position, motor.speed
        self._bit = 1 << [row.name for row in rig.inputs].index(motor.position)
        limits = rig.row(motor.speed).limits if motor.speed else None
        fastest = max(abs(limits[0]), abs(limits[1])) if limits is not None else INFINITE
        self._too_fast, self._slow = safety.stop_overspeed * fastest, SLOW_SHARE * fastest
        longest_s = safety.reaction
        if limits is not None:
            ramp = motor.stop_deceleration_si
            if motor.speed_target and not bus:  # brakes no faster than its command comes down
                ramp = min(ramp, rig.row(motor.speed_target).slew or INFINITE)
            longest_s += safety.stop_time * fastest / ramp
        self._longest_cycles, self._age = round(longest_s / rig.period_s), 0

    def begin(self, gate: CommandGate, powered: bool) -> None:
        """From what left last. ``powered``: whether it had power on, or was a quick stop already;
        without power there is nothing to brake with.
        """
        holds = gate.mode_under_power != 0.0 and gate.outputs[self._word] == QUICK_STOP
        if not powered and not holds:
            self.category = OFF
        if self._mode is not None:
            self._stop[self._mode] = gate.mode_under_power
        if self._target is not None:
            self._stop[self._target] = gate.outputs[self._target]
        if self._brake is not None:
            self._stop[self._brake] = gate.outputs[self._brake]
        for name, _step in self._slewed:
            self._stop[name] = gate.outputs[name]

    def fall(self, why: str) -> None:
        """Category 0 from here on; the first sentence stays."""
        if self.category == BRAKING:
            self.category, self.why = OFF, why

    def refuses_to_let_down(self) -> str:
        """Why the motor cannot be moved to its rest place; empty where it can."""
        if not self.has_zero:
            return NO_ZERO
        if self._brake is not None and self._stop[self._brake] == self._safe[self._brake]:
            return "the holding brake is closed"
        return self.let_down.refusal(SPEED_MODE if self._mode is None else self._stop[self._mode])

    def ask_to_let_down(self) -> None:
        """From the next cycle on the motor moves to its rest place, unless that is refused."""
        self._is_asked = not self.refuses_to_let_down()

    def close_brake(self) -> None:
        """The holding brake closes while the drive still holds."""
        if self._brake is not None:
            self._stop[self._brake] = self._safe[self._brake]

    def step(
        self, measured: dict[str, float], bus_ok: bool, lost: str, invalid: int, stale: int
    ) -> dict[str, float]:
        """The outputs of this cycle. ``lost``: a sentence where bus or position is lost for good.

        Without ``bus_ok`` the measured values are old, and nothing is concluded from them.
        """
        if self.category == OFF:
            return self._safe
        self._age += 1
        why = lost
        if not why and bus_ok:
            why = self._unsound(measured, invalid | stale)
        if why:
            self.fall(why)
            return self._safe
        stop = self._stop
        if self._is_asked:
            return self._step_down(measured, bus_ok, invalid | stale)
        for name, step in self._slewed:
            value = stop[name]
            stop[name] = max(value - step, 0.0) if value > 0.0 else min(value + step, 0.0)
        return stop

    def _step_down(
        self, measured: dict[str, float], bus_ok: bool, not_believed: int
    ) -> dict[str, float]:
        """Without ``bus_ok`` the targets of the last cycle stay."""
        if not bus_ok:
            return self._stop
        down, stop = self.let_down, self._stop
        if not self._lets_down:
            self._lets_down = True
            mode = SPEED_MODE if self._mode is None else stop[self._mode]
            down.begin(measured, mode, not_believed)
            if self._mode is not None:
                stop[self._word] = float(ENABLE_OPERATION)
        why = down.step(measured, not_believed)
        if why:
            self.fall(f"the motor cannot be let down: {why}")
            return self._safe
        stop.update(down.targets)
        return stop

    def _unsound(self, measured: dict[str, float], not_believed: int) -> str:
        """Why the drive cannot brake, or cannot be seen to; empty while it can."""
        position = measured[self._position]
        if not_believed & self._bit or position != position:
            return f"{self._position} cannot be believed"
        if self._status is not None:
            status = measured[self._status]
            if not 0.0 <= status <= 0xFFFF or int(status) & STATE_MASK not in UNDER_POWER:
                return f"the drive says that it has no power (status word {_hex(status)})"
        if self._speed is None:
            return ""
        speed = measured[self._speed]
        if not abs(speed) <= self._too_fast:
            return (
                f"{self._speed} = {reading(self._speed, speed)} while it should brake, beyond"
                f" {reading(self._speed, self._too_fast)}"
            )
        if self._is_asked:
            return ""  # it moves as it should; ``let_down`` watches it more closely
        if self._age > self._longest_cycles and abs(speed) > self._slow:
            return (
                f"the drive does not stop the motor: {self._speed} ="
                f" {reading(self._speed, speed)} {self._age} cycles after it was told to"
            )
        return ""


def _hex(status: float) -> str:
    return f"0x{int(status):04X}" if 0.0 <= status <= 0xFFFF else f"{status}"

"""The last motion before power goes: slowly, under power, to the place where nothing pulls.

It gives the targets and watches them. Targets only approach the rest place, never faster than the
let-down speed; what the motor does otherwise ends it with a sentence.
"""

from collections.abc import Mapping

from epa_rt.config.rig import Cia402Drive, Rig
from epa_rt.config.rig_rows import reading, reading_and_limits

ENABLED, STATE_MASK = 0x27, 0x6F  # of the status word, as in CiA 402: operation enabled
POSITION_MODE, SPEED_MODE = 8.0, 9.0
GAIN_MAX = 0.2  # of the sampling rate: a small position loop stays far from its own limit
RAMP_S = 0.2  # to full speed: a load is taken up and not jerked
CREEP = 0.05  # of the speed, at the end of a position ramp, which would else never arrive
ARRIVED_S = 0.05  # so far at that speed counts as arrived; the loop goes on while it settles
SETTLE = 5.0  # time constants of the small position loop: what is left is below a hundredth
TIME = 2.0  # of distance / speed: a motor that takes twice as long does not follow
TOO_FAST = 3.0  # of the speed: a loop that overshoots passes, a motor that is thrown not
AWAY_S = 0.1  # so far away from the nearest that it has been: noise and the sag of a loop
MARGIN = 0.05  # of a row's span, for force and current that began outside of their limits
INFINITE = float("inf")
WATCHED = ("N", "A")  # units of what must not rise while a load goes down


class LetDown:
    """``begin`` from a measured row, then ``step`` once per sound cycle; ``targets`` by row.

    ``refusal``: a sentence where the rig cannot, with what it lacks. ``arrived``: it is there and
    has settled. Position and speed in SI.
    """

    def __init__(self, rig: Rig):
        motor, dt_s = rig.motor, rig.period_s
        drive = rig.drive
        self._place_name = motor.rest_place_name
        self._place = motor.places[self._place_name] if self._place_name else 0.0
        self._position, self._speed = motor.position, motor.speed or ""
        names = [row.name for row in rig.inputs]
        self._speed_bit = 1 << names.index(self._speed) if self._speed else 0
        self._names = {POSITION_MODE: motor.position_target, SPEED_MODE: motor.speed_target}
        self._status = drive.status_word if isinstance(drive, Cia402Drive) else ""
        patience_s = drive.transition_timeout if isinstance(drive, Cia402Drive) else 0.0
        self._fastest, slew = motor.let_down_speed_si, INFINITE
        if motor.speed_target is not None:  # what leaves here has not passed the gate
            row = rig.row(motor.speed_target)
            low, high = row.limits or (-INFINITE, INFINITE)
            self._fastest, slew = min(self._fastest, -low, high), row.slew or INFINITE
        self._gain = min(motor.position_gain, GAIN_MAX / dt_s)
        self._dt_s, self._faster = dt_s, min(self._fastest / RAMP_S, slew) * dt_s
        self._creep, self._arrived = CREEP * self._fastest, ARRIVED_S * self._fastest
        self._away = AWAY_S * self._fastest
        limits = rig.row(motor.speed).limits if motor.speed else None
        most = min(abs(limits[0]), abs(limits[1])) if limits is not None else INFINITE
        self._too_fast = min(TOO_FAST * self._fastest, most)
        self._following = motor.following_error or INFINITE
        self._settle_cycles = max(1, round(SETTLE / (self._gain * dt_s)))
        self._patience = round(patience_s / dt_s)
        self._rows = [
            (1 << i, row.name, *row.limits)
            for i, row in enumerate(rig.inputs)
            if row.limits is not None and row.si_unit in WATCHED
        ]
        self._bounds: list[tuple[int, str, float, float]] = []
        self.targets: dict[str, float] = {}
        self.arrived = False
        self._is_live = self._is_position = False
        self._target_name = ""
        self._target = self._rate = self._nearest = self._sign = 0.0
        self._age = self._settled = self._longest = 0

    def refusal(self, mode: float) -> str:
        """Why this rig cannot let down in a drive's mode (0x6060; a wired drive's is that of
        speed); empty where it can.
        """
        if self._place_name is None:
            return "the rig file has no motor.rest_place"
        if self._names.get(mode) is None:
            return "the drive was not under a target of position or speed"
        if not self._speed:
            return "the rig has no row of the motor's speed to watch it by"
        return ""

    def is_there(self, measured: Mapping[str, float]) -> bool:
        """Whether the motor is at the rest place already."""
        return abs(measured[self._position] - self._place) <= self._arrived

    def begin(self, measured: Mapping[str, float], mode: float, not_believed: int = 0) -> None:
        """From where the motor stands. ``mode`` as in ``refusal``, which must be empty."""
        self._target = measured[self._position]
        distance = self._place - self._target
        self._sign = 1.0 if distance > 0.0 else -1.0
        self._nearest, self._rate = abs(distance), 0.0
        self._is_position = mode == POSITION_MODE
        self._target_name = self._names[mode] or ""
        self.targets = {self._target_name: self._target if self._is_position else 0.0}
        self.arrived, self._is_live = False, not self._status
        self._age = self._settled = 0
        longest_s = TIME * (abs(distance) / self._fastest + RAMP_S + 2.0 * SETTLE / self._gain)
        self._longest = self._patience + round(longest_s / self._dt_s)
        self._bounds = []
        for bit, name, low, high in self._rows:
            if not not_believed & bit:
                now, margin = measured[name], MARGIN * (high - low)
                above = now + margin if now > high else high
                self._bounds.append((bit, name, now - margin if now < low else low, above))

    def step(self, measured: Mapping[str, float], not_believed: int = 0) -> str:
        """Takes one sound cycle and moves the targets on; a sentence where it must end."""
        self._age += 1
        why = self._not_enabled(measured) or self._unsound(measured, not_believed)
        if not why and self._is_live:
            self._go_on(measured[self._position])
        return why

    def _not_enabled(self, measured: Mapping[str, float]) -> str:
        """A drive that held by its quick stop needs some cycles to follow targets again."""
        if not self._status:
            return ""
        status = measured[self._status]
        if 0.0 <= status <= 0xFFFF and int(status) & STATE_MASK == ENABLED:
            self._is_live = True
        elif self._is_live:
            return "the drive left operation enabled"
        elif self._age > self._patience:
            return "the drive is not enabled out of its quick stop"
        return ""

    def _unsound(self, measured: Mapping[str, float], not_believed: int) -> str:
        if not_believed & self._speed_bit:
            return f"{self._speed} cannot be believed"
        position, speed = measured[self._position], measured[self._speed]
        if not abs(speed) <= self._too_fast:
            return (
                f"{self._speed} = {reading(self._speed, speed)}, beyond"
                f" {reading(self._speed, self._too_fast)}"
            )
        distance = abs(self._place - position)
        if distance < self._nearest:
            self._nearest = distance
        if not distance <= self._nearest + self._away:
            return (
                f"{self._position} = {self._read(position)} goes away from {self._place_name}"
                f" ({self._read(self._place)})"
            )
        if self._is_position and not abs(self._target - position) <= self._following:
            return (
                f"{self._position} = {self._read(position)} does not follow"
                f" {self._read(self._target)} within {self._read(self._following)}"
            )
        for bit, name, low, high in self._bounds:
            if not not_believed & bit and not low <= measured[name] <= high:
                found, limits = reading_and_limits(name, measured[name], low, high)
                return f"{name} = {found}, outside {limits}"
        if self._age > self._longest and not self.arrived:
            return f"{self._position} = {self._read(position)} is not at {self._place_name} in time"
        return ""

    def _read(self, travel: float) -> str:
        return reading(self._position, travel)

    def _go_on(self, position: float) -> None:
        """Speeds up by a ramp, slows down as the rest place comes near."""
        at = self._target if self._is_position else position
        left = self._sign * (self._place - at)
        rate = min(self._rate + self._faster, self._fastest, max(self._gain * left, 0.0))
        if self._is_position:
            rate = max(rate, min(self._creep, self._rate + self._faster))
            step = rate * self._dt_s
            self._target = self._place if step >= left else at + self._sign * step
            self.targets[self._target_name] = self._target
        else:
            self.targets[self._target_name] = self._sign * rate
        self._rate = rate
        if self._settled or (
            abs(self._place - position) <= self._arrived
            and (not self._is_position or self._target == self._place)
        ):
            self._settled += 1
            self.arrived = self._settled > self._settle_cycles

"""Moving motor and air by hand, slowly: inside the limits, and from outside of them back."""

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import si_unit_of
from epa_rt.config.units import UnitError, parse_pressure, parse_quantity, readable
from epa_rt.experiments.experiment import ValveOrder
from epa_rt.experiments.speed_plan import SpeedPlan
from epa_rt.experiments.valve_crew import Valve
from epa_rt.safety.recovery import RecoveryGuard

SOFT_SHARE = 0.01  # of the span of travel: where the motor is stopped before the limit trips
PULSE_PA = 20e3  # what one key fills or vents: a step that is felt and stays far from any limit
DEAD_MAN_S = 0.6  # longer than the delay before a held key repeats, shorter than a fright
IDLE_S = 180.0  # without a key: nobody stands by, and the rig is powered and may be filled
FOLLOWS_S = 0.5  # for the motor to come up with a reference that rests: five of its time constants
FOLLOWS_SHARE = 0.25  # of the following error that trips: further off the motor has not followed
HOLD_RATIO = 2.0  # of the jog speed: what the loop may ask for to hold its place

_SHOWN = {"m": (1e3, "mm"), "rad": (math.degrees(1.0), "deg")}
END_KEYS = ("q", "escape")
EXAMPLE = "'move -5 mm at 3 mm/s', 'fill muscle 200 kPa', 'vent', 'vent muscle' or 'wait 1 s'"


@dataclass(frozen=True)
class Move:
    """By so many m or rad from where the motor stands, at a speed above zero."""

    distance: float
    speed: float


@dataclass(frozen=True)
class Fill:
    """A muscle to an absolute pressure in Pa."""

    muscle: str
    target_pa: float


@dataclass(frozen=True)
class Vent:
    """These muscles to atmosphere."""

    muscles: tuple[str, ...]


@dataclass(frozen=True)
class Wait:
    """So many seconds."""

    seconds: float


Order = Move | Fill | Vent | Wait


class Source(Protocol):
    """Tells a jog what is asked for: the operator's keys, or a script."""

    def step(self, jog: "Jogging", cycle: int) -> None: ...


class Jogging(SpeedPlan):
    """A plan whose motion and air come from a ``source``, kept on the way that the guard allows.

    ``note`` says in words what was not done, and why; empty where all was.
    """

    phase_names = ("jog",)

    def __init__(self, rig: Rig, valves: Mapping[str, Valve], source: Source, guard: RecoveryGuard):
        super().__init__(rig, valves, rig.motor.jog_speed_si)
        self.note = ""
        self.muscles = tuple(muscle.name for muscle in rig.muscles)
        self.period_s, self.speed_max = rig.period_s, rig.motor.jog_speed_si
        self._source, self._guard = source, guard
        self._pressures = {muscle.name: muscle.pressure for muscle in rig.muscles}
        self._most_pa = {muscle.name: muscle.pressure_max for muscle in rig.muscles}
        self._atmosphere_pa = rig.atmosphere_pa
        self._limits = rig.row(rig.motor.position).limits or (-math.inf, math.inf)
        self._reach = distance_max(rig)
        self._per_si, self._unit = _SHOWN[si_unit_of(rig.motor.position)]
        trips = rig.motor.following_error
        self._near = math.inf if trips is None else FOLLOWS_SHARE * trips
        self._measured: Mapping[str, float] = {}
        self._start, self._low, self._high = 0.0, -math.inf, math.inf

    def begin(self, measured: Mapping[str, float]) -> None:
        super().begin(measured)
        self._start, self._measured = self.travel, measured
        outside = [way.name for way in self._guard.ways if way.outside]
        words = f"outside of its limits: {', '.join(outside)}" if outside else "inside all limits"
        if not self._guard.has_zero:
            words += "; travel has no zero, and counts from here"
        self.events.append(("jog", f"starts {words}", {"outside": outside}))

    def _decide(self, measured: Mapping[str, float], cycle: int) -> None:
        self._measured = measured
        self._low, self._high = self._reachable()
        self._source.step(self, cycle)
        ahead = self._wanted if self._goal is None else self._goal - self.travel
        if (ahead > 0.0 and self.travel >= self._high) or (
            ahead < 0.0 and self.travel <= self._low
        ):
            self._wanted, self._goal = 0.0, None
            self._say(f"at the end of what is allowed ({self._shown(self.travel)})", cycle)

    def _reachable(self) -> tuple[float, float]:
        """Where the reference may go: inside the limits, or from outside only back."""
        if not self._guard.has_zero:
            reach = (1.0 - SOFT_SHARE) * self._reach
            return self._start - reach, self._start + reach
        low, high = self._limits
        soft = SOFT_SHARE * (high - low)
        return min(low + soft, self.travel), max(high - soft, self.travel)

    @property
    def found_zero(self) -> bool | None:
        """Whether travel had a zero at the start; None where nothing was measured."""
        return self._guard.has_zero

    @property
    def measured(self) -> Mapping[str, float]:
        """What this cycle brought, SI."""
        return self._measured

    @property
    def behind(self) -> bool:
        """The motor stands further from the reference than one that follows does."""
        return not abs(self.travel - self._measured[self._position]) <= self._near

    # What a source may ask for

    def hold(self) -> None:
        """Keeps all valves shut but those that vent."""
        self._crew.stop()

    def move(self, speed: float) -> None:
        """Goes on at this speed (m/s or rad/s, signed), until told otherwise."""
        self._goal, self._wanted = None, max(-self.speed_max, min(self.speed_max, speed))

    def move_by(self, distance: float, speed: float, cycle: int) -> None:
        """By a distance from where the motor stands; fails where that is not on the way back or
        inside.
        """
        goal = self.travel + distance
        if not min(self._low, self.travel) <= goal <= max(self._high, self.travel):
            self._fail(
                f"a move to {self._shown(goal)} was not made: from {self._shown(self.travel)} the"
                f" motor may go to {self._shown(self._low)} .. {self._shown(self._high)}",
                cycle,
            )
            return
        self.go_to(goal, min(speed, self.speed_max))

    def fill(self, muscle: str, target_pa: float, cycle: int) -> bool:
        """Sets a muscle's pressure (absolute Pa). False, with a ``note``, where it must not."""
        outside = next((way.name for way in self._guard.ways if way.outside), "")
        rises = target_pa > self._measured[self._pressures[muscle]]
        if rises and outside:
            self._say(f"{muscle} is not filled while {outside} is outside of its limits", cycle)
            return False
        if target_pa >= self._most_pa[muscle]:
            self._say(f"{muscle} is not filled above its pressure_max", cycle)
            return False
        self._crew.tell([ValveOrder(muscle, "set", max(target_pa, self._atmosphere_pa))])
        return True

    def pulse(self, muscle: str, sign: float, cycle: int) -> None:
        """One small step of pressure up or down from what is measured."""
        now_pa = self._measured[self._pressures[muscle]]
        if sign < 0.0 and now_pa - PULSE_PA <= self._atmosphere_pa:
            self.vent((muscle,))
        else:
            self.fill(muscle, now_pa + sign * PULSE_PA, cycle)

    def vent(self, muscles: Sequence[str]) -> None:
        """Opens the exhausts until the muscles are at atmosphere."""
        self._crew.tell(ValveOrder(name, "vent") for name in muscles)

    def settled(self) -> bool:
        """All valves have done what they were told."""
        return self._crew.settled()

    def quit(self, cycle: int) -> None:
        """Ends the jog as a run ends: the motor stops, the muscles vent, power goes."""
        self._wanted, self._goal = 0.0, None
        self.brake(cycle)

    def fail_to_follow(self, cycle: int) -> None:
        """Ends the jog because the motor stands elsewhere than it was asked to."""
        self._fail(
            f"the motor did not follow: it stands at {self._shown(self._measured[self._position])},"
            f" asked for were {self._shown(self.travel)} (no torque, or held?)",
            cycle,
        )

    def fail(self, sentence: str, cycle: int) -> None:
        """Ends the jog with a failure."""
        self._fail(sentence, cycle)

    def _shown(self, travel: float) -> str:
        if self._unit == "mm" and abs(travel) >= 1.0:
            return readable(travel, "m")
        return f"{self._per_si * travel:.2f} {self._unit}"

    def _say(self, note: str, cycle: int) -> None:
        if note != self.note:
            self.note = note
            self.events.append(("jog", note, {"cycle": cycle}))


class Script:
    """Orders one after the other; each waits for the one before."""

    def __init__(self, orders: Sequence[Order]):
        self._orders, self._age, self._rests = deque(orders), 0, 0
        self._now: Order | None = None

    def step(self, jog: Jogging, cycle: int) -> None:
        self._age += 1
        if self._now is not None and not self._done(jog, self._now, cycle):
            return
        if not self._orders:
            jog.quit(cycle)
            return
        self._now, self._age, self._rests = self._orders.popleft(), 0, 0
        order = self._now
        jog.events.append(("order", str(order), {"cycle": cycle}))
        if isinstance(order, Move):
            jog.move_by(order.distance, order.speed, cycle)
        elif isinstance(order, Fill):
            if not jog.fill(order.muscle, order.target_pa, cycle):
                jog.fail(jog.note, cycle)
        elif isinstance(order, Vent):
            jog.vent(order.muscles)

    def _done(self, jog: Jogging, order: Order, cycle: int) -> bool:
        if isinstance(order, Wait):
            return self._age * jog.period_s >= order.seconds
        if isinstance(order, Move):
            return jog.arrived and self._followed(jog, cycle)
        return self._age > 1 and jog.settled()

    def _followed(self, jog: Jogging, cycle: int) -> bool:
        """Whether the motor is where the reference rests; it fails where it is not in time."""
        if not jog.behind:
            return True
        self._rests += 1
        if self._rests * jog.period_s >= FOLLOWS_S:
            jog.fail_to_follow(cycle)
        return False


class Keys:
    """What the operator's keys ask for; ``press`` from the loop's own poll, never from a thread.

    A motion key holds for DEAD_MAN_S after it was last seen: its repetition keeps it alive. What
    was pressed before the first cycle of the jog was let go long ago; only the end counts then.
    After IDLE_S without a key the jog ends as by q, and ``idle`` says so.
    """

    HELP = "left/right: hold to move | up/down: fill/vent a step | m: muscle | v: vent | q: quit"

    def __init__(self) -> None:
        self.selected = 0
        self._direction, self._until = 0.0, -1
        self._waiting: deque[str] = deque(maxlen=8)  # more than that was never meant one by one
        self._cycles = 0
        self._idle_at = 0
        self.idle = ""

    def press(self, key: str, cycle: int) -> None:
        """One key: 'left', 'right', 'up', 'down', or a letter."""
        if self._cycles == 0 and key not in END_KEYS:
            return
        self._idle_at = 0  # set anew by the next step
        if key in ("left", "right"):
            self._direction = 1.0 if key == "right" else -1.0
            self._until = cycle + self._cycles
        else:
            self._direction = 0.0  # any other key lets go of the motion
            self._waiting.append(key)

    def step(self, jog: Jogging, cycle: int) -> None:
        if self._cycles == 0:
            self._cycles = round(DEAD_MAN_S / jog.period_s)
        if self._idle_at == 0:
            self._idle_at = cycle + round(IDLE_S / jog.period_s)
        elif cycle >= self._idle_at and not self.idle:
            self.idle = f"no key for {IDLE_S / 60.0:g} min: the jog ended by itself"
            jog.events.append(("jog", self.idle, {"cycle": cycle}))
            jog.quit(cycle)
        jog.move(self._direction * jog.speed_max if cycle < self._until else 0.0)
        while self._waiting:
            self._obey(jog, self._waiting.popleft(), cycle)

    def _obey(self, jog: Jogging, key: str, cycle: int) -> None:
        if key in END_KEYS:
            jog.quit(cycle)
        elif not jog.muscles:
            return
        elif key == "m":
            self.selected = (self.selected + 1) % len(jog.muscles)
        elif key == "v":
            jog.vent(jog.muscles)
        elif key in ("up", "down"):
            jog.pulse(jog.muscles[self.selected], 1.0 if key == "up" else -1.0, cycle)


def distance_max(rig: Rig) -> float:
    """How far a jog goes where travel has no zero, m or rad: the homing's own bound, or the span
    of the limits.
    """
    zero, limits = rig.motor.zero, rig.row(rig.motor.position).limits
    if limits is not None:
        return limits[1] - limits[0]
    return zero.distance_max or math.inf


def parse_order(text: str, rig: Rig) -> Order:
    """One order in words. Raises UnitError: found, expected."""
    word, _, rest = text.strip().partition(" ")
    rest = rest.strip()
    if word == "move" and rest:
        return _parse_move(rest, rig)
    if word == "fill" and len(parts := rest.split(None, 1)) == 2:
        pressure = parts[1] if parts[1].endswith(("gauge", "abs")) else f"{parts[1]} gauge"
        target_pa = parse_pressure(pressure, rig.atmosphere_pa)
        muscle = next((m for m in rig.muscles if m.name == _muscle(parts[0], rig)), None)
        if muscle is not None and not rig.atmosphere_pa <= target_pa < muscle.pressure_max:
            most = (muscle.pressure_max - rig.atmosphere_pa) / 1e3
            raise UnitError(f"found '{parts[1]}', expected 0 to below {most:g} kPa gauge")
        return Fill(parts[0], target_pa)
    if word == "vent":
        return Vent((_muscle(rest, rig),) if rest else tuple(m.name for m in rig.muscles))
    if word == "wait" and rest:
        seconds = parse_quantity(rest, "s")
        if not 0.0 <= seconds <= 600.0:
            raise UnitError(f"found '{rest}', expected 0 s to 600 s")
        return Wait(seconds)
    raise UnitError(f"found '{text.strip()}', expected {EXAMPLE}")


def _parse_move(rest: str, rig: Rig) -> Move:
    unit = si_unit_of(rig.motor.position)
    distance, _, speed = rest.partition(" at ")
    most = rig.motor.jog_speed_si
    asked = parse_quantity(speed, f"{unit}/s") if speed else most
    if not 0.0 < asked <= most:
        raise UnitError(
            f"found '{speed.strip()}', expected above 0 and at most {readable(most, f'{unit}/s')}"
        )
    return Move(parse_quantity(distance, unit), asked)


def _muscle(name: str, rig: Rig) -> str:
    names = [muscle.name for muscle in rig.muscles]
    if name not in names:
        raise UnitError(f"found the muscle '{name}', expected one of {', '.join(names) or 'none'}")
    return name

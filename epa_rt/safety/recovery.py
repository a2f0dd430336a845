"""The envelope of a run that brings a rig back: by hand from outside of its limits, or to its zero.

It replaces the limits of travel, force and pressure by three rules. A row that starts inside its
limits stays inside. A row that starts outside may only come back. Where travel has no zero, its
limits mean nothing, and the distance moved since the start is bounded. All else stays watched.
"""

from collections.abc import Callable, Mapping

from epa_rt.config.rig import Cia402Drive, Rig
from epa_rt.config.rig_rows import SignalRow, reading, reading_and_limits
from epa_rt.safety.envelope import Envelope
from epa_rt.safety.let_down import SPEED_MODE, LetDown
from epa_rt.safety.trip import OVER_RANGE_CAUSE

BACK_SHARE = 0.05  # of a row's span: noise and a step of valve or motor, far from what breaks
SPEED_RATIO = 3.0  # of the asked speed: a loop that overshoots passes, a motor that is thrown not
STOWED = ("m", "rad", "N", "Pa")  # units of what a trip may leave outside of its limits
INFINITE = float("inf")

Refusal = tuple[str, str, str]  # cause, signal, sentence


class WayBack:
    """One row's bounds in SI: its limits, or where it started plus a margin, closing in on them.

    ``low`` and ``high`` are what holds now. ``outside``: it has not come back yet.
    """

    __slots__ = ("name", "low", "high", "outside", "_limits", "_margin", "_si_unit")

    def __init__(self, row: SignalRow, value: float):
        assert row.limits is not None
        self.name, self._limits, self._si_unit = row.name, row.limits, row.si_unit
        self.low, self.high = row.limits
        self._margin = BACK_SHARE * (self.high - self.low)
        self.outside = value < self.low or value > self.high
        if value < self.low:
            self.low = value - self._margin
        elif value > self.high:
            self.high = value + self._margin

    def step(self, value: float) -> Refusal | None:
        """Takes one cycle. NaN passes here: the envelope itself trips on it."""
        if value < self.low or value > self.high:
            return self._refusal(value)
        if self.outside:
            low, high = self._limits
            self.low = min(low, max(self.low, value - self._margin))
            self.high = max(high, min(self.high, value + self._margin))
            self.outside = value < low or value > high
        return None

    def _refusal(self, value: float) -> Refusal:
        low, high = self._limits
        found, limits = reading_and_limits(self.name, value, low, high)
        way = "further out of" if self.outside else "out of"
        return (
            OVER_RANGE_CAUSE[self._si_unit],
            self.name,
            f"{self.name} = {found} goes {way} its limits {limits}: move the other way",
        )


class RecoveryGuard:
    """``step`` once per sound cycle, from the first; a refusal, or None. All values SI.

    ``referenced`` says from the first measured row whether travel has a zero; without it travel may
    go ``distance_max`` from where it started. ``speed_max``: largest speed asked for.
    ``follows_count``: ``seen`` knows a count that the drive sets, so that nothing jumps.
    """

    follows_count = False

    def __init__(
        self,
        rig: Rig,
        referenced: Callable[[Mapping[str, float]], bool],
        distance_max: float,
        speed_max: float,
    ):
        motor = rig.motor
        self.ways: list[WayBack] = []
        self.has_zero: bool | None = None
        self._rows = [row for row in rig.inputs if row.limits and row.si_unit in STOWED]
        self._referenced, self._distance_max = referenced, distance_max
        self._position, self._start = motor.position, 0.0
        self._speed, self._speed_max = motor.speed, SPEED_RATIO * speed_max

    def seen(
        self, measured: dict[str, float], bus_ok: bool, outputs: Mapping[str, float]
    ) -> dict[str, float]:
        """The row that the envelope is to judge: the measured one."""
        return measured

    def step(self, measured: Mapping[str, float]) -> Refusal | None:
        """Takes one cycle."""
        if self.has_zero is None:
            self._begin(measured)
        for way in self.ways:
            refusal = way.step(measured[way.name])
            if refusal is not None:
                return refusal
        if not self.has_zero:
            moved = measured[self._position] - self._start
            if abs(moved) > self._distance_max:
                return (
                    "over-travel",
                    self._position,
                    f"{self._position} moved {reading(self._position, moved)} since the start, more"
                    f" than {reading(self._position, self._distance_max)}",
                )
        if self._speed is not None and abs(measured[self._speed]) > self._speed_max:
            return (
                "over-speed",
                self._speed,
                f"{self._speed} = {reading(self._speed, measured[self._speed])}, above"
                f" {reading(self._speed, self._speed_max)}",
            )
        return None

    def _begin(self, measured: Mapping[str, float]) -> None:
        """The first sound row says where the rig stands."""
        self.has_zero = self._referenced(measured)
        self._start = measured[self._position]
        self.ways = [
            WayBack(row, measured[row.name])
            for row in self._rows
            if self.has_zero or row.name != self._position
        ]


class RecoveryEnvelope(Envelope):
    """The envelope with the limits of the guard's rows taken out, and the guard in front."""

    def __init__(
        self, rig: Rig, reason: Callable[[int], str], guard: RecoveryGuard, homing: bool = False
    ):
        free = unlimited(rig, homing and not guard.follows_count)
        super().__init__(leaving_homing(free) if homing else free, reason, homing)
        self.guard = guard
        self.stopping.has_zero = False
        self.stopping.let_down = LetDown(rig)  # which watches the force by the rig's own limits

    def check(
        self,
        cycle: int,
        bus_ok: bool,
        measured: dict[str, float],
        invalid: int,
        stale: int,
        command: dict[str, float],
        now_ns: int = 0,
        fault: Refusal | None = None,
    ) -> dict[str, float]:
        """As the envelope's. A dead sensor is the cause and not what it leads to, so it goes
        first.
        """
        measured = self.guard.seen(measured, bus_ok, self.gate.outputs)
        if self.tripped is None and bus_ok and not invalid:
            refusal = self.guard.step(measured)
            self.stopping.has_zero = bool(self.guard.has_zero)
            if refusal is not None:
                self.trip(*refusal, cycle)
        return super().check(cycle, bus_ok, measured, invalid, stale, command, now_ns, fault)


def leaving_homing(rig: Rig) -> Rig:
    """The rig with outputs that are safe and take the drive out of its homing mode: a mode of 0 it
    may take for none, and keep the old one.
    """
    mode = rig.drive.mode if isinstance(rig.drive, Cia402Drive) else ""
    rows = tuple(
        row.model_copy(update={"safe": int(SPEED_MODE)}) if row.name == mode else row
        for row in rig.signals
    )
    sections = {name: getattr(rig, name) for name in Rig.model_fields}
    return Rig.model_construct(**sections | {"signals": rows})


def unlimited(rig: Rig, jumps: bool = False) -> Rig:
    """The rig as the envelope of a recovery sees it: no limits on what the guard watches, nor on
    the position target, which no such run uses, and no law of a muscle.

    ``jumps``: the drive is about to set its position.
    """
    free = {"limits": (-INFINITE, INFINITE)}
    rows = tuple(
        row.model_copy(update=free)
        if (row.limits and row.si_unit in STOWED and not row.is_output)
        or row.name == rig.motor.position_target
        else row
        for row in rig.signals
    )
    motor = rig.motor.model_copy(update={"speed": None}) if jumps else rig.motor
    # a muscle's law needs a zero of travel that may be wrong
    muscles = tuple(muscle.model_copy(update={"law": None}) for muscle in rig.muscles)
    sections = {name: getattr(rig, name) for name in Rig.model_fields}  # a copy would keep its rows
    return Rig.model_construct(**sections | {"signals": rows, "motor": motor, "muscles": muscles})

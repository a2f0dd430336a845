"""The guard of a drive that seeks its index pulse by itself: how far, how fast and how hard it may
go.

The drive sets its count at the pulse. The guard counts travel on over that, so that all who watch
the motor's motion go on watching it.
"""

from collections.abc import Mapping

from epa_rt.config.rig import Cia402Drive, Rig
from epa_rt.config.rig_homing import IndexWay
from epa_rt.config.rig_rows import reading
from epa_rt.safety.commands import START_HOMING
from epa_rt.safety.recovery import SPEED_RATIO, RecoveryGuard, Refusal

FELT_S = 0.02  # filter of current and force, as the other methods have it
REFERENCED = 0x8000  # status word bit 15


class Rise:
    """A row that may not leave the value that it had before homing started by more than ``most``
    (SI).
    """

    def __init__(self, name: str, cause: str, unit: str, most: float, share: float):
        self.name = name
        self._cause, self._unit, self._most, self._share = cause, unit, most, share
        self._before = self._now = float("nan")

    def step(self, value: float, has_started: bool) -> Refusal | None:
        """Takes one cycle; until homing has started it learns what is there."""
        now = self._now
        self._now = now = now + self._share * (value - now) if now == now else value
        if not has_started:
            self._before = now
            return None
        risen = now - self._before
        if -self._most <= risen <= self._most:
            return None
        return (
            self._cause,
            self.name,
            f"{self.name} changed by {risen:.4g} {self._unit} while the drive sought its index,"
            f" more than {self._most:.4g} {self._unit}: something is in the way",
        )


class IndexGuard(RecoveryGuard):
    """``seen`` once per cycle before the watches, then ``step`` while nothing has tripped. All SI.

    ``moved``: travel since the start, over the count that was set. ``is_set``: the count was set.
    ``shift``: by how much. One jump is taken for that, once homing has started: to within
    ``way.landing`` of the home that the rig file names. From then on the motor stays within that
    distance, and the drive must call itself referenced within ``way.confirm_s``.
    The way by the motor's speed is bounded as well: a position that stands says nothing of a motion
    too slow for ``MotionCheck``.
    """

    follows_count = True

    def __init__(self, rig: Rig, way: IndexWay):
        super().__init__(rig, lambda measured: False, way.most + way.landing, way.speed)
        assert isinstance(rig.drive, Cia402Drive)
        self.is_set, self.shift, self.moved = False, 0.0, 0.0
        self.has_started = False
        self._way, self._dt_s = way, rig.period_s
        self._control, self._status = rig.drive.control_word, rig.drive.status_word
        self._speed_row = rig.motor.speed or ""
        self._hold_s = rig.safety.position_hold
        self._row: dict[str, float] = {}
        self._last = float("nan")
        self._elsewhere: Refusal | None = None
        self._elapsed_s = self._since_s = self._by_speed = 0.0
        # one landing more than by position: what the speed's own error may add up to
        self._furthest = way.most + 2.0 * way.landing
        zero, share = rig.motor.zero, rig.period_s / (FELT_S + rig.period_s)
        self._rises: list[Rise] = []
        if rig.motor.current and zero.current is not None:
            self._rises.append(Rise(rig.motor.current, "over-current", "A", zero.current, share))
        if zero.force is not None:
            self._rises += [
                Rise(row.name, "over-force", "N", zero.force, share)
                for row in rig.inputs
                if row.si_unit == "N"
            ]

    def seen(
        self, measured: dict[str, float], bus_ok: bool, outputs: Mapping[str, float]
    ) -> dict[str, float]:
        """The row as if the drive had not set its count. ``outputs``: what was sent last. Without
        ``bus_ok`` the values are old, and only the time goes on.
        """
        row = self._row
        row.update(measured)
        self._elapsed_s += self._dt_s
        if bus_ok:
            self.has_started = self.has_started or outputs[self._control] == START_HOMING
            self._take(measured)
            self._elapsed_s = 0.0
        row[self._position] = measured[self._position] - self.shift
        return row

    def _take(self, measured: Mapping[str, float]) -> None:
        position, elapsed_s = measured[self._position], self._elapsed_s
        expected = measured[self._speed_row] * elapsed_s
        jump, self._last = position - self._last - expected, position
        if self.has_started:
            self._by_speed += expected
        most = SPEED_RATIO * self._way.speed * (elapsed_s + self._hold_s)
        if self.is_set or not self.has_started or not abs(jump) > most:
            return
        if abs(position - self._way.home) <= self._way.landing:
            self.is_set, self.shift = True, jump
        elif abs(jump) > self._way.landing:
            self._elsewhere = (
                "position jump",
                self._position,
                f"{self._position} jumped by {self._read(jump)} to {self._read(position)} while the"
                f" drive homed, expected {self._read(self._way.home)} (0x30B0), its home",
            )

    def step(self, measured: Mapping[str, float]) -> Refusal | None:
        """Takes one sound cycle, as ``seen`` gave it."""
        refusal = self._elsewhere or super().step(measured) or self._beyond_by_speed()
        self.moved = measured[self._position] - self._start
        if refusal is None and self.is_set:
            refusal = self._beyond_home(measured)
        for rise in self._rises:
            refusal = refusal or rise.step(measured[rise.name], self.has_started)
        return refusal

    def _beyond_by_speed(self) -> Refusal | None:
        if abs(self._by_speed) <= self._furthest:
            return None
        return (
            "over-travel",
            self._speed_row,
            f"by {self._speed_row} the motor went {self._read(self._by_speed)} since the start,"
            f" more than {self._read(self._furthest)}, and by {self._position}"
            f" {self._read(self.moved)}",
        )

    def _beyond_home(self, measured: Mapping[str, float]) -> Refusal | None:
        away = measured[self._position] + self.shift - self._way.home
        if not abs(away) <= self._way.landing:
            return (
                "over-travel",
                self._position,
                f"{self._position} went {self._read(away)} from the home that was set, more than"
                f" {self._read(self._way.landing)}",
            )
        self._since_s += self._dt_s
        if self._since_s > self._way.confirm_s and not int(measured[self._status]) & REFERENCED:
            return (
                "position jump",
                self._position,
                f"{self._position} jumped by {self._read(self.shift)} while the drive homed, and"
                " the drive does not call itself referenced",
            )
        return None

    def _read(self, travel: float) -> str:
        return reading(self._position, travel)

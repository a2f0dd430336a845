"""The last gate before the bytes. It knows the rig's table and nothing of controllers or
experiments.

Whatever comes in, what leaves is a command within every limit. After a trip, which latches, it is
the stop outputs (brake and hold under power) or the safe ones.
"""

from collections.abc import Callable

from epa_rt.config.rig import Rig
from epa_rt.config.rig_rows import reading_and_limits
from epa_rt.safety.bus_budget import BusBudget
from epa_rt.safety.commands import CommandGate
from epa_rt.safety.contradiction import MotionCheck
from epa_rt.safety.in_motion import InMotion
from epa_rt.safety.stopping import Stopping
from epa_rt.safety.thermal import ThermalLimit
from epa_rt.safety.trip import OVER_RANGE_CAUSE, Trip
from epa_rt.signals.image import image_of
from epa_rt.signals.scaling import scaling_of

INFINITE = float("inf")
LET_DOWN = "let-down"  # the cause of a trip by a load that does not go down as it should
AT_ONCE = ("operator", LET_DOWN)  # causes of a trip after which nothing brakes

Fault = tuple[str, str, str]  # cause, signal, sentence


class Envelope:
    """Checks one cycle: bus health, measured signals, i²t, then the command through its gate.

    ``tripped`` is None or the first Trip; ``gate`` counts what was clamped; ``stopping`` says what
    leaves after a trip. ``reason`` tells in words why a measured row is invalid (the decoder's).
    ``homing`` as CommandGate takes it. ``position_lost``: the motor's count was found wrong, at the
    trip or after it; what it counts from then on is no travel.
    """

    def __init__(self, rig: Rig, reason: Callable[[int], str], homing: bool = False):
        self.tripped: Trip | None = None
        self.gate = CommandGate(rig, homing)
        self.stopping = Stopping(rig)
        self._reason, self._motion = reason, MotionCheck(rig)
        self._has_begun = self.position_lost = False
        self._position = 1 << [row.name for row in rig.inputs].index(rig.motor.position)
        self._in_motion = InMotion(rig)
        self._safe = {row.name: row.safe for row in rig.outputs}
        self._budget = BusBudget(rig)
        self._names = tuple(row.name for row in rig.inputs)
        watched = [row for row in rig.inputs if not row.name.endswith("_raw")]
        beyond = {rig.motor.position: half_count(rig)}
        self._watched = [
            (row.name, low - beyond.get(row.name, 0.0), high + beyond.get(row.name, 0.0))
            for row in watched
            for low, high in (row.limits or (-INFINITE, INFINITE),)
        ]
        self._rows = {row.name: row for row in watched}
        i2t = rig.safety.i2t
        self._current = i2t.current if i2t else ""
        self._thermal = (
            ThermalLimit(i2t.continuous, i2t.time_constant, rig.period_s) if i2t else None
        )

    def trip(self, cause: str, signal: str, text: str, cycle: int) -> None:
        """Latches a trip that somebody above found (valve, drive, recorder). The first one stays.

        The operator's takes the power off at once, whatever tripped before; so does a load that
        does not go down as it should.
        """
        if self.tripped is None:
            self.tripped = Trip(cause, signal, text, cycle)
        if cause in AT_ONCE:
            self.stopping.fall(text)

    def check(
        self,
        cycle: int,
        bus_ok: bool,
        measured: dict[str, float],
        invalid: int,
        stale: int,
        command: dict[str, float],
        now_ns: int = 0,
        fault: Fault | None = None,
    ) -> dict[str, float]:
        """The outputs of this cycle, whose inputs were read at ``now_ns``: the command, limited and
        counted; once tripped, what ``stopping`` allows.

        ``fault``: what somebody above found in this cycle, judged last: a dead sensor is the cause,
        not what it led to.
        """
        powered = self.gate.powered  # by what was sent last
        lost = "" if bus_ok and self._budget.clear else self._budget.step(bus_ok, now_ns)
        if self.tripped is not None:
            apart = self._motion.step(measured, bus_ok, now_ns)
        else:
            if lost:
                self.trip("lost working counter", "", lost, cycle)
            self._check_measured(cycle, measured, invalid, stale)
            apart = self._motion.step(measured, bus_ok, now_ns)
            found = apart or self._in_motion.step(measured, self.gate.outputs, bus_ok, now_ns)
            if found is not None:
                self.trip(*found, cycle)
            if self.tripped is None:
                refusal = self._pass_through(measured, command) or fault
                if refusal is None:
                    return self.gate.outputs
                self.trip(*refusal, cycle)
        if apart is not None or (invalid | stale) & self._position:
            self.position_lost = True
        if not self._has_begun:
            self._has_begun = True
            self.stopping.begin(self.gate, powered)
        if not lost and apart is not None:
            lost = apart[2]
        return self.stopping.step(measured, bus_ok, lost, invalid, stale)

    def _pass_through(self, measured: dict[str, float], command: dict[str, float]) -> Fault | None:
        try:
            return self.gate.pass_through(measured, command)
        except (KeyError, TypeError) as error:  # a row left out, or something that is no number
            text = f"a command that cannot be read ({type(error).__name__}: {error})"
            return "bad command", "", text

    def power_off(self) -> dict[str, float]:
        """The safe outputs; nothing brakes any more."""
        self.stopping.fall("")
        return self._safe

    def _check_measured(
        self, cycle: int, measured: dict[str, float], invalid: int, stale: int
    ) -> None:
        if invalid:
            i = (invalid & -invalid).bit_length() - 1
            self.trip(
                "invalid sensor", self._names[i], f"{self._names[i]} {self._reason(i)}", cycle
            )
            return
        if stale:
            i = (stale & -stale).bit_length() - 1
            self.trip("stale", self._names[i], f"{self._names[i]} has not been renewed", cycle)
            return
        for name, low, high in self._watched:
            if not low <= measured[name] <= high:  # catches NaN as well
                self._out_of_limits(cycle, name, measured[name])
                return
        if self._thermal is not None and self._thermal.step(measured[self._current]):
            text = f"i²t of {self._current} passed its limit (heat {self._thermal.heat_ratio:.2f})"
            self.trip("motor overload", self._current, text, cycle)

    def _out_of_limits(self, cycle: int, name: str, value: float) -> None:
        si_unit, (low, high) = self._rows[name].si_unit, self._rows[name].limits or (0.0, 0.0)
        if value != value:
            self.trip("NaN", name, f"{name} is not a number", cycle)
            return
        cause = OVER_RANGE_CAUSE.get(si_unit, "out of limits")
        found, limits = reading_and_limits(name, value, low, high)
        self.trip(cause, name, f"{name} = {found}, outside {limits}", cycle)


def half_count(rig: Rig) -> float:
    """Half a count of the motor's travel, in its SI unit: a drive that is sent to a limit which is
    no whole count stands at the nearest one, which is not beyond it.
    """
    row = rig.row(rig.motor.position)
    entry = image_of(rig, outputs=False).places[row.entry].entry
    return 0.5 * abs(scaling_of(row, entry, rig).slope)

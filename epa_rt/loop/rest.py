"""Whether the rig is at rest, as measured: motor and joint stand, muscles are vented, no power.

Nothing old counts: a cycle without sound process data, or a row that is invalid or stale, says
nothing.
"""

from collections.abc import Mapping

from epa_rt.config.rig import Rig
from epa_rt.loop.end_state import EndState
from epa_rt.signals.codec import Decoder

REST_S = 0.05  # how long the motor must stand
REST_SHARE = 0.02  # of an axis's top speed: below it the axis stands
JOINT_REST_S = 0.5  # half a swing at 1 Hz: a joint that turns round does not stand
PRESSURE_FILTER_S = 0.02  # over the terminal's steps of about 1 kPa
CURRENT_FILTER_S = 0.1  # over what a loop sends through a motor that holds
UNHEARD_S = 1.0  # after so long without sound process data nothing more will be measured


class StandWatch:
    """An axis stands once it has stayed within a narrow window for a time. Position in SI."""

    def __init__(self, name: str, within: float, cycles: int):
        self.name = name
        self._within, self._cycles = within, max(1, cycles)
        self._low = self._high = float("nan")
        self._age = 0

    def forget(self) -> None:
        self._age = 0

    def step(self, position: float) -> None:
        """Takes one sound cycle's position; one that is no number is never at rest."""
        if self._age == 0:
            self._low = self._high = position
        self._low, self._high = min(self._low, position), max(self._high, position)
        self._age = self._age + 1 if self._high - self._low <= self._within else 0

    @property
    def stands(self) -> bool:
        return self._age >= self._cycles


class RestWatch:
    """``step`` once per cycle while a run ends; ``still``, ``vented``, ``off``, ``unheard``.

    ``motor_stands``: the motor alone; a joint may swing on its muscles. ``pulls``: whether
    something may still pull on a motor that holds; only what is measured not to, does not.
    ``vented_pa``: by muscle, the gauge pressure below which it counts as vented. ``off`` is None
    where nothing on the rig tells: a drive on wires without a row of its current.
    """

    def __init__(self, rig: Rig, decoder: Decoder, vented_pa: Mapping[str, float]):
        self.still = self.motor_stands = self.vented = self.unheard = False
        self.off: bool | None = False
        self._rig, self._decoder = rig, decoder
        motor, period_s = rig.motor, rig.period_s
        self._rest_cycles = max(1, round(REST_S / period_s))
        self._unheard_cycles = max(1, round(UNHEARD_S / period_s))
        self._keep = max(0.0, 1.0 - period_s / PRESSURE_FILTER_S)
        self._bit = {row.name: 1 << i for i, row in enumerate(rig.inputs)}
        self._speed, self._standstill = motor.speed, REST_SHARE * motor.speed_max
        self._axes = [StandWatch(motor.position, self._standstill * REST_S, self._rest_cycles)]
        if rig.joint:
            within = REST_SHARE * rig.joint.speed_max * REST_S
            cycles = round(JOINT_REST_S / period_s)
            self._axes.append(StandWatch(rig.joint.position, within, cycles))
        self._muscles = [
            (muscle.pressure, rig.atmosphere_pa + vented_pa[muscle.name]) for muscle in rig.muscles
        ]
        self._pressures = {name: float("nan") for name, _ in self._muscles}
        self._holds_by, self._holding_a = motor.current, float("nan")
        self._keep_a = max(0.0, 1.0 - period_s / CURRENT_FILTER_S)
        self._most_a = rig.safety.current_holding
        self._by_current = motor.current if rig.drive.interface == "analog" else None
        self._says = rig.drive.interface == "cia402"
        self._band_a, self._zero_a = rig.safety.current_off, 0.0
        self._slow = self._silent = self._heard = self._currentless = self._zeros = 0
        self._last: dict[str, float] = {}
        self._not_believed = self._doubted = 0
        self._inside: list[tuple[str, float, float]] = []
        for name in (motor.position, motor.speed):
            limits = rig.row(name).limits if name else None
            if name and limits:
                self._inside.append((name, *limits))
        self._beyond: dict[str, float] = {}

    def doubt(self, pressure: str) -> None:
        """A pressure that the laws of the gas contradict says nothing of what is stored."""
        if pressure in self._pressures:
            self._doubted |= self._bit[pressure]

    def learn_zero(self, measured: Mapping[str, float], bus_ok: bool) -> None:
        """In bring-up, with the drive off: what its current reads without any."""
        if self._by_current is None or not bus_ok:
            return
        current = measured[self._by_current]
        if current == current:
            self._zeros += 1
            self._zero_a += (current - self._zero_a) / self._zeros

    def step(self, measured: Mapping[str, float], bus_ok: bool, is_off: bool) -> None:
        """Takes one cycle. ``is_off``: the drive's own word, or that of the output that enables
        it.
        """
        if not bus_ok:
            self._silent += 1
            self.unheard = self._silent >= self._unheard_cycles
            if self._says:
                self.off = False
            return
        self._silent, self.unheard = 0, False
        self._heard += 1
        self._last.update(measured)
        self._not_believed = self._decoder.invalid | self._decoder.stale | self._doubted
        for name, low, high in self._inside:
            if not low <= measured[name] <= high:
                self._goes_beyond(name, measured[name])
        self.still = self._stand(measured)
        self.vented = self._empty(measured)
        self.off = self._without_power(measured, is_off)
        if self._holds_by is not None:
            now = measured[self._holds_by] if self._believed(self._holds_by) else float("nan")
            now -= self._zero_a
            before = self._holding_a
            self._holding_a = now + self._keep_a * (before - now) if before == before else now

    @property
    def pulls(self) -> bool:
        """Whether air is stored, or the holding current is not measured to be small."""
        return not (self.vented and abs(self._holding_a) <= self._most_a)

    @property
    def pull(self) -> str:
        """What pulls on the motor, in words."""
        said = [] if self.vented else ["a muscle is not measured to be vented"]
        if self._holding_a != self._holding_a:
            said.append("its holding current is not known")
        elif abs(self._holding_a) > self._most_a:
            said.append(f"holding it takes {abs(self._holding_a):.2f} A")
        return " and ".join(said)

    def _believed(self, name: str) -> bool:
        return not self._not_believed & self._bit[name]

    def _goes_beyond(self, name: str, value: float) -> None:
        """Keeps how far outside its limits a row was while the run ended."""
        if self._believed(name) and abs(value) >= abs(self._beyond.get(name, 0.0)):
            self._beyond[name] = value

    def _stand(self, measured: Mapping[str, float]) -> bool:
        for axis in self._axes:
            if self._believed(axis.name):
                axis.step(measured[axis.name])
            else:
                axis.forget()
        self.motor_stands = self._axes[0].stands
        if self._speed is not None:
            slow = self._believed(self._speed) and abs(measured[self._speed]) < self._standstill
            self._slow = self._slow + 1 if slow else 0
            self.motor_stands = self.motor_stands and self._slow >= self._rest_cycles
        return self.motor_stands and self._axes[-1].stands

    def _empty(self, measured: Mapping[str, float]) -> bool:
        empty, pressures = True, self._pressures
        for name, vented_pa in self._muscles:
            now = measured[name] if self._believed(name) else float("nan")
            before = pressures[name]
            pressures[name] = now + self._keep * (before - now) if before == before else now
            empty = empty and pressures[name] <= vented_pa
        return empty

    def _without_power(self, measured: Mapping[str, float], is_off: bool) -> bool | None:
        if self._says or not is_off:
            return is_off
        if self._by_current is None:
            return None
        flows = not (
            self._believed(self._by_current)
            and abs(measured[self._by_current] - self._zero_a) <= self._band_a
        )
        self._currentless = 0 if flows else self._currentless + 1
        return self._currentless >= self._rest_cycles

    @property
    def stored(self) -> str:
        """What the rig holds now, in words: pressures, travel, speed."""
        return self.state(False).figures(self._rig)

    def state(self, timed_out: bool, let_down: str = "") -> EndState:
        """What is known at this moment, and what is not and why."""
        motor, joint = self._rig.motor, self._rig.joint
        names = [motor.position, *([motor.speed] if motor.speed else [])]
        names += [joint.position] if joint else []
        unknown = tuple(self._unknown([*names, *self._pressures]))
        return EndState(
            {name: self._last[name] for name in names if self._known(name)},
            {name: pa for name, pa in self._pressures.items() if self._known(name)},
            self._last.get(self._by_current) if self._by_current else None,
            self._stands_or_not(names),
            self._vented_or_not(),
            None if self.unheard or not self._heard else self.off,
            "status word" if self._says else "current" if self._by_current else "",
            timed_out,
            dict(self._beyond),
            unknown,
            let_down,
        )

    def _stands_or_not(self, names: list[str]) -> bool | None:
        """None where it was not seen to stand and one of the rows is not known."""
        if self.unheard or not all(map(self._known, names)):
            return None
        return self.still

    def _vented_or_not(self) -> bool | None:
        """None where no muscle is known to hold pressure and one of them is not known."""
        if self.unheard or not self._heard:
            return None
        if any(self._pressures[name] > vented_pa for name, vented_pa in self._muscles):
            return False
        return self.vented or None

    def _known(self, name: str) -> bool:
        return name in self._last and self._believed(name)

    def _unknown(self, names: list[str]) -> list[str]:
        if not self._heard:
            return ["nothing was measured"]
        found = []
        if self._silent:
            found.append(
                f"nothing sound from the bus in the last {self._silent} cycles; the figures are"
                " older"
            )
        for name in names:
            if not self._believed(name):
                i = list(self._bit).index(name)
                is_stale = self._decoder.stale & self._bit[name]
                why = "has not been renewed" if is_stale else self._decoder.reason(i)
                if self._doubted & self._bit[name]:
                    why = "is not plausible, as the trip found"
                found.append(f"{name} {why}")
        if not self._says and not self._by_current:
            found.append("whether the drive is off: the rig has no row of its current")
        return found

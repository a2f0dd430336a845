"""The run as a machine of ten states, from a rig at rest to a rig that is at rest again.

Bring-up moves nothing; the drive is enabled with its targets on the actual values; phases run. A
run that ends by itself, or by the operator's first stop, holds under power while it vents. A trip
brakes, holds and vents by the envelope's stop outputs. Where something still pulls then, the motor
is let down to where nothing does. Every way out ends in ``safe``, watched until the rig is measured
to be at rest. It decides what to ask for; whether that may leave is the
envelope's to say.
"""

from collections.abc import Callable, Mapping

from epa_rt.config.rig import Rig
from epa_rt.control.protocol import Controller
from epa_rt.control.valve import SetAndHold, ValveState
from epa_rt.experiments.plan import Plan
from epa_rt.loop.drives import Drive
from epa_rt.loop.end_state import EndState
from epa_rt.loop.following import Following
from epa_rt.loop.letting_down import LettingDown
from epa_rt.loop.referenced import Referenced
from epa_rt.loop.rest import RestWatch
from epa_rt.safety.at_rest import AtRest
from epa_rt.safety.envelope import LET_DOWN as LET_DOWN_CAUSE
from epa_rt.safety.gas_watch import CAUSE as IMPLAUSIBLE
from epa_rt.safety.stopping import BRAKING, Stopping
from epa_rt.safety.trip import Trip

STATES = (
    "bring_up",
    "enable",
    "run",
    "stop",
    "brake",
    "vent",
    "let_down",
    "disable",
    "safe",
    "done",
)
BRING_UP, ENABLE, RUN, STOP, BRAKE, VENT, LET_DOWN, DISABLE, SAFE, DONE = range(10)

BRING_UP_S = 0.1
REST_MAX_S = 1.0  # longest wait for the motor to stand before the muscles are vented all the same
DISABLE_S = 0.5  # longest wait for the drive to come down by its own ramp
SAFE_MIN_S = 0.1
OFF_MAX_S = 1.0  # of a rig at rest: longest wait for the drive to say that it is off

Fault = tuple[str, str, str]  # cause, signal, sentence


class Supervisor:
    """One step per cycle. ``command``, ``reference`` and ``estimate`` are written in place, in
    table order.

    ``fault`` is what the supervisor found and the envelope shall trip on. ``events`` are (kind,
    text, data), to be drained by the loop. ``confirmed``: the drive was found off after the safe
    outputs went out. ``end`` is what was measured last, once done. ``category``: how a trip stopped
    the rig, in words. ``motions``: by loop. ``needs_zero``: refuses a rig whose travel
    has none, and ``found_zero`` is what that look found, None before; ``has_zero``: of a run
    without that.
    """

    def __init__(
        self,
        rig: Rig,
        sequence: Plan,
        valves: Mapping[str, SetAndHold],
        motions: Mapping[str, Controller],
        drive: Drive,
        rest: RestWatch,
        needs_zero: bool = True,
        has_zero: Callable[[], bool] = lambda: True,
    ):
        self.state = BRING_UP
        self.fault: Fault | None = None
        self.events: list[tuple[str, str, dict[str, object]]] = [("state", "bring_up", {})]
        self.hints: tuple[str, ...] = ()  # of bring-up: what to calibrate
        self.end: EndState | None = None
        self.category = ""
        self.found_zero: bool | None = None
        self.sequence = sequence
        self.command = {row.name: row.safe for row in rig.outputs}
        self.reference = dict.fromkeys(sequence.reference_names, float("nan"))
        self.estimate = {f"est_{m.pressure}": float("nan") for m in rig.muscles}
        self._safe = dict(self.command)
        self._referenced = Referenced(rig) if needs_zero else None
        self._letting_down = LettingDown(rig, rest, has_zero)
        self._following = Following(rig, tuple((valves[m.name], m.name) for m in rig.muscles))
        self.motions, self._motion = motions, next(iter(motions.values()))
        self._drive, self._rest_watch, self._dt_s = drive, rest, rig.period_s
        self._sensors_at_rest = AtRest(rig)
        self._valves = [
            (valves[m.name], m.name, m.pressure, m.inlet, m.exhaust, f"est_{m.pressure}")
            for m in rig.muscles
        ]
        self._target, self._position = rig.motor.position_target, rig.motor.position
        self._targets = [t for t in (rig.motor.speed_target, rig.motor.torque_target) if t]
        self._torque = rig.motor.torque_target
        brake = rig.motor.brake
        self._brake = brake.output if brake else None
        self._release_cycles = round(brake.release_delay / rig.period_s) if brake else 0
        self._close_cycles = round(brake.close_delay / rig.period_s) if brake else 0
        self._age = self._live = self._ended = self._closing = 0
        self._stopping: Stopping | None = None  # from a trip on: the envelope's
        self._timed_out = False
        self._rest_max_cycles = round(REST_MAX_S / rig.period_s)
        self._timeout_s = rig.safety.rest_timeout
        self._timeout_cycles = round(self._timeout_s / rig.period_s)
        self._off_cycles = round(OFF_MAX_S / rig.period_s)
        self._cycles = {
            s: max(1, round(seconds / rig.period_s))
            for s, seconds in ((BRING_UP, BRING_UP_S), (DISABLE, DISABLE_S), (SAFE, SAFE_MIN_S))
        }

    @property
    def confirmed(self) -> bool:
        """Whether the drive was measured to be off."""
        return bool(self.end is not None and self.end.off)

    def look(self, measured: dict[str, float]) -> None:
        """Takes what was measured last, where a run broke off before it had begun to end."""
        self._watch(measured, True)

    @property
    def held_power(self) -> bool:
        """Whether the drive was under power when the supervisor last looked."""
        return RUN <= self.state < DISABLE

    def end_state(self) -> EndState:
        """What is known of the rig at this moment, or at the end where that was reached."""
        return self.end or self._state_now()

    def _state_now(self) -> EndState:
        return self._rest_watch.state(self._timed_out, self._letting_down.text)

    @property
    def phase(self) -> int:
        return self.sequence.phase_index

    def step(
        self, cycle: int, measured: dict[str, float], stop: bool, bus_ok: bool = True
    ) -> dict[str, float]:
        """The command of this cycle. Without ``bus_ok`` nothing that the drive seems to say is
        believed.
        """
        self._age += 1
        if self.state == RUN or self.state == STOP:
            self._run(cycle, measured, stop)
        elif self.state == BRING_UP:
            self._rest_watch.learn_zero(measured, bus_ok)
            self._bring_up(measured, stop, bus_ok)
        elif self.state == ENABLE:
            self._enable(measured, stop)
        elif self._stopping is not None and self.state < DISABLE:
            self._stop_by_category(self._stopping, measured, bus_ok)
        elif self.state == VENT:
            self._vent(measured, bus_ok)
        elif self.state == LET_DOWN:
            self._let_down(measured, bus_ok)
        else:
            self._come_down(measured, bus_ok)
        return self.command

    def after_trip(
        self, trip: Trip, stopping: Stopping, measured: dict[str, float], bus_ok: bool
    ) -> None:
        """Every cycle after the envelope tripped: brake with it while it brakes, else be safe at
        once, and say what the rig still stores.
        """
        if trip.cause == IMPLAUSIBLE:
            self._rest_watch.doubt(trip.signal)
        if self.state >= SAFE:
            return
        if stopping.category == BRAKING:
            if self._stopping is None:
                self._stopping, self._closing = stopping, 0
                self._drive.disable(False)
                self._say_category(1, "the drive brakes, and holds while the muscles vent")
                self._enter(BRAKE)
            return
        self._drive.disable(False)
        if stopping.why:
            self._watch(measured, True)  # without the bus: what it brought last
            stored = self._rest_watch.stored
            self._say_category(0, f"power off, air out: {stopping.why}; stored then: {stored}")
        self._enter(SAFE)

    def _say_category(self, category: int, text: str) -> None:
        self.category = f"stop category {category}: {text}"
        self.events.append(("category", self.category, {"category": category}))

    def _enter(self, state: int) -> None:
        self.state, self._age = state, 0
        self.events.append(("state", STATES[state], {}))

    def _rest(self, measured: dict[str, float]) -> None:
        """No speed, no torque, and a position target that follows the rig, so that power on moves
        nothing.
        """
        for name in self._targets:
            self.command[name] = self._safe[name]
        if self._target:
            self.command[self._target] = measured[self._position]

    def _bring_up(self, measured: dict[str, float], stop: bool, bus_ok: bool) -> None:
        sensors = self._sensors_at_rest
        self._rest(measured)
        self._drive.step(measured, self.command)
        sensors.step(measured, bus_ok)
        if stop:
            self._enter(DISABLE)
        elif self._age >= self._cycles[BRING_UP] and sensors.done:
            if self._referenced is None:  # by hand: said, and no reason to stay where it is
                self._say_sensor(sensors.refusal)
            elif sensors.refusal is not None:
                self.fault = sensors.refusal
                return
            else:
                refusal = self._referenced.refusal(measured)
                self.found_zero = refusal is None
                if refusal is not None:
                    self.fault = refusal
                    return
            self.events += sensors.hints
            self.hints = tuple(text for _, text, _ in sensors.hints)
            self.sequence.begin(measured)
            self._drive.enable()
            self._enter(ENABLE)

    def _say_sensor(self, refusal: Fault | None) -> None:
        if refusal is not None:
            self.events.append(("sensor", f"{refusal[0]}: {refusal[2]}", {"signal": refusal[1]}))

    def _enable(self, measured: dict[str, float], stop: bool) -> None:
        """Once the drive is live its targets stay where they are, and the brake has time to
        open.
        """
        if not self._live:
            self._rest(measured)
        self._drive.step(measured, self.command)
        self._live = self._live + 1 if self._drive.live else 0
        if self._brake is not None:
            self.command[self._brake] = float(self._live > 1)
        trouble = self._drive.trouble(measured)
        if trouble:
            self.fault = ("drive", "", f"the drive cannot be enabled: {trouble}")
        elif stop:
            self._leave(measured)
        elif self._live > self._release_cycles:
            self._enter(RUN)

    def _run(self, cycle: int, measured: dict[str, float], stop: bool) -> None:
        sequence, command, drive = self.sequence, self.command, self._drive
        reference = self.reference
        if stop and self.state == RUN:
            if sequence.phase_index < 0:  # nothing has begun: there is no reference to brake from
                return self._leave(measured)
            sequence.brake()
            self._enter(STOP)
        sequence.step(measured, reference, cycle)
        if sequence.events:
            self.events += sequence.events
            sequence.events.clear()
        drive.step(measured, command)
        if sequence.loop_changed:
            self._motion = self.motions[sequence.loop]
            self._motion.reset(measured, command)
        if self._target:
            command[self._target] = measured[self._position]
        command.update(self._motion.step(measured, reference, self._dt_s))
        self.fault = self._following.step(sequence.loop, measured, reference, command)
        self._switch_valves(measured)
        if not drive.live:
            self._drive_is_lost(measured)
        elif sequence.failure:
            self.fault = ("experiment", "", sequence.failure)
        elif sequence.finished and self._stands(measured):
            self._begin_to_vent()
        return None

    def _drive_is_lost(self, measured: dict[str, float]) -> None:
        if self._brake is not None:
            self.command[self._brake] = self._safe[self._brake]
        trouble = self._drive.trouble(measured) or "it reported itself disabled"
        self.fault = ("drive", "", f"the drive was lost: {trouble}")

    def _leave(self, measured: dict[str, float]) -> None:
        self._rest(measured)
        if self._brake is not None:
            self.command[self._brake] = self._safe[self._brake]
        self._drive.disable(True)
        self._enter(DISABLE)

    def _stands(self, measured: dict[str, float]) -> bool:
        """Whether the motor stands; its reference being at rest does not say so. A torque holds
        nothing, so there is nothing to wait for: the drive itself brakes and holds.
        """
        self._ended += 1
        self._watch(measured, True)
        return (
            self._rest_watch.motor_stands
            or self._ended >= self._rest_max_cycles
            or (
                self._torque is not None
                and self._torque in self._motion.writes
                and self.command[self._torque] == 0.0
            )
        )

    def _begin_to_vent(self) -> None:
        for valve, *_ in self._valves:
            if valve.state is not ValveState.VENTED:
                valve.vent()
        if self._torque in self._motion.writes:
            self._drive.quick_stop()
        self._enter(VENT)

    def _vent(self, measured: dict[str, float], bus_ok: bool) -> None:
        """The motor stays where it is while the muscles vent; a joint loop would wind up after a
        joint that sinks. Power goes once all is measured vented and at rest, or has had its time.
        """
        command, name = self.command, self._target
        held = command[name] if name is not None and name in self._motion.writes else None
        self._rest(measured)
        if name is not None and held is not None:
            command[name] = held
        self._drive.step(measured, command)
        self._switch_valves(measured)
        self._watch(measured, bus_ok)
        if not self._drive.holds:
            self._drive_is_lost(measured)
        elif self._may_lose_power(measured):
            self._close_and_leave(measured)

    def _close_and_leave(self, measured: dict[str, float]) -> None:
        if self._brake is not None:
            self.command[self._brake] = self._safe[self._brake]
        if self._closing > self._close_cycles:
            self._leave(measured)

    def _let_down(self, measured: dict[str, float], bus_ok: bool) -> None:
        """Slowly to the rest place by the loop that held the motor, then as from ``vent``."""
        command = self.command
        self._rest(measured)
        self._drive.step(measured, command)
        self._switch_valves(measured)
        self._watch(measured, bus_ok)
        is_down = self._is_down(measured, bus_ok)
        if not self._drive.holds:
            self._drive_is_lost(measured)
        elif self._letting_down.trouble:
            why = f"the motor cannot be let down: {self._letting_down.trouble}"
            self.fault = (LET_DOWN_CAUSE, self._position, why)
        elif is_down:
            self._close_and_leave(measured)

    def _may_lose_power(self, measured: dict[str, float]) -> bool:
        """Whether the rig is vented and stands, or has had its time, and need not be let down;
        then counts the cycles that the brake has had to close.
        """
        rest = self._rest_watch
        if not self._closing:
            if not (rest.still and rest.vented):
                if self._age < self._timeout_cycles and not rest.unheard:
                    return False
                self._timed_out = True
            down = self._letting_down
            is_wanted = down.wanted(measured, self.command, self._stopping)
            if down.text:
                self.events.append(("let_down", down.text, {}))
            if is_wanted:
                self._enter(LET_DOWN)
                return False
        self._closing += 1
        return True

    def _is_down(self, measured: dict[str, float], bus_ok: bool) -> bool:
        """Whether the motor is where nothing pulls; then counts as ``_may_lose_power`` does."""
        down = self._letting_down
        if not down.step(measured, self.command, bus_ok) and not self._closing:
            return False
        if not self._closing:
            down.close()
            self.events.append(("let_down", down.text, {}))
        self._closing += 1
        return True

    def _stop_by_category(
        self, stopping: Stopping, measured: dict[str, float], bus_ok: bool
    ) -> None:
        """The envelope brakes and holds; this watches, and takes the power off in the end."""
        self.command.update(self._safe)
        self._drive.step(measured, self.command)
        self._watch(measured, bus_ok)
        if self.state == BRAKE:
            if self._rest_watch.motor_stands or self._age >= self._rest_max_cycles:
                self._enter(VENT)
        elif (
            self._is_down(measured, bus_ok)
            if self.state == LET_DOWN
            else self._may_lose_power(measured)
        ):
            stopping.close_brake()
            if self._closing > self._close_cycles:
                self._enter(SAFE)

    def _watch(self, measured: dict[str, float], bus_ok: bool) -> None:
        self._rest_watch.step(measured, bus_ok, self._drive.off)

    def _switch_valves(self, measured: dict[str, float]) -> None:
        command, estimate, dt_s = self.command, self.estimate, self._dt_s
        for valve, name, pressure, inlet, exhaust, estimated in self._valves:
            inlet_open, exhaust_open = valve.step(measured[pressure], dt_s)
            command[inlet] = 1.0 if inlet_open else 0.0
            command[exhaust] = 1.0 if exhaust_open else 0.0
            estimate[estimated] = valve.estimate_pa
            if valve.events:
                self.events += [
                    (kind, f"{name}: {text}", {"muscle": name, **data})
                    for kind, text, data in valve.events
                ]
                valve.events.clear()
            if valve.failure is not None:
                self.fault = ("valve", pressure, f"{name}: {valve.failure}")

    def _come_down(self, measured: dict[str, float], bus_ok: bool) -> None:
        """Disable, then safe: valves de-energised, drive off, watched until the rig is at rest."""
        self.command.update(self._safe)
        if self._target:
            self.command[self._target] = measured[self._position]
        self._drive.step(measured, self.command)
        self._watch(measured, bus_ok)
        if self.state == DISABLE:
            if (bus_ok and self._drive.off) or self._age >= self._cycles[DISABLE]:
                self._drive.disable(False)
                self._enter(SAFE)
        elif self._age >= self._cycles[SAFE] and self._is_over():
            self.end = self._state_now()
            self._enter(DONE)

    def _is_over(self) -> bool:
        """Whether nothing is left to wait for: all at rest, or nothing to be heard, or its time
        over. What was not vented under power is not waited for again.
        """
        rest = self._rest_watch
        if rest.unheard:
            return True
        if rest.still and (rest.vented or self._timed_out):
            return rest.off is not False or self._age >= self._off_cycles
        if self._age < self._timeout_cycles:
            return False
        self._timed_out = True
        return True

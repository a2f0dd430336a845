"""The run as a machine of seven states, from a rig at rest to a rig that is safe again.

Bring-up moves nothing; the drive is enabled with its targets on the actual values; phases run;
every way out ends in ``safe``. It decides what to ask for; whether that may leave is the envelope's
to say.
"""

from collections.abc import Mapping

from epa_rt.config.rig import Rig
from epa_rt.control.protocol import Controller
from epa_rt.control.valve import SetAndHold, ValveState
from epa_rt.experiments.sequence import Sequence
from epa_rt.loop.drives import Drive
from epa_rt.loop.following import Following
from epa_rt.safety.at_rest import AtRest

STATES = ("bring_up", "enable", "run", "stop", "disable", "safe", "done")
BRING_UP, ENABLE, RUN, STOP, DISABLE, SAFE, DONE = range(7)

BRING_UP_S = 0.1
REST_S, REST_MAX_S = (
    0.05,
    1.0,
)  # how long the motor must stand before power is taken off, and the longest wait for it
REST_SHARE = 0.02  # of the motor's top speed: below it the motor stands
VENT_MAX_S = (
    5.0  # longest wait for the muscles to vent: one that still pulls would spin an unpowered motor
)
DISABLE_S = 0.5  # longest wait for the drive to come down by its own ramp
SAFE_MIN_S, SAFE_MAX_S = 0.1, 1.0

Fault = tuple[str, str, str]  # cause, signal, sentence


class Supervisor:
    """One step per cycle. ``command``, ``reference`` and ``estimate`` are written in place, in
    table order.

    ``fault`` is what the supervisor found and the envelope shall trip on. ``events`` are (kind,
    text, data), to be drained by the loop. ``confirmed``: the drive reported itself off after the
    safe outputs went out. ``motions``: by loop.
    """

    def __init__(
        self,
        rig: Rig,
        sequence: Sequence,
        valves: Mapping[str, SetAndHold],
        motions: Mapping[str, Controller],
        drive: Drive,
    ):
        self.state = BRING_UP
        self.fault: Fault | None = None
        self.events: list[tuple[str, str, dict]] = [("state", "bring_up", {})]
        self.confirmed, self._bus_ok = False, True
        self.sequence = sequence
        self.command = {row.name: row.safe for row in rig.outputs}
        self.reference = dict.fromkeys(sequence.reference_names, float("nan"))
        self.estimate = {f"est_{m.pressure}": float("nan") for m in rig.muscles}
        self._safe = dict(self.command)
        self._following = Following(rig, tuple((valves[m.name], m.name) for m in rig.muscles))
        self.motions, self._motion = motions, next(iter(motions.values()))
        self._drive, self._dt_s = drive, rig.period_s
        self._sensors_at_rest = AtRest(rig)
        self._valves = [
            (valves[m.name], m.name, m.pressure, m.inlet, m.exhaust, f"est_{m.pressure}")
            for m in rig.muscles
        ]
        self._target, self._position = rig.motor.position_target, rig.motor.position
        self._targets = [t for t in (rig.motor.speed_target, rig.motor.torque_target) if t]
        self._speed, self._standstill = rig.motor.speed, REST_SHARE * rig.motor.speed_max
        self._age = self._still = self._ended = self._vent_cycles = 0
        self._vent_max_cycles = round(VENT_MAX_S / rig.period_s)
        self._rest_cycles, self._rest_max_cycles = (
            round(REST_S / rig.period_s),
            round(REST_MAX_S / rig.period_s),
        )
        self._cycles = {
            s: max(1, round(seconds / rig.period_s))
            for s, seconds in (
                (BRING_UP, BRING_UP_S),
                (DISABLE, DISABLE_S),
                (SAFE, SAFE_MIN_S),
                (DONE, SAFE_MAX_S),
            )
        }

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
        self._bus_ok = bus_ok
        if self.state == RUN or self.state == STOP:
            self._run(cycle, measured, stop)
        elif self.state == BRING_UP:
            self._bring_up(measured, stop)
        elif self.state == ENABLE:
            self._enable(measured, stop)
        else:
            self._come_down(measured)
        return self.command

    def be_safe(self) -> None:
        """The envelope has tripped: from here on only safe outputs are asked for, until the rig is
        seen to be off.
        """
        if self.state < SAFE:
            self._drive.disable(False)
            self._enter(SAFE)

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

    def _bring_up(self, measured: dict[str, float], stop: bool) -> None:
        self._rest(measured)
        self._drive.step(measured, self.command)
        self._sensors_at_rest.step(measured, self._bus_ok)
        if stop:
            self._enter(DISABLE)
        elif self._sensors_at_rest.refusal is not None:
            self.fault = self._sensors_at_rest.refusal
        elif self._age >= self._cycles[BRING_UP] and self._sensors_at_rest.done:
            self.events += self._sensors_at_rest.hints
            self.sequence.begin(measured)
            self._drive.enable()
            self._enter(ENABLE)

    def _enable(self, measured: dict[str, float], stop: bool) -> None:
        self._rest(measured)
        self._drive.step(measured, self.command)
        trouble = self._drive.trouble(measured)
        if trouble:
            self.fault = ("drive", "", f"the drive cannot be enabled: {trouble}")
        elif stop:
            self._leave(measured)
        elif self._drive.live:
            self._enter(RUN)

    def _run(self, cycle: int, measured: dict[str, float], stop: bool) -> None:
        sequence, command, drive = self.sequence, self.command, self._drive
        if stop and self.state == RUN:
            if sequence.phase_index < 0:  # nothing has begun: there is no reference to brake from
                return self._leave(measured)
            sequence.brake()
            self._enter(STOP)
        sequence.step(measured, self.reference, cycle)
        if sequence.events:
            self.events += sequence.events
            sequence.events.clear()
        drive.step(measured, command)
        if sequence.loop_changed:
            self._motion = self.motions[sequence.loop]
            self._motion.reset(measured, command)
        if self._vent_cycles:
            self._hold_still(measured)
        else:
            if self._target:
                command[self._target] = measured[self._position]
            command.update(self._motion.step(measured, self.reference, self._dt_s))
            self.fault = self._following.step(sequence.loop, measured, self.reference, command)
        self._switch_valves(measured)
        if not drive.live:
            trouble = drive.trouble(measured) or "it reported itself disabled"
            self.fault = ("drive", "", f"the drive was lost: {trouble}")
        elif sequence.failure:
            self.fault = ("experiment", "", sequence.failure)
        elif sequence.finished and self._at_rest(measured) and self._vented():
            self._leave(measured)
        return None

    def _leave(self, measured: dict[str, float]) -> None:
        self._rest(measured)
        self._drive.disable(True)
        self._enter(DISABLE)

    def _at_rest(self, measured: dict[str, float]) -> bool:
        """Whether the motor has stood still for a while; its reference being at rest does not say
        so.
        """
        self._ended += 1
        moves = self._speed is not None and abs(measured[self._speed]) >= self._standstill
        self._still = 0 if moves else self._still + 1
        return self._still >= self._rest_cycles or self._ended >= self._rest_max_cycles

    def _hold_still(self, measured: dict[str, float]) -> None:
        """The motor stays where it is while the muscles vent; a joint loop would wind up after a
        joint that sinks.
        """
        target = self.command[self._target] if self._target in self._motion.writes else None
        self._rest(measured)
        if target is not None:
            self.command[self._target] = target

    def _vented(self) -> bool:
        """Vents what still holds pressure, with the motor held; True once all is vented, or has had
        its time.
        """
        for valve, *_ in self._valves if self._vent_cycles == 0 else ():
            if valve.state is not ValveState.VENTED:
                valve.vent()
        self._vent_cycles += 1
        return self._vent_cycles >= self._vent_max_cycles or all(
            valve.state is ValveState.VENTED for valve, *_ in self._valves
        )

    def _switch_valves(self, measured: dict[str, float]) -> None:
        command, estimate = self.command, self.estimate
        for valve, name, pressure, inlet, exhaust, estimated in self._valves:
            inlet_open, exhaust_open = valve.step(measured[pressure], self._dt_s)
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

    def _is_off(self) -> bool:
        return self._bus_ok and self._drive.off

    def _come_down(self, measured: dict[str, float]) -> None:
        """Disable, then safe: valves de-energised, drive off, watched until it says so."""
        self.command.update(self._safe)
        if self._target:
            self.command[self._target] = measured[self._position]
        self._drive.step(measured, self.command)
        if self.state == DISABLE:
            if self._is_off() or self._age >= self._cycles[DISABLE]:
                self._drive.disable(False)
                self._enter(SAFE)
        elif self._age >= self._cycles[SAFE] and (
            self._is_off() or self._age >= self._cycles[DONE]
        ):
            self.confirmed = self._is_off()
            self._enter(DONE)

"""Set a muscle's pressure with one inlet and one exhaust valve, then hold it closed.

Fill or exhaust toward the target, close early by what still flows, let the gas come to rest,
average, trim by single pulses whose width follows from what earlier pulses did, and hold. Nothing
here reads a clock: time is the sum of dt_s.
"""

from math import nan

from epa_rt.control.valve_faults import open_valve
from epa_rt.control.valve_heat import HeatAccount
from epa_rt.control.valve_settings import ValveCause, ValveSettings, ValveState
from epa_rt.control.valve_trim import Trim, TrimStep
from epa_rt.control.valve_watch import BlockAverage, HoldWatch, RampFollower, share

__all__ = ["SetAndHold", "ValveCause", "ValveSettings", "ValveState"]

_VENT_ON = (ValveCause.OVER_PRESSURE, ValveCause.INLET_STUCK_OPEN)
_OPENS_EXHAUST = (ValveState.VENTING, ValveState.VENTED)


class SetAndHold:
    """Set-and-hold of one muscle; pressures are absolute Pa, times s.

    Read `state`, `settled`, `drifting`, `estimate_pa`, `target_pa`, `switchings`, `cause`
    (ValveCause), `cause_text` and `failure` (the same text, or None). `events` holds (kind, text,
    data) of kind "state", "switch", "drift", "accept" or "failed" until taken. A failure stays
    until set, vent or close.
    """

    __slots__ = (
        "settings",
        "state",
        "settled",
        "drifting",
        "estimate_pa",
        "target_pa",
        "switchings",
        "cause",
        "cause_text",
        "failure",
        "events",
        "_inlet",
        "_exhaust",
        "_sent_inlet",
        "_sent_exhaust",
        "_handler",
        "_handlers",
        "_dt_s",
        "_estimate_share",
        "_over_pa",
        "_drift_pa",
        "_timer_s",
        "_window_s",
        "_window_pa",
        "_start_pa",
        "_closed_pa",
        "_closed_rate_pa_s",
        "_suspect",
        "_may_retrim",
        "_hold_only",
        "_ramp",
        "_blocks",
        "_watch",
        "_trim",
        "_heat",
        "_rest_pa",
    )

    def __init__(self, settings: ValveSettings) -> None:
        s = self.settings = settings
        self.estimate_pa = self.target_pa = nan
        self.switchings = 0
        self.cause, self.cause_text = ValveCause.NONE, ""
        self.failure: str | None = None
        self._suspect = ValveCause.NONE
        self.events: list[tuple[str, str, dict[str, object]]] = []
        self.drifting = False
        self._sent_inlet = self._sent_exhaust = self._may_retrim = self._hold_only = False
        self._dt_s = nan
        self._estimate_share = self._timer_s = self._window_s = self._closed_rate_pa_s = 0.0
        self._window_pa = self._start_pa = self._closed_pa = nan
        self._over_pa, self._drift_pa = s.over_pressure_pa, s.drift_pa
        self._ramp, self._blocks = RampFollower(), BlockAverage(s.average_s)
        self._watch = HoldWatch(s.hold_lost_ratio, s.atmosphere_pa)
        self._trim = Trim(s)
        self._heat, self._rest_pa = HeatAccount(s), nan  # before the flow, at rest
        self._handlers = {
            ValveState.CLOSED: self._closed,
            ValveState.FILLING: self._flowing,
            ValveState.EXHAUSTING: self._flowing,
            ValveState.SETTLING: self._settling,
            ValveState.TRIMMING: self._trimming,
            ValveState.HOLDING: self._holding,
            ValveState.VENTING: self._venting,
            ValveState.VENTED: self._vented,
            ValveState.FAILED: self._idle,
        }
        self.state = ValveState.CLOSED
        self._enter(ValveState.CLOSED)
        self.events.clear()

    # Commands

    def set(self, target_pa: float) -> None:
        """Bring the pressure to target_pa and hold it. ValueError outside atmosphere ..
        over-pressure.
        """
        s = self.settings
        if not s.atmosphere_pa <= target_pa < s.over_pressure_pa:
            raise ValueError(
                f"target_pa: found {target_pa}, expected {s.atmosphere_pa} (atmosphere) to below"
                f" {s.over_pressure_pa}"
            )
        self.target_pa = target_pa
        self._hold_only = False
        self._clear()
        if self.state is ValveState.HOLDING:
            self._heat.stood(self._timer_s)
        elif self.state in (ValveState.CLOSED, ValveState.VENTED):
            self._heat.forget()
        elif self._inlet or self._exhaust:
            self._heat.flowed(self._rest_pa, self.estimate_pa)
        self._enter(ValveState.SETTLING)
        self._handler = self._begin

    def vent(self) -> None:
        """Open the exhaust until the muscle is at atmosphere."""
        self.target_pa = self.settings.atmosphere_pa
        self._clear()
        self._start_pa = self._window_pa = self.estimate_pa
        self._enter(ValveState.VENTING)

    def hold(self) -> None:
        """Close both valves and hold what is there, never re-trimmed; without effect after a
        failure.
        """
        if self.state is ValveState.FAILED:
            return
        if self.estimate_pa != self.estimate_pa:
            self.close()  # no sample yet: nothing to hold
            return
        self._hold_only = True
        if self.state is not ValveState.HOLDING:
            self.target_pa = self.estimate_pa
            self._watch.start(self.estimate_pa)
            self._enter(ValveState.HOLDING)

    def close(self) -> None:
        """Close both valves and watch for nothing but an open valve; clears a failure."""
        self._clear()
        self.target_pa = nan
        self._watch.start(self.estimate_pa)
        self._enter(ValveState.CLOSED)

    def allow_retrim(self, allowed: bool) -> None:
        """Whether a drift in hold may be trimmed away; without effect on `hold`."""
        self._may_retrim = allowed

    def take_events(self) -> list[tuple[str, str, dict[str, object]]]:
        """Events since the last call, oldest first."""
        taken, self.events = self.events, []
        return taken

    # The cycle

    def step(self, pressure_pa: float, dt_s: float) -> tuple[bool, bool]:
        """(inlet open, exhaust open) of this cycle, never both; ValueError if dt_s is not above
        zero.
        """
        if dt_s != self._dt_s:
            self._set_period(dt_s)
        if 0.0 <= pressure_pa <= self._over_pa:
            estimate = self.estimate_pa
            if estimate == estimate:
                self.estimate_pa = estimate + self._estimate_share * (pressure_pa - estimate)
            else:
                self.estimate_pa = pressure_pa
            self._handler(pressure_pa)
        else:
            self._refuse(pressure_pa)
        inlet = self._inlet
        exhaust = self._exhaust
        if inlet is not self._sent_inlet or exhaust is not self._sent_exhaust:
            self._count_switchings(pressure_pa)
        return inlet, exhaust

    def _set_period(self, dt_s: float) -> None:
        if not 0.0 < dt_s < 1e3:
            raise ValueError(f"dt_s: found {dt_s}, expected above zero")
        s = self.settings
        self._dt_s = dt_s
        self._estimate_share = share(dt_s, s.estimate_s)
        self._watch.set_period(dt_s, s.hold_average_s, s.hold_reference_s)

    def _refuse(self, pressure_pa: float) -> None:
        """A pressure that is none, or too high. Closed and vented valves need no pressure to be
        safe.
        """
        if pressure_pa > self._over_pa:
            if self.state not in (ValveState.FAILED, *_OPENS_EXHAUST):
                self._fail(
                    ValveCause.OVER_PRESSURE,
                    f"{pressure_pa / 1e3:.1f} kPa abs is above {self._over_pa / 1e3:.1f} kPa abs",
                )
        elif self.state not in (ValveState.FAILED, ValveState.CLOSED, ValveState.VENTED):
            self._fail(ValveCause.BAD_PRESSURE, f"the pressure reads {pressure_pa}")

    # One handler per state

    def _idle(self, pressure_pa: float) -> None:
        pass

    def _closed(self, pressure_pa: float) -> None:
        watch = self._watch
        if watch.slow_pa != watch.slow_pa:
            watch.start(pressure_pa)
        elif watch.step(pressure_pa) > 0:
            self._fail(
                ValveCause.INLET_STUCK_OPEN,
                f"rose to {watch.slow_pa / 1e3:.1f} kPa abs with both valves closed",
            )

    def _begin(self, pressure_pa: float) -> None:
        self._trim.start()
        self._correct(self.estimate_pa)

    def _flowing(self, pressure_pa: float) -> None:
        s = self.settings
        ramp = self._ramp
        ramp.step(pressure_pa)
        self._timer_s += self._dt_s
        sign = self._trim.direction
        rate = sign * ramp.rate_pa_s
        left = sign * (self.target_pa - ramp.level_pa)
        if left <= (rate * self._trim.response.lead_s if rate > 0.0 else 0.0):
            self._stop_flow(rate)
        elif self._timer_s - self._window_s >= s.no_rise_after_s:
            self._check_flow(sign)
        elif self._timer_s > s.fill_timeout_s:
            self._fail(
                ValveCause.TIME_OUT,
                f"{self.state.value} for {self._timer_s:.1f} s, {left / 1e3:.1f} kPa left",
            )

    def _stop_flow(self, rate_pa_s: float) -> None:
        if rate_pa_s > 10e3:
            self._trim.response.learn_rate(self._ramp.level_pa, rate_pa_s)
        self._settle(self._ramp.level_pa, rate_pa_s)

    def _check_flow(self, sign: int) -> None:
        """Once per window: a valve that is open must move the pressure."""
        s = self.settings
        level = (
            self.estimate_pa
        )  # calmer than the ramp's level, and a window is long against its lag
        moved = sign * (level - self._window_pa)
        self._window_s, self._window_pa = self._timer_s, level
        if moved >= s.no_rise_pa:
            return
        if sign * (level - self._start_pa) < 2.0 * s.no_rise_pa:
            stuck = ValveCause.INLET_STUCK_CLOSED if sign > 0 else ValveCause.EXHAUST_STUCK_CLOSED
            self._fail(
                stuck,
                f"open for {self._timer_s:.2f} s, the pressure stays at {level / 1e3:.1f} kPa abs",
            )
            return
        # It moved and stopped short. With both closed the pressure tells an open opposite valve
        # from a lack of supply.
        self._suspect = ValveCause.SUPPLY_EMPTY if sign > 0 else ValveCause.INLET_STUCK_OPEN
        self._settle(level, 0.0)

    def _settle(self, closed_pa: float, rate_pa_s: float) -> None:
        self._closed_pa = closed_pa
        self._closed_rate_pa_s = rate_pa_s
        self._blocks.start()
        self._enter(ValveState.SETTLING)

    def _settling(self, pressure_pa: float) -> None:
        s = self.settings
        before_s = self._timer_s
        self._timer_s = now_s = before_s + self._dt_s
        if now_s < s.reaction_s:
            return
        if before_s < s.reaction_s:
            self._valve_has_closed()
        full = self._blocks.step(pressure_pa, self._dt_s)
        if self._open_valve():
            return
        if (
            full
            and now_s >= s.settle_s
            and (abs(self._blocks.change_pa) <= s.settle_pa or now_s > s.settle_timeout_s)
        ):
            self._heat.moved(self._blocks.mean_pa - self._closed_pa)
            self._trim.learn(self._blocks.mean_pa)
            self._correct(self._blocks.mean_pa)

    def _valve_has_closed(self) -> None:
        estimate = self.estimate_pa
        self._heat.flowed(self._rest_pa, estimate)
        if self._closed_rate_pa_s > 10e3:  # a longer flow; pulses close at rate 0
            trim = self._trim
            trim.response.learn_lead(
                trim.direction * (estimate - self._closed_pa), self._closed_rate_pa_s
            )
        self._closed_pa = estimate

    def _open_valve(self) -> bool:
        change = self.estimate_pa - self._closed_pa
        rate = self._blocks.rate_pa_s
        cause = open_valve(
            self.settings,
            self._heat,
            self._trim.direction,
            self._closed_pa,
            change,
            rate,
            self._timer_s,
        )
        if cause is ValveCause.NONE:
            return False
        word = "rose" if cause is ValveCause.INLET_STUCK_OPEN else "fell"
        self._fail(
            cause,
            f"{word} by {abs(change) / 1e3:.1f} kPa in {self._timer_s:.2f} s with both valves"
            " closed",
        )
        return True

    def _correct(self, mean_pa: float) -> None:
        """Do what a settled average asks for: hold, one pulse, a longer flow, or giving up."""
        trim = self._trim
        self._rest_pa = mean_pa
        error = self.target_pa - mean_pa
        if self._suspect is not ValveCause.NONE and abs(error) > self.settings.tolerance_pa:
            self._fail(
                self._suspect,
                f"the pressure stopped at {mean_pa / 1e3:.1f} kPa abs,"
                f" {error / 1e3:+.1f} kPa to go",
            )
            return
        step = trim.decide(mean_pa, self.target_pa, self._dt_s)
        if step is TrimStep.PULSE:
            self._start_pulse(trim.direction)
        elif step is TrimStep.FLOW:
            self._start_flow(mean_pa, trim.direction)
        elif step is TrimStep.FAIL:
            self._fail(trim.cause, trim.text)
        else:
            if step is TrimStep.ACCEPT:
                self.events.append(
                    ("accept", trim.text, {"error_pa": error, "pressure_pa": mean_pa})
                )
            self._hold_at(mean_pa)

    def _start_flow(self, mean_pa: float, sign: int) -> None:
        self._start_pa = self._window_pa = mean_pa
        self._ramp.start(mean_pa, self._dt_s)
        self._enter(ValveState.FILLING if sign > 0 else ValveState.EXHAUSTING)

    def _start_pulse(self, sign: int) -> None:
        self._trim.width_s = max(1, round(self._trim.width_s / self._dt_s)) * self._dt_s
        self._enter(ValveState.TRIMMING)
        self._inlet, self._exhaust = sign > 0, sign < 0

    def _trimming(self, pressure_pa: float) -> None:
        self._timer_s += self._dt_s
        trim = self._trim
        passed_pa = trim.direction * (self.estimate_pa - self.target_pa)
        if self._timer_s > trim.width_s - 0.5 * self._dt_s or passed_pa > self.settings.no_rise_pa:
            trim.width_s = self._timer_s
            self._settle(self.estimate_pa, 0.0)

    def _hold_at(self, mean_pa: float) -> None:
        self._watch.start(mean_pa)
        self._suspect = ValveCause.NONE
        self._enter(ValveState.HOLDING)

    def _holding(self, pressure_pa: float) -> None:
        watch = self._watch
        self._timer_s += self._dt_s
        if watch.step(pressure_pa):
            self._lost_in_hold()
            return
        error = watch.slow_pa - self.target_pa
        drift_pa = self._drift_pa
        if error > drift_pa or error < -drift_pa:
            self._drift(error)
        elif self.drifting and -0.5 * drift_pa < error < 0.5 * drift_pa:
            self.drifting = False

    def _lost_in_hold(self) -> None:
        slow = self._watch.slow_pa
        cause = (
            ValveCause.INLET_STUCK_OPEN if slow > self.target_pa else ValveCause.EXHAUST_STUCK_OPEN
        )
        self._fail(
            cause,
            f"went to {slow / 1e3:.1f} kPa abs from {self.target_pa / 1e3:.1f} kPa abs with both"
            " valves closed",
        )

    def _drift(self, error_pa: float) -> None:
        if not self.drifting:
            self.drifting = True
            text = f"drifted by {error_pa / 1e3:+.1f} kPa from {self.target_pa / 1e3:.1f} kPa abs"
            self.events.append(("drift", text, {"error_pa": error_pa}))
        slow = self._watch.slow_pa
        if slow >= 0.97 * self.settings.supply_pa and slow >= 1.1 * self.target_pa:
            self._lost_in_hold()  # too little room below the supply for the watch to see a gain
        elif self._may_retrim and not self._hold_only:
            self._trim.start()
            self._correct(slow)

    def _venting(self, pressure_pa: float) -> None:
        s = self.settings
        self._timer_s += self._dt_s
        gauge_pa = self.estimate_pa - s.atmosphere_pa
        if self._start_pa != self._start_pa:
            self._start_pa = self._window_pa = self.estimate_pa
        if gauge_pa <= s.vented_pa and self._timer_s >= s.reaction_s:
            self._enter(ValveState.VENTED)
        elif self._timer_s > s.fill_timeout_s:
            self._fail(
                ValveCause.TIME_OUT,
                f"venting for {self._timer_s:.1f} s, {gauge_pa / 1e3:.1f} kPa gauge left",
            )
        elif self._timer_s - self._window_s >= s.no_rise_after_s:
            self._check_vent(gauge_pa)

    def _check_vent(self, gauge_pa: float) -> None:
        s = self.settings
        fell_pa = self._window_pa - self.estimate_pa
        self._window_s, self._window_pa = self._timer_s, self.estimate_pa
        if fell_pa >= s.no_rise_pa or gauge_pa < 4.0 * s.no_rise_pa:
            return
        never = self._start_pa - self.estimate_pa < 2.0 * s.no_rise_pa
        cause = ValveCause.EXHAUST_STUCK_CLOSED if never else ValveCause.INLET_STUCK_OPEN
        self._fail(
            cause,
            f"venting for {self._timer_s:.2f} s, the pressure stays {gauge_pa / 1e3:.1f} kPa gauge",
        )

    def _vented(self, pressure_pa: float) -> None:
        gauge_pa = self.estimate_pa - self.settings.atmosphere_pa
        if gauge_pa > 15.0 * self.settings.no_rise_pa:
            self._fail(
                ValveCause.INLET_STUCK_OPEN, f"rose to {gauge_pa / 1e3:.1f} kPa gauge after venting"
            )

    # State changes

    def _clear(self) -> None:
        self.cause, self.cause_text, self.failure = ValveCause.NONE, "", None
        self._suspect = ValveCause.NONE
        self._trim.start()

    def _fail(self, cause: ValveCause, found: str) -> None:
        """Close both valves, or leave the exhaust open where the pressure must come down."""
        vent = cause in _VENT_ON or self.state in _OPENS_EXHAUST
        self.cause = cause
        self.cause_text = self.failure = f"{cause.value} while {self.state.value}: {found}"
        self.events.append(
            (
                "failed",
                self.cause_text,
                {"cause": cause.name.lower(), "pressure_pa": self.estimate_pa},
            )
        )
        self._enter(ValveState.FAILED)
        self._exhaust = vent

    def _enter(self, state: ValveState) -> None:
        if state is not self.state:
            text = f"{self.state.value} -> {state.value} at {self.estimate_pa / 1e3:.1f} kPa abs"
            data: dict[str, object] = {
                "state": state.value,
                "pressure_pa": self.estimate_pa,
                "target_pa": self.target_pa,
            }
            self.events.append(("state", text, data))
        self.state = state
        self.settled = state is ValveState.HOLDING or state is ValveState.VENTED
        self.drifting = False
        self._handler = self._handlers[state]
        self._timer_s = self._window_s = 0.0
        self._inlet = state is ValveState.FILLING
        self._exhaust = state in (ValveState.EXHAUSTING, ValveState.VENTING) or (
            state is ValveState.VENTED and self.settings.vented_open
        )

    def _count_switchings(self, pressure_pa: float) -> None:
        for valve, now, sent in (
            ("inlet", self._inlet, self._sent_inlet),
            ("exhaust", self._exhaust, self._sent_exhaust),
        ):
            if now is not sent:
                self.switchings += 1
                text = f"{valve} {'opened' if now else 'closed'}"
                self.events.append(
                    ("switch", text, {"valve": valve, "open": now, "pressure_pa": pressure_pa})
                )
        self._sent_inlet, self._sent_exhaust = self._inlet, self._exhaust

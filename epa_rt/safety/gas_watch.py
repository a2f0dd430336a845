"""A muscle's pressure against its valves: what must rise, what must stay, what slows near the
supply.
"""

import math

from epa_rt.config.rig import Muscle, Rig
from epa_rt.safety.muscle_law import MuscleGeometry, geometry_of

CAUSE = "implausible sensor"
FULL_SHARE = 0.8  # of the supply: above it an open inlet has little left to raise
CHOKED_SHARE = 0.45  # of the supply: below it the flow into a muscle does not depend on it
NEAR_SHARE = 0.92  # of the supply: above it the flow is too small to be judged
CRITICAL_RATIO = 0.3  # of a small solenoid valve, ISO 6358
UNKNOWN_VOLUME = 1.5  # without the muscle's law its motion looks like gas that comes and goes
JUMP_FLOOR_PA = 5e3  # four steps of a 12-bit converter: noise is no jump
STEP_PA = 20e3  # what heat and motion do to a low pressure
FORGET_S, SLOW_S, WINDOW_S = 3.0, 0.5, 0.05

Refusal = tuple[str, str, str]  # cause, signal, sentence


class GasWatch:
    """``step`` once per ``dt_s`` with the last outputs; a refusal, or None. Where the time of a
    reading is known, ``read_at`` comes before it.

    Judged is the gas, which is pressure times what the volume makes of it: motion alone changes
    nothing. What needs time to rise or to settle is given ``dt_s`` a step at least; what changes is
    held against the time that went by.
    """

    def __init__(self, muscle: Muscle, rig: Rig, dt_s: float):
        sensors = rig.safety.sensors
        self.pressure, self._inlet, self._exhaust = muscle.pressure, muscle.inlet, muscle.exhaust
        self._geometry = geometry_of(muscle, rig)
        self._dt_s, self._apart_s, self._dead_s = dt_s, dt_s, sensors.valve_dead_time
        self._rise_pa = sensors.fill_rate_min * sensors.valve_dead_time
        self._sealed = sensors.sealed * (1.0 if muscle.law else UNKNOWN_VOLUME)
        self._slows, self._travel = sensors.fill_slows, rig.motor.position
        self._supply_pa = muscle.valves.supply or math.inf
        self._supply_text = (
            f"or the supply below {self._supply_pa / 1e3:.0f} kPa abs"
            if muscle.valves.supply
            else ""
        )
        self._keep, self._follow = 1.0 - dt_s / FORGET_S, dt_s / SLOW_S
        self._rate_max_pa_s = sensors.pressure_rate_max
        self._jump_pa = self._rate_max_pa_s * dt_s + JUMP_FLOOR_PA
        self._last_pa, self._read_ns = math.nan, 0
        self._low_pa = self._slow_pa = self._window_pa = self._read_pa = 0.0
        self._open_s = self._flow_s = self._vent_s = self._shut_s = self._window_s = 0.0
        self._peak_pa_s, self._slow_windows = 0.0, 0

    def read_at(self, now_ns: int) -> None:
        """When the next pressure was read: a machine or a bus that paused, or that is late again
        and again, gives the gas more time than ``dt_s``. Without a clock it is that; before the
        first reading there is nothing to hold it against.
        """
        if self._read_ns < now_ns:
            self._apart_s = (now_ns - self._read_ns) / 1e9
            self._jump_pa = self._rate_max_pa_s * self._apart_s + JUMP_FLOOR_PA
        self._read_ns = now_ns

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes the pressure that came while ``outputs`` were out."""
        read_pa = measured[self.pressure]
        gas_pa = read_pa
        if self._geometry is not None:
            gas_pa *= self._geometry.volume_ratio(self._geometry.length(measured))
        change, self._last_pa = gas_pa - self._last_pa, gas_pa
        if abs(change) > self._jump_pa:
            return self._refused(
                f"jumps by {change / 1e3:+.1f} kPa within {1e3 * self._apart_s:.0f} ms",
                "the pressure sensor and its wire, the muscle (burst, hose off)",
            )
        if outputs[self._inlet]:
            self._shut_s = self._vent_s = 0.0
            return self._filling(read_pa, gas_pa)
        self._flow_s = 0.0
        self._open_s *= self._keep
        if gas_pa < self._low_pa:
            self._low_pa = gas_pa
        if outputs[self._exhaust]:
            self._shut_s = 0.0
            return self._venting(gas_pa)
        self._vent_s = 0.0
        return self._shut_in(read_pa, gas_pa)

    def _filling(self, read_pa: float, gas_pa: float) -> Refusal | None:
        if read_pa > FULL_SHARE * self._supply_pa:
            self._open_s = 0.0
        else:
            if self._open_s < self._dt_s or gas_pa < self._low_pa:
                self._low_pa = gas_pa
            self._open_s += self._dt_s
            if self._open_s >= 2.0 * self._dead_s:
                if gas_pa - self._low_pa < self._rise_pa:
                    return self._refused(
                        f"stays at {read_pa / 1e3:.1f} kPa abs while {self._inlet} is open",
                        "the pressure sensor (frozen, its hose), the inlet (stuck, exchanged with"
                        " the exhaust), the supply",
                    )
                self._open_s, self._low_pa = self._dt_s, gas_pa
        return self._slowing(read_pa, gas_pa)

    def _slowing(self, read_pa: float, gas_pa: float) -> Refusal | None:
        """The flow falls as the true pressure nears the supply; what is read says how far."""
        self._flow_s += self._dt_s
        if self._flow_s < self._dead_s:
            self._window_s, self._window_pa, self._slow_windows = 0.0, gas_pa, 0
            self._read_pa = read_pa
            return None
        self._window_s += self._apart_s
        if self._window_s < WINDOW_S:
            return None
        rate = (gas_pa - self._window_pa) / self._window_s
        share = 0.5 * (read_pa + self._read_pa) / self._supply_pa
        self._window_s, self._window_pa, self._read_pa = 0.0, gas_pa, read_pa
        if share < CHOKED_SHARE:
            self._peak_pa_s = max(self._peak_pa_s, rate)
            return None
        expected = self._slows * self._peak_pa_s * flow_share(share)
        self._slow_windows = self._slow_windows + 1 if rate < expected else 0
        if self._slow_windows < 2 or share > NEAR_SHARE:
            return None
        return self._refused(
            f"reads {read_pa / 1e3:.0f} kPa abs, but fills as slowly as one near the supply does"
            f" ({rate / 1e3:.0f} kPa/s)",
            f"the pressure sensor (reads low, its calibration), {self._supply_text}",
        )

    def _venting(self, gas_pa: float) -> Refusal | None:
        self._vent_s += self._dt_s
        if self._vent_s < self._dead_s or gas_pa < self._slow_pa:
            self._slow_pa = gas_pa
        if gas_pa - self._slow_pa > STEP_PA:
            return self._refused(
                f"rises to {gas_pa / 1e3:.1f} kPa abs while {self._exhaust} is open",
                "the valves (inlet and exhaust exchanged, inlet stuck open)",
            )
        return None

    def _shut_in(self, read_pa: float, gas_pa: float) -> Refusal | None:
        self._shut_s += self._dt_s
        if self._shut_s < 1.5 * self._dead_s:
            self._slow_pa = gas_pa
            return None
        change = gas_pa - self._slow_pa
        self._slow_pa += self._follow * change
        if abs(change) <= max(self._sealed * self._slow_pa, STEP_PA):
            return None
        if change > 0.0:
            return self._refused(
                f"rises to {read_pa / 1e3:.1f} kPa abs with both valves shut",
                f"the inlet (leaks, stuck open), {self.pressure}, {self._travel} (its"
                " calibration: does it move further than it reads?)",
            )
        return self._refused(
            f"falls to {read_pa / 1e3:.1f} kPa abs with both valves shut",
            f"the muscle (burst, hose off), the exhaust, the pressure sensor at {self.pressure}",
        )

    def _refused(self, found: str, suspects: str) -> Refusal:
        return CAUSE, self.pressure, f"{self.pressure} {found}; check {suspects}"


def flow_share(share: float) -> float:
    """Flow through a valve over its choked flow, for a pressure behind it as a share of that
    before it (ISO 6358).
    """
    beyond = (share - CRITICAL_RATIO) / (1.0 - CRITICAL_RATIO)
    return math.sqrt(1.0 - beyond * beyond) if 0.0 < beyond < 1.0 else float(beyond <= 0.0)


class ExchangeWatch:
    """Two muscles whose hoses, valves or pressure wires may be exchanged: one is filled, the
    other's pressure rises.
    """

    REST_S = 0.05  # until then what was shut before still settles
    RISE_PA = 10e3  # eight steps of a 12-bit converter
    SHARE = 0.3  # of the other's rise: a muscle that is filled rises by more

    def __init__(self, muscles: tuple[Muscle, ...], dt_s: float):
        self._muscles, self._dt_s = muscles, dt_s
        self._filled, self._since_s = -1, 0.0
        self._start_pa = (0.0, 0.0)

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """A refusal once the wrong one rises."""
        first, second = self._muscles
        one, two = outputs[first.inlet], outputs[second.inlet]
        now_pa = measured[first.pressure], measured[second.pressure]
        filled = -1 if one == two else (0 if one else 1)
        if filled != self._filled:
            self._filled, self._since_s = filled, 0.0
        self._since_s += self._dt_s
        if filled < 0:
            return None
        if self._since_s <= self.REST_S:
            self._start_pa = now_pa
            return None
        rise = now_pa[1 - filled] - self._start_pa[1 - filled]
        if rise < self.RISE_PA or now_pa[filled] - self._start_pa[filled] >= self.SHARE * rise:
            return None
        own, other = self._muscles[filled], self._muscles[1 - filled]
        return (
            CAUSE,
            own.pressure,
            f"{other.pressure} rises by {rise / 1e3:.1f} kPa while only {own.inlet} is open, and"
            f" {own.pressure} does not; check the hoses, valves and pressure wires of {own.name}"
            f" and {other.name} (exchanged)",
        )


class VolumeWatch:
    """Gas shut in follows the muscle's volume: where the muscle is stretched its pressure rises.

    Compared over the last seconds, each against its own slow average: the slope of pressure over
    what the volume makes of it. About 1 for sound sensors; 0 for a frozen one; another muscle's
    pressure, or a travel that moves further than it reads, give others.
    """

    SLOW_S, FORGET_S, REST_S = 1.0, 5.0, 0.5
    OUT_S = 0.4  # a valve that leaks has shown itself by then
    ENOUGH_S = 2e-5  # of squared relative change over time: 0.45 % for a second
    ENOUGH_HIGH_S = 6e-5  # where a small motion meets gas that cools, the slope is large
    FROZEN = 0.04  # of the squared change that volume makes: less is a reading that does not move
    ALIKE = 0.8  # squared correlation; below it heat or a leak moves the pressure, not the motion

    def __init__(self, muscle: Muscle, geometry: MuscleGeometry, rig: Rig, dt_s: float):
        sensors = rig.safety.sensors
        self.pressure, self._inlet, self._exhaust = muscle.pressure, muscle.inlet, muscle.exhaust
        self._geometry = geometry
        self._way = rig.motor.position + (f" and {rig.joint.position}" if rig.joint else "")
        self._hoses = ", the hoses (exchanged)" if len(rig.muscles) > 1 else ""
        self._low, self._high = sensors.volume_slope
        self._dt_s, self._follow, self._keep = dt_s, dt_s / self.SLOW_S, 1.0 - dt_s / self.FORGET_S
        self._shut_s = self._squares = self._products = self._found = 0.0
        self._out_s, self._slow_pa, self._slow_ratio = 0.0, 1.0, 1.0

    def step(self, measured: dict[str, float], outputs: dict[str, float]) -> Refusal | None:
        """Takes one sample."""
        read_pa = measured[self.pressure]
        ratio = 1.0 / self._geometry.volume_ratio(self._geometry.length(measured))
        if outputs[self._inlet] or outputs[self._exhaust]:
            self._shut_s = self._squares = self._products = self._found = 0.0
        self._shut_s += self._dt_s
        if self._shut_s < self.REST_S:
            self._slow_pa, self._slow_ratio = read_pa, ratio
            return None
        self._slow_pa += self._follow * (read_pa - self._slow_pa)
        self._slow_ratio += self._follow * (ratio - self._slow_ratio)
        expected = ratio / self._slow_ratio - 1.0
        self._squares = self._keep * self._squares + self._dt_s * expected * expected
        found = read_pa / self._slow_pa - 1.0
        self._products = self._keep * self._products + self._dt_s * expected * found
        self._found = self._keep * self._found + self._dt_s * found * found
        if (
            self._squares < self.ENOUGH_S
            or self._low * self._squares <= self._products <= self._high * self._squares
            or (abs(self._products) > self._squares < self.ENOUGH_HIGH_S)
        ):
            self._out_s = 0.0
            return None
        explained, whole = self._products * self._products, self._squares * self._found
        if self._found > self.FROZEN * self._squares and explained < self.ALIKE * whole:
            self._out_s = 0.0
            return None
        self._out_s += self._dt_s
        if self._out_s < self.OUT_S:
            return None
        slope = self._products / self._squares
        suspects = (
            f"{self._way} (calibration: does it move further than it reads?)"
            if slope > self._high
            else f"{self.pressure} (frozen), {self._way} (zero, sign)"
        )
        return (
            CAUSE,
            self.pressure,
            f"{self.pressure} follows the muscle's volume by {slope:.2f} of what it should; check"
            f" {suspects}{self._hoses}",
        )

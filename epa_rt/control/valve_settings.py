"""Settings, states and failure causes of the valve set-and-hold."""

from dataclasses import dataclass, fields
from enum import Enum


class ValveState(Enum):
    """What the pair of valves is doing, in an operator's words."""

    CLOSED = "closed"
    FILLING = "filling"
    EXHAUSTING = "exhausting"
    SETTLING = "settling"
    TRIMMING = "trimming"
    HOLDING = "holding"
    VENTING = "venting"
    VENTED = "vented"
    FAILED = "failed"


class ValveCause(Enum):
    """Why a set-and-hold failed."""

    NONE = "no failure"
    TIME_OUT = "time-out"
    OVER_PRESSURE = "over-pressure"
    INLET_STUCK_CLOSED = "inlet stuck closed or no supply"
    INLET_STUCK_OPEN = "inlet stuck open"
    EXHAUST_STUCK_CLOSED = "exhaust stuck closed"
    EXHAUST_STUCK_OPEN = "exhaust stuck open or leak"
    SUPPLY_EMPTY = "supply empty"
    BAD_PRESSURE = "pressure not a number"


@dataclass(frozen=True, slots=True)
class ValveSettings:
    """Tolerances, times and bounds of one muscle's valves; pressures are absolute Pa. ValueError if
    out of order.
    """

    tolerance_pa: float = 800.0  # of the average, when a trim ends
    settle_s: float = 0.6  # least time with both valves closed before the average counts
    settle_pa: float = 500.0  # largest change of the average across three averages
    settle_timeout_s: float = 8.0  # judged after this long even if the pressure still creeps
    average_s: float = 0.25  # one average
    reaction_s: float = 0.1  # a valve has done what it was told after this long
    estimate_s: float = 0.02  # filter of estimate_pa
    fill_timeout_s: float = 30.0  # filling, exhausting or venting without a break
    pulse_min_s: float = 0.001
    pulse_max_s: float = 0.06  # an error that needs more is filled or exhausted instead
    max_pulses: int = 30  # valve openings per set
    lead_s: float = 0.02  # flow goes on this long after closing; corrected from what is seen
    response_pa_s: float = 800e3  # fastest pressure change to expect; corrected from what is seen
    drift_pa: float = 3000.0  # of the slow average from the target
    hold_average_s: float = 2.0  # the slow average
    hold_reference_s: float = (
        60.0  # what the slow average is compared with, to tell a dump from a drift
    )
    hold_lost_ratio: float = (
        0.35  # share of the pressure lost or gained against that reference: a valve is open
    )
    no_rise_pa: float = 3000.0  # less change than this with a valve open ...
    no_rise_after_s: float = 0.8  # ... for this long is no flow
    climb_pa: float = 20e3  # change with both closed that heat cannot explain
    # share of the pressure that heat can explain: 1 - 1/gamma = 0.29, and the lag of what is read
    relax_ratio: float = 0.35
    relax_s: float = 5.0  # after this long a rate above leak_pa_s has died down, or is slow heat
    heat_s: float = 20.0  # the slowest that walls bring gas back to their temperature
    leak_pa_s: float = 5000.0
    vented_pa: float = 3000.0  # above atmosphere
    vented_open: bool = True  # the exhaust stays open once vented
    over_pressure_pa: float = 950e3
    # the regulator's: shape of the inlet's flow (learned responses correct it), and where an inlet
    # stuck open is told in hold
    supply_pa: float = 900e3
    atmosphere_pa: float = 101325.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name != "vented_open" and not 0.0 < value < 1e12:
                raise ValueError(f"{field.name}: found {value}, expected above zero and finite")
        self._ordered("pulse_min_s", "pulse_max_s")
        self._ordered("atmosphere_pa", "over_pressure_pa")
        self._ordered("atmosphere_pa", "supply_pa")
        self._ordered("settle_s", "settle_timeout_s")
        if (
            not self.drift_pa >= 3.0 * self.tolerance_pa
        ):  # else what a trim accepts would at once count as drift
            least_pa = 3.0 * self.tolerance_pa
            raise ValueError(
                f"drift_pa: found {self.drift_pa}, expected at least 3 x tolerance_pa = {least_pa}"
            )

    def _ordered(self, small: str, large: str) -> None:
        if not getattr(self, small) < getattr(self, large):
            raise ValueError(
                f"{small}: found {getattr(self, small)}, expected below {large} ="
                f" {getattr(self, large)}"
            )

"""Which valve is open although both were told to close."""

from epa_rt.control.valve_heat import HeatAccount
from epa_rt.control.valve_settings import ValveCause, ValveSettings


def open_valve(
    s: ValveSettings,
    heat: HeatAccount,
    direction: int,
    closed_pa: float,
    change_pa: float,
    rate_pa_s: float,
    elapsed_s: float,
) -> ValveCause:
    """Cause behind a change since closing that heat cannot explain, or NONE. Pa, Pa/s, s.

    `direction` is the flow before: after filling (+1) the gas cools and its pressure falls, after
    exhausting (-1) it rises, and by a bounded share of itself. `heat` holds what earlier flows
    left. A rate may be NaN: no judgement yet.
    """
    heat_pa = s.relax_ratio * closed_pa
    rise_pa = heat_pa * 2.0 if direction < 0 else s.climb_pa + heat.cool_pa
    fall_pa = heat_pa if direction > 0 else s.climb_pa + heat.warm_pa
    # Near atmosphere a full loss is less than the share of heat: there three quarters of the gauge
    # pressure say it, where gas that was warm before does not.
    gauge_pa = closed_pa - s.atmosphere_pa
    # Heat dies down to less than half its mean rate, or is slow by what is left of it; a leak is
    # neither.
    lasting = elapsed_s > s.relax_s and abs(rate_pa_s) * elapsed_s >= 0.5 * abs(change_pa)
    if change_pa > rise_pa or (lasting and rate_pa_s > max(s.leak_pa_s, heat.rise_pa_s(elapsed_s))):
        return ValveCause.INLET_STUCK_OPEN
    if (
        change_pa < -fall_pa
        or change_pa < -max(0.75 * gauge_pa, heat.warm_pa) < -7500.0
        or (lasting and rate_pa_s < -max(s.leak_pa_s, heat.fall_pa_s(elapsed_s)))
    ):
        return ValveCause.EXHAUST_STUCK_OPEN
    return ValveCause.NONE

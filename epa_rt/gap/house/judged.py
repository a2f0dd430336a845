"""Which samples of a link are judged: by the recording and the nominal plant alone, never by the values tried."""

import numpy as np

from epa_rt.gap.house import smooth
from epa_rt.gap.house.commands import AGE
from epa_rt.gap.house.prepared import START_S, Prepared
from epa_rt.models.blocks.load import KNEE, MASS

NEEDS = {
    "drive": ("motor_angle_rad", "motor_speed_rad_s", "motor_current_a"), "torque": ("motor_current_a", "motor_torque_nm", "motor_angle_rad", "motor_speed_rad_s", "force_n"),
    "motor": ("motor_angle_rad", "motor_speed_rad_s", "motor_current_a", "force_n"), "encoder": ("motor_angle_rad", "motor_speed_rad_s"),
    "gas0": ("muscle0_gauge_pa", "motor_angle_rad"), "gas1": ("muscle1_gauge_pa",),
    "muscle0": ("force_n", "muscle0_gauge_pa", "motor_angle_rad"), "load": ("muscle0_gauge_pa", "motor_angle_rad"),
}
ENABLED_S = 0.1        # after the drive came on
LOAD_S = 0.4           # after what a load's link may not be judged by: its low-pass remembers (residuals.LOAD_HZ)
STOP_MARGIN = {KNEE: 0.03, MASS: 1.5e-3}  # rad, m: nearer to an end stop its unknown contact counts


def judged(prepared: Prepared, params: np.ndarray, link: str) -> np.ndarray:
    """(n,) bool at the residuals' rate."""
    period = prepared.period_s
    bad = np.zeros(prepared.count, bool)
    needs = NEEDS[link] + tuple(port for port in ("joint_angle_rad", "load_position_m") if link[:3] in ("gas", "mus", "loa"))
    for port in needs:
        if port in prepared.bad:
            bad |= prepared.bad[port]
    if link == "load":
        if params["muscle"]["present"][0, 1] > 0.5:
            bad |= prepared.bad.get("muscle1_gauge_pa", False)
        bad |= _near_stop(prepared, params)
        bad |= _after(bad, round(LOAD_S / period))
    if link in ("drive", "motor", "torque"):
        off = prepared.commands["enabled"] < 0.5
        bad |= off | _after(off, round(ENABLED_S / period))
    if link in ("drive", "motor", "torque", "encoder"):
        bad |= prepared.standing
    edge = np.zeros(prepared.count, bool)
    edge[:round(START_S / period)] = True
    edge[-smooth.HALF - AGE:] = True
    return ~(smooth.any_near(bad) | edge[::smooth.EVERY])


def _after(flags: np.ndarray, cycles: int) -> np.ndarray:
    """True for some cycles after each True."""
    total = np.concatenate([[0], np.cumsum(flags)])
    k = np.arange(len(flags)) + 1
    return total[k] > total[np.maximum(k - cycles, 0)]


def _near_stop(prepared: Prepared, params: np.ndarray) -> np.ndarray:
    load = params["load"][0]
    unit = "rad" if load["kind_code"] == KNEE else "m"
    margin = STOP_MARGIN[float(load["kind_code"])]
    place = prepared.smooth["place"]
    return (place < load[f"low_{unit}"] + margin) | (place > load[f"high_{unit}"] - margin)

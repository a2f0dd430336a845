"""Which samples of a link are judged: by the recording and the nominal plant alone, never by the
values tried.
"""

import numpy as np

from epa_rt.gap.rig.house import smooth
from epa_rt.gap.rig.house.prepared import BRIDGED, START_S, Prepared
from epa_rt.logs.layout import ANSWERED_AFTER
from epa_rt.models.blocks.load import KNEE, MASS

NEEDS = {
    "drive": ("motor_angle_rad", "motor_speed_rad_s", "motor_current_a"),
    "torque": (
        "motor_current_a",
        "motor_torque_nm",
        "motor_angle_rad",
        "motor_speed_rad_s",
        "force_n",
    ),
    "motor": ("motor_angle_rad", "motor_speed_rad_s", "motor_current_a", "force_n"),
    "encoder": ("motor_angle_rad", "motor_speed_rad_s"),
    "gas0": ("muscle0_gauge_pa", "motor_angle_rad"),
    "gas1": ("muscle1_gauge_pa",),
    "muscle0": ("force_n", "muscle0_gauge_pa", "motor_angle_rad"),
    "load": ("muscle0_gauge_pa", "motor_angle_rad"),
}
ENABLED_S = 0.1  # after the drive came on
LOAD_S = (
    0.4  # after what a load's link may not be judged by: its low-pass remembers (residuals.LOAD_HZ)
)
# cycles about a long gap over which the filters on motion and pressures carry what was made up for
# it
REACH = 70
STOP_MARGIN = {KNEE: 0.03, MASS: 1.5e-3}  # rad, m: nearer to an end stop its unknown contact counts


def judged(prepared: Prepared, params: np.ndarray, link: str) -> np.ndarray:
    """(n,) bool at the residuals' rate."""
    period, none = prepared.period_s, np.zeros(prepared.count, bool)
    needs = NEEDS[link] + tuple(
        port for port in ("joint_angle_rad", "load_position_m") if link[:3] in ("gas", "mus", "loa")
    )
    if link == "load" and params["muscle"]["present"][0, 1] > 0.5:
        needs += ("muscle1_gauge_pa",)
    gaps = [prepared.bad[port] for port in needs if port in prepared.bad]
    bad = np.logical_or.reduce([none, *gaps])
    through = [
        *gaps,
        *([prepared.bad.get("motor_speed_rad_s", none)] if "motor_angle_rad" in needs else []),
    ]  # of which the angle is made between its counts
    long = np.logical_or.reduce([none, *(smooth.long_runs(gap, BRIDGED) for gap in through)])
    if link == "load":
        bad |= smooth.any_before(_near_stop(prepared, params), round(LOAD_S / period))
        long = smooth.any_before(long, round(LOAD_S / period))
    if link in ("drive", "motor", "torque"):
        bad |= smooth.any_before(prepared.commands["enabled"] < 0.5, round(ENABLED_S / period))
    if link in ("drive", "motor", "torque", "encoder"):
        bad |= prepared.standing
    if link == "drive":
        bad |= prepared.led
    edge = none.copy()
    edge[: round(START_S / period)] = True
    edge[-smooth.HALF - ANSWERED_AFTER :] = True
    return ~(smooth.any_near(bad) | smooth.any_near(long, REACH) | edge[:: smooth.EVERY])


def _near_stop(prepared: Prepared, params: np.ndarray) -> np.ndarray:
    load = params["load"][0]
    unit = "rad" if load["kind_code"] == KNEE else "m"
    margin = STOP_MARGIN[float(load["kind_code"])]
    place = prepared.smooth["place"]
    return (place < load[f"low_{unit}"] + margin) | (place > load[f"high_{unit}"] - margin)

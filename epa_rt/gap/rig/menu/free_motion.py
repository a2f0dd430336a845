"""What any rig can run next: the motor alone."""

from epa_rt.config.rig import Rig
from epa_rt.gap.rig.menu.text import Item, item, move, trial

FREE_PARTS = (0.3, 0.9)  # of the motor's greatest speed and acceleration
REST_S = 0.05  # shortest dwell, in which no stroke may cover the range


def free_motions(rig: Rig, low_mm: float, high_mm: float) -> list[Item]:
    """The motor alone between two places (mm from no load, on the slack side), slowly and near its
    limits: what is late by microseconds shows where it is fast and nothing pulls.

    None where the motor's limits leave no slack.
    """
    limits = (
        rig.row(rig.motor.position_target).limits if rig.motor.position_target else None
    )  # an analog drive takes a speed
    no_load_mm = 1e3 * rig.motor.places.get("no_load", 0.0)
    low, high = (f"{round(no_load_mm + place, 1):g} mm" for place in (low_mm, high_mm))
    if limits is not None and 1e-3 * (no_load_mm + low_mm) < limits[0]:
        return []
    items = []
    for part in FREE_PARTS:
        mm_s = min(1e3 * part * rig.motor.speed_max, 0.9 * (high_mm - low_mm) / REST_S)
        speed, acceleration = (
            f"{round(mm_s, 1):g} mm/s",
            f"{round(part * rig.motor.acceleration_max, 2):g} m/s^2",
        )
        items.append(
            item(
                "free_motion",
                {"pressure": "0 kPa gauge", "speed": speed, "acceleration": acceleration},
                "motor_speed",
                [move("go_to_no_load", "no_load")],
                [
                    trial(
                        f"random_speed: {{between: [{low}, {high}], speed: {speed}, acceleration:"
                        f" {acceleration}, dwell: [{1e3 * REST_S:g} ms, 500 ms]}}\n    for: 20 s"
                    )
                ],
                "the strap hangs slack: the motor alone",
            )
        )
    return items

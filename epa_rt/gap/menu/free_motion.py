"""What any rig can run next: the motor alone."""

from epa_rt.config.rig import Rig
from epa_rt.gap.menu.text import Item, item, move, trial

FREE_PARTS = (0.3, 0.9)        # of the motor's greatest speed and acceleration


def free_motions(rig: Rig, low: str, high: str) -> list[Item]:
    """The motor alone, slowly and near its limits: what is late by microseconds shows where it is fast and nothing pulls."""
    items = []
    for part in FREE_PARTS:
        speed, acceleration = f"{round(1e3 * part * rig.motor.speed_max, 1):g} mm/s", f"{round(part * rig.motor.acceleration_max, 2):g} m/s^2"
        items.append(item("free_motion", {"pressure": "0 kPa gauge", "speed": speed, "acceleration": acceleration}, "motor_speed", [move("go_to_no_load", "no_load")],
                           [trial(f"random_speed: {{between: [{low}, {high}], speed: {speed}, acceleration: {acceleration}, dwell: [50 ms, 500 ms]}}\n    for: 20 s")],
                           "the strap hangs slack: the motor alone"))
    return items

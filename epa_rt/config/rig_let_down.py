"""What the motor's rest place and the speed toward it must fulfil."""

from typing import TYPE_CHECKING

from epa_rt.config.source import Located
from epa_rt.config.units import readable, readable_range

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig


def check_let_down(rig: "Rig", located: Located) -> None:
    """Raises ConfigError where ``rest_place`` is no place, or ``let_down_speed`` is too fast.

    A place itself lies within the limits of travel; ``check_rig`` sees to that before.
    """
    motor, position = rig.motor, rig.row(rig.motor.position)
    if motor.rest_place is not None and motor.rest_place not in motor.places:
        known = ", ".join(motor.places) or "a name in motor.places, which has none"
        raise located.error(("motor", "rest_place"), f"'{motor.rest_place}'", known)
    if motor.rest_place is not None and motor.position_target is not None:
        place = motor.places[motor.rest_place]
        limits, unit = rig.row(motor.position_target).limits or (place, place), position.si_unit
        if not limits[0] <= place <= limits[1]:
            raise located.error(
                ("motor", "rest_place"),
                f"'{motor.rest_place}' at {readable(place, unit)}",
                f"a place within {readable_range(limits, unit)}, the limits of"
                f" {motor.position_target}",
            )
    if motor.let_down_speed is not None and motor.let_down_speed > motor.speed_max:
        raise located.error(
            ("motor", "let_down_speed"),
            readable(motor.let_down_speed, f"{position.si_unit}/s"),
            f"at most speed_max, {readable(motor.speed_max, f'{position.si_unit}/s')}",
        )

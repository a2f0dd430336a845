"""Which rows the bands for sensors and the muscles' laws use."""

from typing import TYPE_CHECKING

from epa_rt.config.source import Location

if TYPE_CHECKING:
    from epa_rt.config.rig import Rig

Use = tuple[Location, str | None, bool, str]  # where, row, whether a command, its unit


def sensor_uses(rig: "Rig") -> list[Use]:
    """What must be there, and in which unit."""
    sensors = rig.safety.sensors
    where = ("safety", "sensors")
    uses: list[Use] = [((*where, "supply"), sensors.supply, False, "Pa")]
    uses += [
        ((*where, "flicker", i), name, False, "Pa or N or A or m or rad")
        for i, name in enumerate(sensors.flicker)
    ]
    uses += [
        (("muscles", i, "law", "force"), muscle.law.force, False, "N")
        for i, muscle in enumerate(rig.muscles)
        if muscle.law is not None
    ]
    return uses

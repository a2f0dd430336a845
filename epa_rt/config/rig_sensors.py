"""What a rig file says of its sensors: a muscle's own law, bands at rest and in motion. Each band
has a unit and a reason.
"""

from typing import Annotated, Any

from pydantic import Field, field_validator

from epa_rt.config.fields import Frozen, Name, PressureDifference, Ratio, Seconds, quantity, written
from epa_rt.config.units import UnitError, parse_quantity

RowName = Name


def _per_joint(value: Any) -> float:
    """Lengthening per joint travel: m/rad of an angle, without unit of a position."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    try:
        return parse_quantity(value, "m/rad")
    except UnitError:
        return parse_quantity(value, "1")


class MuscleLaw(Frozen):
    """A McKibben muscle as built: F = P (3 L^2 - b^2)/(4 pi n^2), P gauge (paper, eq. 1).

    L = ``rest_length`` + ``per_travel`` x motor travel + ``per_joint`` x joint position. ``force``
    is the row that reads this muscle's pull. What follows says how far a sound muscle may be from
    its law: upper ends of what muscles of this kind show (docs/plant.md).
    """

    braid_length: quantity("m", 1e-3, 10.0)
    braid_turns: quantity("1", 0.1, 100.0)
    rest_length: quantity("m", 1e-3, 10.0)
    per_travel: quantity("1", -10.0, 10.0) = 1.0
    per_joint: Annotated[float, written("m/rad, or 1 where the joint moves straight")] = 0.0
    force: RowName | None = None
    # the braid's dry friction, of the pull at the stretched length: 10 % is the most that is built
    friction: Ratio = 0.10
    # what the rubber keeps of the pressure before the braid pulls
    threshold: PressureDifference = 80e3
    # what the rubber pulls by itself per stretch
    rubber: quantity("N/m", 0.0, 1e5) = 600.0
    # how exactly the length is known: fittings, strap, zero of travel
    length_band: quantity("m", 0.0, 0.1) = 0.002
    # what the strap gives under pull: 30 N/mm is the softest that is built
    strap: quantity("m/N", 0.0, 1e-2) = 3.3e-5
    # the load cell's noise, its gain and the muscle's viscous part at the rig's speeds
    force_band: quantity("N", 0.0, 1e4) = 8.0
    # from this length on the braid may lock and pull what it likes; not given: it does not lock
    lock_length: quantity("m", 1e-3, 10.0) | None = None
    # from this length on it is locked for certain, and pulls 20 N/mm at least, vented too
    locked_length: quantity("m", 1e-3, 10.0) | None = None

    _parse_per_joint = field_validator("per_joint", mode="before")(_per_joint)


class JointRest(Frozen):
    """Where the joint lies while every muscle is vented: on its stop, or hanging."""

    at: Annotated[float, written("m or rad, as the joint's position")]
    band: Annotated[float, written("m or rad, as the joint's position")]

    @field_validator("at", "band", mode="before")
    @classmethod
    def _on_axis(cls, value: Any) -> float:
        try:
            return parse_quantity(value, "rad")
        except UnitError:
            return parse_quantity(value, "m")


class Sensors(Frozen):
    """Bands for sensors at rest and in motion. ``trip`` bands end a run, ``hint`` bands advise to
    calibrate.
    """

    # a vented muscle: PSE530 is good for 2 % of 1 MPa over temperature less its 1 % at room, 12 bit
    # at 10 V are 1.2 kPa a step; 8 kPa is beyond both
    vented: PressureDifference = 8e3
    # the data sheet's repeatability and one step of the converter, together
    vented_hint: PressureDifference = 3e3
    # an unloaded cell, of its row's upper limit: 4 % is beyond drift and overload of a sound cell
    unloaded: Ratio = 0.04
    unloaded_hint: Ratio = 0.01
    # no power: the drive's own reading errs by tens of mA
    current_zero: quantity("A", 0.0, 10.0) = 0.10
    current_zero_hint: quantity("A", 0.0, 10.0) = 0.03
    joint_rest: JointRest | None = None
    # analog rows whose noise is larger than a step of their converter: they must not stand still
    flicker: Annotated[tuple[RowName, ...], Field(max_length=32)] = ()
    # row of the supply's pressure, and how far it may be from `valves: {supply: ...}`
    supply: RowName | None = None
    supply_band: Ratio = 0.10
    # the longest that bring-up waits for muscles that still vent
    wait: Seconds = 5.0
    # an open inlet raises the pressure by at least this: a tenth of what valve and muscle give
    fill_rate_min: quantity("Pa/s", 1e2, 1e8) = 50e3
    # until then nothing is asked: dead time of a slow valve, the tube's and the filter's lag
    valve_dead_time: quantity("s", 1e-3, 1.0) = 0.10
    # gas shut in, reckoned by its volume: heat explains less within half a second
    sealed: quantity("1", 0.01, 1.0) = 0.15
    # pressure over volume, of what the geometry says: dead volume makes it 0.6, fast compression
    # 1.4, a length that is 2 mm off a third more or less of either
    volume_slope: Annotated[tuple[float, float], Field(description="least and most")] = (0.25, 2.3)
    # no valve of this size and no motion changes a pressure faster; a jump of the reading does
    pressure_rate_max: quantity("Pa/s", 1e4, 1e9) = 2.5e6
    # a fill slows towards the supply; slower than this share of what the reading explains: the
    # reading is low. Heat and the droop of the regulator explain 0.77
    fill_slows: quantity("1", 0.0, 1.0) = 0.70
    # a fill at rest: the load cell's averaged noise, its drift since the muscle was vented
    fill_band: quantity("N", 0.0, 1e3) = 3.0
    # out of the muscle's law for so long: shorter ones are the frame's swing
    law_time: quantity("s", 1e-3, 10.0) = 0.10
    # motor torque per current; without it a current is not held against the force
    torque_constant: quantity("N*m/A", 1e-4, 10.0) | None = None
    # by how much the friction of motor and gear differs between its two directions, at the motor:
    # a fifth of what a planetary gear of this size has
    friction_difference: quantity("N*m", 0.0, 10.0) = 0.004
    # the least that a planetary gear passes on
    gear_efficiency: quantity("1", 0.05, 1.0) = 0.6
    # the motor leaves standstill by so much before its joint must have followed
    joint_follows: quantity("m", 1e-5, 1.0) = 0.004

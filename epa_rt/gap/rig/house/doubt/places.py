"""Places of a rig that a gap may come from, each with an error of its own: effects whose knobs are
the factors of that error's shapes.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from epa_rt.gap.rig.house import instruments
from epa_rt.gap.rig.house.doubt import drive, lines, readings
from epa_rt.gap.rig.house.doubt.bench import feels_force
from epa_rt.gap.rig.house.doubt.states import Shapes, has_gauge
from epa_rt.gap.rig.house.evaluate import Bench
from epa_rt.models.effect import Effect, Knob

SIGN = ":"  # between what is off and the number of a shape: no number of a plant is called so
FREE = 1e6  # spreads to either side
LENGTHS = ("gas0", "gas1", "muscle0", "load")
MOTOR = ("motor", "torque")


class Off(NamedTuple):
    """What may be off (bench.py): its shapes, how much of an error one of a shape is, in which
    unit, and the links that it moves; ``needs``: one without which nobody looks.
    """

    shapes: Callable[[Bench], Shapes]
    size: float
    unit: str
    links: tuple[str, ...]
    needs: str | None = None


def _of_both(shapes: Callable[[Bench, int], Shapes]) -> Callable[[Bench], Shapes]:
    """(2, N) each: a muscle's own states make its error, with one factor for both. Zeros of a
    muscle that is not there or has no gauge, nothing where neither has.
    """

    def made(bench: Bench) -> Shapes:
        own = [shapes(bench, i) if has_gauge(bench, i) else [] for i in (0, 1)]
        none = [np.zeros(bench.prepared.count)] * max(map(len, own))
        return [np.stack(pair) for pair in zip(own[0] or none, own[1] or none, strict=True)]

    return made


OFF: Mapping[str, Off] = {
    "travel": Off(lines.travel, 1e-4, "m", LENGTHS),
    "radius": Off(lines.radius, 0.02, "A", MOTOR, "motor"),
    "pull": Off(_of_both(lines.pull), 1.0, "N", ("muscle0", "load")),
    "stretch": Off(_of_both(lines.stretch), 1e-4, "m", LENGTHS),
    "volume": Off(_of_both(lines.volume), 1e-6, "m^3", ("gas0", "gas1", "load")),
    "swell": Off(_of_both(lines.swell), 1e-6, "m^3", ("gas0", "gas1", "load")),
    "gas0": Off(lambda bench: lines.gas(bench, 0), 500.0, "Pa", ("gas0", "load"), "gas0"),
    "gas1": Off(lambda bench: lines.gas(bench, 1), 500.0, "Pa", ("gas1", "load"), "gas1"),
    "gauge0": Off(
        lambda bench: readings.gauge(bench, 0), 500.0, "Pa", ("gas0", "muscle0", "load"), "gas0"
    ),
    "gauge1": Off(lambda bench: readings.gauge(bench, 1), 500.0, "Pa", ("gas1", "load"), "gas1"),
    "force": Off(readings.force, 1.0, "N", ("muscle0", *MOTOR), "muscle0"),
    "current": Off(readings.current, 0.02, "A", ("drive", *MOTOR), "drive"),
    "angle": Off(readings.angle, 1e-3, "rad", (*LENGTHS, "drive", *MOTOR, "encoder")),
    "place": Off(readings.place, 3e-3, "rad or m", LENGTHS, "load"),
    "torque": Off(drive.torque, 0.02, "A", MOTOR, "motor"),
    "loop": Off(drive.loop, 0.02, "A", ("drive",), "drive"),
    "command": Off(drive.command, 1e-2, "rad", ("drive",), "drive"),
    "load": Off(drive.load, 0.3, "rad/s^2 or m/s^2", ("load",), "load"),
}
# Place to its block, what it is for people, and what is off there.
PLACES: Mapping[str, tuple[str, str, tuple[str, ...]]] = {
    "spool": ("transmission", "the way that the spool gives the lines", ("travel", "radius")),
    "muscle": (
        "muscle",
        "a muscle's force, its line's stretch or its volume",
        ("pull", "stretch", "volume"),
    ),
    "gas": (
        "gas",
        "what flows into a muscle and out of it, heat, or a volume that swells",
        ("gas0", "gas1", "swell"),
    ),
    "gauge": ("sensors", "a reading of the pressure", ("gauge0", "gauge1")),
    "force_cell": ("sensors", "the reading of the force", ("force",)),
    "current_reading": ("sensors", "the reading of the current", ("current",)),
    "encoder": ("sensors", "the reading of the motor's angle", ("angle",)),
    "load_reading": ("sensors", "the reading of the load's place", ("place",)),
    "drive": (
        "drive",
        "the motor's torque, or how the drive follows its commands",
        ("torque", "loop", "command"),
    ),
    "load": ("load", "what the load's motion takes", ("load",)),
}


def shapes_of(bench: Bench, links: Sequence[str]) -> dict[str, np.ndarray]:
    """What may be off on a rig with these links, to its shapes: (k, N), of what both muscles have
    (k, 2, N).
    """
    return {
        name: np.asarray(off.shapes(bench))
        for name, off in OFF.items()
        if not set(links).isdisjoint(off.links) and (off.needs is None or off.needs in links)
    }


def also_moved(params: np.ndarray) -> dict[str, tuple[str, ...]]:
    """What may be off to links that it moves besides, on a plant with these numbers: forces have a
    part in a strapped muscle's volume and in a gauge that feels them, and a cell that is late is
    corrected by a prediction.
    """
    found: dict[str, tuple[str, ...]] = {}
    if feels_force(params):
        found |= {"pull": ("gas0", "gas1"), "force": ("gas0", "load")}
    if instruments.is_dynamic(params["sensors"][0]):
        found |= {
            name: (*found.get(name, ()), *MOTOR)
            for name in ("pull", "stretch", "gauge0", "travel", "place")
        }
    if params["load"]["travel1_ratio"][0] != 0.0:
        found |= {
            name: (*found.get(name, ()), *MOTOR)
            for name in ("pull", "stretch", "gauge1", "travel", "place")
        }
    return found


def knobs_of(counts: Mapping[str, int]) -> dict[str, Knob]:
    """Key to the factor of a shape. ``counts``: how many shapes each has that may be off."""
    keys = [(f"{name}{SIGN}{k}", OFF[name]) for name, count in counts.items() for k in range(count)]
    return {
        key: Knob(key, off.unit, 0.0, -FREE * off.size, FREE * off.size, off.size, "place")
        for key, off in keys
    }


def catalogue_of(knobs: Mapping[str, Knob]) -> tuple[Effect, ...]:
    """The places that these knobs make, as effects."""
    own = {
        place: tuple(key for key in knobs if key.split(SIGN)[0] in off)
        for place, (_, _, off) in PLACES.items()
    }
    return tuple(
        Effect(
            place, place, PLACES[place][0], keys, ((0.0,) * len(keys),), PLACES[place][1], "", ""
        )
        for place, keys in own.items()
        if keys
    )

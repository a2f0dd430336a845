"""What each column may be: part, quantity and unit, with every doubt that is left."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from epa_rt.logs.importers.guess.clock import ClockGuess
from epa_rt.logs.importers.guess.motion import Slope, encoder_unit, follows, slopes, unit_pairs
from epa_rt.logs.importers.guess.seen import Seen
from epa_rt.logs.importers.guess.units import Unit, unit_of
from epa_rt.logs.importers.guess.words import Words, words_of

_SPEED_OF = {"angle": "turning", "length": "speed"}
_MOST_NAMELESS = 24  # columns that are compared with all others, though no name asks for it
_USUAL_FACTORS = (1.0, 1e3, 1e-3, math.pi / 180.0, 180.0 / math.pi)
_LIMBS = {
    "knee",
    "hip",
    "elbow",
    "ankle",
    "wrist",
    "shoulder",
    "neck",
    "waist",
    "leg",
    "arm",
    "toe",
}
_PARTS = {"actual": "measured", "either": "reference", "likely command": "command"}
_STAMPS = ("header.stamp", "log_time", "publish_time")
_OF_MESSAGE: dict[str, dict[str, Unit | None]] = {
    "sensor_msgs/msg/FluidPressure": {
        "fluid_pressure": Unit("Pa", "pressure", against="abs"),
        "variance": None,
    },
    "sensor_msgs/msg/Temperature": {
        "temperature": Unit("K", "temperature", offset="273.15 K"),
        "variance": None,
    },
    "sensor_msgs/msg/Imu": {
        "angular_velocity": Unit("rad/s", "turning"),
        "linear_acceleration": None,
        "orientation": Unit("1", "ratio"),
    },
    "geometry_msgs/msg/Wrench": {"force": Unit("N", "force"), "torque": Unit("Nm", "torque")},
    "sensor_msgs/msg/BatteryState": {
        "voltage": Unit("V", "voltage"),
        "current": Unit("A", "current"),
    },
}
"""Units that the definition of a message lays down, by the first word of the field's address."""
_OF_JOINTS = {
    "position": (Unit("rad", "angle"), "m"),
    "velocity": (Unit("rad/s", "turning"), "m/s"),
    "effort": (Unit("Nm", "torque"), "N"),
}
"""sensor_msgs/JointState: the unit of a joint that turns, and that of one that slides."""


@dataclass
class Reading:
    """A column: ``part`` ('measured', 'command', 'reference', 'trial', 'clock', 'left out'),
    its unit, and in words why, and what is unsure.
    """

    column: str | int
    words: Words
    part: str
    unit: Unit | None = None
    against: str = ""
    why: str = ""
    unsure: list[str] = field(default_factory=list)


def read_columns(seen: Seen, clock: ClockGuess) -> dict[str | int, Reading]:
    """One reading for each column of a table."""
    readings = {
        column: _first(seen, column, values, clock) for column, values in seen.columns.items()
    }
    open_ones = {
        c: r for c, r in readings.items() if r.part in ("measured", "command", "reference")
    }
    _by_slopes(seen, clock, open_ones)
    _by_steps(seen, open_ones)
    _by_following(seen, open_ones)
    for column, reading in open_ones.items():
        _by_size(seen.columns[column], reading)
        _against(seen.columns[column], reading)
    return readings


def _first(seen: Seen, column: str | int, values: np.ndarray, clock: ClockGuess) -> Reading:
    words = words_of(seen.name(column))
    if seen.topic is not None or seen.of_many:
        words = _of_topic(seen.topic or seen.path.stem, words)
    part = _PARTS.get(words.part, words.part)
    if part in ("clock", "counter") and column != clock.column and not _grows(values):
        part = "measured"  # T1 may be a temperature
    if column == clock.column or column in _STAMPS:
        return Reading(column, words, "clock")
    if part in ("clock", "counter"):
        word = "another clock" if part == "clock" else "a counter of rows"
        return Reading(column, words, "left out", why=word)
    reading = Reading(column, words, part)
    if part == "trial":
        return _trial(reading, values)
    _known_unit(seen, column, reading)
    if reading.part == "left out":
        return reading
    _doubt_part(reading)
    if {"acc", "acceleration", "accel"} & set(words.tokens):
        reading.part, reading.why = "left out", "accelerations have no signal"
    return reading


def _known_unit(seen: Seen, column: str | int, reading: Reading) -> None:
    """The unit that a message lays down, the file says, or the name has."""
    words = reading.words
    declared = unit_of(seen.units[column]) if column in seen.units else None
    lays_down, by_message = _by_message(seen, column)
    if seen.type == "sensor_msgs/msg/JointState" and str(column).partition("[")[0] in _OF_JOINTS:
        reading.unit, slides = _OF_JOINTS[str(column).partition("[")[0]]
        reading.why = "as JointState lays down for a joint that turns"
        if not _LIMBS & set(words.tokens):
            reading.unsure.append(f"{slides} where the joint slides")
    elif lays_down:
        if by_message is None:
            reading.part, reading.why = "left out", "no signal has such a quantity"
            return
        reading.unit, reading.why = by_message, f"as {seen.type} lays down"
    elif declared is not None or words.unit is not None:
        reading.unit = declared or words.unit
        reading.why = "the file says its unit" if declared is not None else "its name"
        _check_unit(reading)
    if seen.units.get(column) and declared is None:
        reading.unsure.append(f"the file says the unit {seen.units[column]!r}, which is not known")


def _grows(values: np.ndarray) -> bool:
    known = values[~np.isnan(values)]
    return bool(np.all(np.diff(known) >= 0)) and len(known) > 1 and known[-1] > known[0]


def _of_topic(topic: str, words: Words) -> Words:
    """The topic says the part, and the quantity where the field says none ('/cmd_force.data')."""
    of_topic = words_of(topic)
    asked = ("command", "likely command", "reference", "either")
    part = of_topic.part if of_topic.part in asked else words.part
    unit = words.unit
    quantities, sure = words.quantities, words.sure
    if not quantities or words.tokens[:1] == ("data",):
        quantities, sure, unit = of_topic.quantities, of_topic.sure, unit or of_topic.unit
    part = "measured" if part in ("trial", "clock", "counter") else part
    return words._replace(part=part, quantities=quantities, sure=sure, unit=unit)


def _trial(reading: Reading, values: np.ndarray) -> Reading:
    known = values[~np.isnan(values)]
    changes = int(np.count_nonzero(np.diff(known)))
    if changes == 0:
        reading.part, reading.why = "left out", f"a trial's number, always {known[0]:g}"
        return reading
    whole = bool(np.all(known == np.rint(known))) and np.abs(known).max(initial=0) <= 1e6
    if not whole or changes > 1000 or changes > 0.2 * len(known):
        reading.part = "measured"
        return reading
    if (known == 0).any() and len(np.unique(known)) > 1:
        reading.unsure.append("rows of 0 count as between trials")
    if (known < 0).any():
        reading.unsure.append("negative numbers count as trials as well")
    return reading


def _by_message(seen: Seen, column: str | int) -> tuple[bool, Unit | None]:
    address = str(column)
    for name, fields in _OF_MESSAGE.items():
        stem = name.rpartition("/")[2]
        if seen.type in (name, f"{name}Stamped", name.replace("/msg/", "/")):
            parts = address.removeprefix(f"{stem.lower()}.").split(".")
            if parts[0] in fields:
                return True, fields[parts[0]]
    return False, None


def _check_unit(reading: Reading) -> None:
    """A unit against what the name says: 'motor_m' may be a motor's measured one."""
    unit, words = reading.unit, reading.words
    if unit is None:
        return
    agrees = unit.quantity in words.quantities
    scaled = unit.quantity in ("voltage", "raw", "ratio")  # a sensor before its calibration
    if words.quantities and not agrees and not scaled:
        reading.unsure.append(
            f"its name says {words.quantities[0]}, the unit {unit.text} says {unit.quantity}"
        )
    elif unit.text == "inch" and words.tokens[-1:] != ("inch",) and reading.why == "its name":
        reading.unsure.append("'in' at the end of its name is taken as inches")
    elif not words.quantities and len(unit.text) == 1 and reading.why == "its name":
        reading.unsure.append(f"the letter {unit.text!r} at the end of its name is taken as a unit")


def _doubt_part(reading: Reading) -> None:
    if reading.words.part == "either":
        reading.unsure.append("a reference, or what was sent to the drive (then cmd_)")
    elif reading.words.part == "actual":
        reading.unsure.append("the actual value, or the action that was commanded")
    elif reading.words.part == "likely command":
        reading.unsure.append("taken as what was sent to the rig; a reference is ref_")


def _by_slopes(seen: Seen, clock: ClockGuess, readings: dict[str | int, Reading]) -> None:
    """Units of positions and speeds by the factor between them."""
    t_s = _seconds(seen, clock)
    if t_s is None:
        return
    nameless = [c for c, r in readings.items() if not r.words.quantities and r.unit is None]
    left_out = set(nameless[_MOST_NAMELESS:])
    speeds = {
        c: seen.columns[c]
        for c, r in readings.items()
        if _may_be(r, "turning", "speed") and c not in left_out
    }
    for parts in (("measured",), ("command", "reference")):
        positions = {
            c: seen.columns[c]
            for c, r in readings.items()
            if r.part in parts and _may_be(r, "angle", "length") and c not in left_out
        }
        for slope in slopes(positions, speeds, t_s):
            _take_slope(seen, clock, slope, readings)
            del speeds[slope.speed]


def _seconds(seen: Seen, clock: ClockGuess) -> np.ndarray | None:
    if clock.back_at is not None:
        return None
    if clock.column is None:
        rows = len(next(iter(seen.columns.values())))
        return None if clock.unsure else np.arange(rows) * clock.period_s
    stamps = seen.columns[clock.column]
    seconds: np.ndarray = (stamps - stamps[0]).astype(float) * clock.factor
    return seconds


def _take_slope(
    seen: Seen, clock: ClockGuess, slope: Slope, readings: dict[str | int, Reading]
) -> None:
    """Units of one position and its speed, with what is left open."""
    position, speed = readings[slope.position], readings[slope.speed]
    said = f"{slope.factor:.4g} x the slope of {seen.name(slope.position)!r}"
    pairs = [
        (a, b) for a, b in unit_pairs(slope.factor) if _allows(position, a) and _allows(speed, b)
    ]
    named = bool(speed.words.quantities) and bool(position.words.quantities)
    if not pairs and speed.words.quantities and speed.words.sure:
        speed.unsure.append(f"it is {said}, which fits no pair of units")
    if not pairs or not named and not _beyond_chance(slope):
        return
    if len({p for p, _ in pairs}) > 1:
        pairs = _likelier(pairs, position, seen.columns[slope.position])
    doubt = [] if len(pairs) == 1 else [" or ".join(f"{p} and {v}" for p, v in pairs[:3])]
    if not named:
        doubt.append("only its motion says so")
    if clock.unsure and clock.column != "header.stamp":
        doubt.append("the clock is unsure, and with it the factor")
    for one, column in ((position, slope.position), (speed, slope.speed)):
        if one.unit is not None and one.unsure:
            doubt.append(f"if {seen.name(column)!r} is right")
    of_position = f"{seen.name(slope.speed)!r} is {slope.factor:.4g} x its slope"
    for reading, text, why in ((position, pairs[0][0], of_position), (speed, pairs[0][1], said)):
        if reading.unit is None:
            reading.unit, reading.why = unit_of(text), why
            reading.unsure += doubt


def _beyond_chance(slope: Slope) -> bool:
    """Columns without names: a friction force is nearly the slope of a position as well."""
    usual = any(abs(slope.factor / factor - 1.0) < 0.01 for factor in _USUAL_FACTORS)
    return usual and slope.explained > 0.999


def _likelier(
    pairs: list[tuple[str, str]], position: Reading, values: np.ndarray
) -> list[tuple[str, str]]:
    step = encoder_unit(values)
    if step and any(a == step for a, _ in pairs):
        return [pair for pair in pairs if pair[0] == step]
    quantity = position.words.quantities[0] if position.words.quantities else "angle"
    first = _sized(values, quantity)
    return sorted(
        pairs, key=lambda pair: (pair[0] != first.text, pair[0] not in ("rad", "m", "mm"))
    )


def _may_be(reading: Reading, *quantities: str) -> bool:
    if reading.unit is not None:
        return reading.unit.quantity in quantities
    return not reading.words.quantities or bool(set(quantities) & set(reading.words.quantities))


def _allows(reading: Reading, text: str) -> bool:
    other = unit_of(text)
    if reading.unit is not None:
        return reading.unit.text == text
    return other is not None and _may_be(reading, other.quantity)


def _by_steps(seen: Seen, readings: dict[str | int, Reading]) -> None:
    """The steps of an encoder tell radians from degrees."""
    for column, reading in readings.items():
        if reading.unit is None and _may_be(reading, "angle"):
            text = encoder_unit(seen.columns[column])
            if text:
                reading.unit = unit_of(text)
                reading.why = "its steps are a turn in 2^n parts"
                if not reading.words.quantities:
                    reading.unsure.append("only its steps say that it is an angle")


def _by_following(seen: Seen, readings: dict[str | int, Reading]) -> None:
    """A command or reference without a unit has that of what follows it."""
    for column, reading in readings.items():
        is_act = reading.words.part == "actual"
        if reading.unit is not None or reading.part == "measured" and not is_act:
            continue
        for other, measured in readings.items():
            if measured.part != "measured" or other == column:
                continue
            if measured.unit is None and not (is_act and measured.words.quantities):
                continue
            if measured.unit is not None and not _may_be(reading, measured.unit.quantity):
                continue
            if follows(seen.columns[column], seen.columns[other]):
                reading.part = "command" if is_act else reading.part
                if measured.unit is None:
                    measured.unit = _sized(seen.columns[other], measured.words.quantities[0])
                    measured.unsure.append(f"{measured.unit.text} by its size alone")
                reading.unit, reading.why = measured.unit, f"{seen.name(other)!r} follows it"
                reading.unsure += measured.unsure[:1]
                break


def _by_size(values: np.ndarray, reading: Reading) -> None:
    """The likeliest unit by the size of the values, which leaves it unsure."""
    if reading.unit is not None:
        if reading.unit.quantity in ("ratio", "raw") and reading.unit.text == "1":
            _switch(values, reading)
        return
    if _is_switch(values) and not _strong(reading):
        _switch(values, reading)
        return
    if not reading.words.quantities:
        whole = bool(np.all(values[~np.isnan(values)] == np.rint(values[~np.isnan(values)])))
        reading.unit, reading.why = Unit("1", "raw"), "no unit is known"
        reading.unsure.append("a count or a word" if whole else "FILL IN what it is: nothing tells")
        return
    quantity = reading.words.quantities[0]
    whole = bool(np.all(values[~np.isnan(values)] == np.rint(values[~np.isnan(values)])))
    if quantity == "raw" and len(reading.words.quantities) > 1 and not whole:
        quantity = reading.words.quantities[1]
    reading.unit, reading.why = _sized(values, quantity), "its size"
    if quantity in ("raw", "valve", "switch", "ratio"):
        reading.why = "its name"
        if not reading.words.sure or quantity in ("valve", "ratio"):
            reading.unsure.append("taken as a number without a unit")
        return
    if len(reading.words.quantities) > 1:
        others = " or ".join(reading.words.quantities[1:])
        reading.unsure.append(f"its name may say {quantity} or {others}")
    reading.unsure.append(f"{reading.unit.text} by its size alone")


def _strong(reading: Reading) -> bool:
    return reading.words.sure and reading.words.quantities[0] not in ("valve", "switch", "raw")


def _is_switch(values: np.ndarray) -> bool:
    """Both 0 and 1, and nothing else."""
    return set(np.unique(values[~np.isnan(values)]).tolist()) == {0, 1}


def _switch(values: np.ndarray, reading: Reading) -> None:
    if not _is_switch(values):
        return
    kind = reading.words.quantities[:1]
    quantity = kind[0] if kind and kind[0] in ("valve", "switch", "raw") else "switch"
    if not kind:
        reading.unsure.append("only 0 and 1: taken as a switch")
    elif kind[0] not in ("valve", "switch", "raw"):
        reading.unsure.append(f"only 0 and 1, though its name says {kind[0]}")
    if reading.part == "measured":
        reading.unsure.append("what was commanded (then cmd_) or what was measured")
    reading.unit, reading.why = Unit("1", quantity), reading.why or "only 0 and 1"


def _sized(values: np.ndarray, quantity: str) -> Unit:
    """The unit in which values of this size are those of a rig that stands on a bench."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    choices: dict[str, Iterable[tuple[float, str]]] = {
        "angle": ((7.0, "rad"), (np.inf, "deg")),
        "length": ((1.5, "m"), (np.inf, "mm")),
        "turning": ((60.0, "rad/s"), (np.inf, "deg/s")),
        "speed": ((5.0, "m/s"), (np.inf, "mm/s")),
        "force": ((20_000.0, "N"), (np.inf, "mN")),
        "torque": ((200.0, "Nm"), (np.inf, "mNm")),
        "pressure": ((20.0, "bar"), (3000.0, "kPa"), (np.inf, "Pa")),
        "current": ((60.0, "A"), (np.inf, "mA")),
        "voltage": ((500.0, "V"), (np.inf, "mV")),
        "temperature": ((200.0, "C"), (np.inf, "K")),
        "frequency": ((np.inf, "Hz"),),
        "mass": ((np.inf, "kg"),),
    }
    for bound, text in choices.get(quantity, ()):
        if largest <= bound:
            found = unit_of(text)
            assert found is not None
            return found
    return Unit("1", quantity)


def _against(values: np.ndarray, reading: Reading) -> None:
    """What a pressure is against: its name, its unit, or what no absolute pressure can be."""
    unit = reading.unit
    if unit is None or unit.quantity != "pressure":
        return
    reading.against = reading.words.against or unit.against
    if reading.against:
        return
    from epa_rt.config.units import unit as factor_of

    lowest_pa = float(np.nanmin(values)) * factor_of(unit.text)[0]
    sized = "its size" in reading.why
    if lowest_pa < 20e3 and not sized:
        reading.against = "gauge"
        reading.why += "; no chamber is that near to vacuum"
        return
    reading.against = "gauge" if lowest_pa < 70e3 or lowest_pa > 130e3 else "abs"
    reading.unsure.append("gauge or abs")

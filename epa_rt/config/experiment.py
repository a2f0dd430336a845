"""The experiment file: phases of motion and valve actions. Typed, frozen, unknown keys refused.

Quantities stay as they were written ("20 mm/s", "$p0"): what they mean hangs on the rig (places, mm
or deg, limits, atmosphere) and on the repetition. ``epa_rt.experiments.experiment`` reads them and
checks them against the rig.
"""

from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from epa_rt.config.fields import NAME_PATTERN, Frozen, Name
from epa_rt.config.units import UnitError, split_quantity

Loop = Literal["motor_position", "motor_speed", "motor_torque", "joint_angle"]
ValveWord = Literal["hold", "hold_and_trim", "vent", "close"]


def _written(value: Any) -> str:
    text = str(value).strip()
    if not (text.startswith("$") and len(text) > 1):
        split_quantity(value)
    return text


def _position(value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise UnitError(
            f"found {value!r}, expected a position with its unit or the name of a place"
        )
    return str(value).strip()


_QUANTITY_SCHEMA = {
    "type": ["string", "number"],
    "description": "a number with its unit, or $name of a repeated value",
}
Written = Annotated[str, BeforeValidator(_written), WithJsonSchema(_QUANTITY_SCHEMA)]
Position = Annotated[
    str,
    BeforeValidator(_position),
    WithJsonSchema(
        {
            "type": ["string", "number"],
            "description": "a place of the rig, a position with its unit, or $name",
        }
    ),
]


class Move(Frozen):
    """From where it is to a place or position, at most at a speed."""

    to: Position
    speed: Written
    acceleration: Written | None = None


class RandomSpeed(Frozen):
    """Random speeds up to ``speed``, each held for a random time within ``dwell``, inside a range
    of positions.
    """

    between: tuple[Position, Position]
    speed: Written
    acceleration: Written | None = None
    dwell: tuple[Written, Written] = ("100 ms", "800 ms")


class Wave(Frozen):
    """What periodic motions share: the mean, the height from lowest to highest point, the time to
    fade in and out.
    """

    mean: Position
    peak_to_peak: Written
    fade: Written = "2 s"


class Chirp(Wave):
    """Frequency linearly from one to another over the phase."""

    start: Written = Field(alias="from")
    end: Written = Field(alias="to")


class Sine(Wave):
    frequency: Written


class Multisine(Wave):
    """Equal sines between two frequencies, spread evenly over the octaves, all harmonics of 1 /
    period.
    """

    start: Written = Field(alias="from")
    end: Written = Field(alias="to")
    lines: Annotated[int, Field(ge=2, le=32)] = 8
    period: Written = "10 s"


class Step(Frozen):
    """Rests ``dwell``, then jumps to each of the levels in turn within ``rise``; ``times`` through
    the levels.
    """

    levels: Annotated[tuple[Position, ...], Field(min_length=1, max_length=100)]
    rise: Written
    dwell: Written
    times: Annotated[int, Field(ge=1, le=1000)] = 1


class Staircase(Frozen):
    """From one position to another in equal steps, resting ``dwell`` on each; back again the same
    way if asked.
    """

    start: Position = Field(alias="from")
    end: Position = Field(alias="to")
    steps: Annotated[int, Field(ge=1, le=200)]
    dwell: Written
    speed: Written
    acceleration: Written | None = None
    back: bool = False


class ValveAction(Frozen):
    """One word, or ``{set: PRESSURE}``: fill or vent to a pressure, trim, close."""

    word: ValveWord | None = None
    set: Written | None = None


def _valve_action(value: Any) -> Any:
    words = ", ".join(get_args(ValveWord))
    if isinstance(value, str):
        if value not in get_args(ValveWord):
            raise UnitError(f"found '{value}', expected {words} or {{set: PRESSURE}}")
        return {"word": value}
    if isinstance(value, dict) and set(value) == {"set"}:
        return value
    raise UnitError(f"found {value!r}, expected {words} or {{set: PRESSURE}}")


class Until(Frozen):
    """A condition that ends a phase: all valves settled, or a measured signal below or above a
    value for a while.
    """

    valves_settled: bool = False
    signal: Name | None = None
    below: Written | None = None
    above: Written | None = None
    steady: Written = "0 s"

    @model_validator(mode="after")
    def _one_condition(self) -> "Until":
        if not self.valves_settled and (
            self.signal is None or (self.below is None) == (self.above is None)
        ):
            raise UnitError(
                "found a condition that is not whole, expected valves_settled, or signal with below"
                " or above"
            )
        return self


def _until(value: Any) -> Any:
    conditions = value if isinstance(value, (list, tuple)) else [value]
    for condition in conditions:
        if condition != "valves_settled" and not (
            isinstance(condition, dict) and "valves_settled" not in condition
        ):
            raise UnitError(
                f"found {condition!r}, expected valves_settled or {{signal: NAME, below: VALUE}}"
            )
    return [{"valves_settled": True} if c == "valves_settled" else c for c in conditions]


_ACTION_SCHEMA = {
    "anyOf": [
        {"enum": list(get_args(ValveWord))},
        {
            "type": "object",
            "properties": {"set": _QUANTITY_SCHEMA},
            "required": ["set"],
            "additionalProperties": False,
        },
    ]
}
_CONDITION_SCHEMA = {
    "anyOf": [
        {"const": "valves_settled"},
        {
            "type": "object",
            "required": ["signal"],
            "additionalProperties": False,
            "properties": {
                "signal": {"type": "string"},
                **{k: _QUANTITY_SCHEMA for k in ("below", "above", "steady")},
            },
        },
    ]
}
Action = Annotated[ValveAction, BeforeValidator(_valve_action), WithJsonSchema(_ACTION_SCHEMA)]
Conditions = Annotated[
    tuple[Until, ...],
    BeforeValidator(_until),
    WithJsonSchema({"anyOf": [_CONDITION_SCHEMA, {"type": "array", "items": _CONDITION_SCHEMA}]}),
]

MOTIONS = ("move", "random_speed", "chirp", "sine", "multisine", "step", "staircase")


class PhaseFile(Frozen):
    """One phase: at most one motion (none: hold still), what the valves do, when it ends."""

    name: Name
    loop: Loop | None = None
    trial: bool = False
    move: Move | None = None
    random_speed: RandomSpeed | None = None
    chirp: Chirp | None = None
    sine: Sine | None = None
    multisine: Multisine | None = None
    step: Step | None = None
    staircase: Staircase | None = None
    valves: dict[str, Action] = {}
    lasts: Written | None = Field(default=None, alias="for")
    until: Conditions = ()
    timeout: Written | None = None
    seed: Annotated[int, Field(ge=0, lt=1 << 63)] | None = None

    @property
    def motion(self) -> str | None:
        """Key of the phase's motion, None where it holds still."""
        return next((key for key in MOTIONS if getattr(self, key) is not None), None)

    @model_validator(mode="after")
    def _one_motion(self) -> "PhaseFile":
        motions = [key for key in MOTIONS if getattr(self, key) is not None]
        if len(motions) > 1:
            raise UnitError(
                f"found {' and '.join(motions)} in one phase, expected one motion in a phase"
            )
        return self


class ExperimentFile(Frozen):
    """A whole experiment. ``phases`` run once per repeated value (or ``times`` over); before and
    after run once. ``first_repetition``: those before it, counted from 0, are left out of the run.
    """

    experiment: Name
    description: str = ""
    loop: Loop
    seed: Annotated[int, Field(ge=0, lt=1 << 63)] = 0
    repeat: dict[
        Annotated[str, Field(pattern=NAME_PATTERN)],
        Annotated[tuple[Written, ...], Field(min_length=1, max_length=1000)],
    ] = {}
    times: Annotated[int, Field(ge=1, le=100_000)] | None = None
    first_repetition: Annotated[int, Field(ge=0, lt=100_000)] = 0
    before: tuple[PhaseFile, ...] = ()
    phases: Annotated[tuple[PhaseFile, ...], Field(min_length=1)]
    after: tuple[PhaseFile, ...] = ()

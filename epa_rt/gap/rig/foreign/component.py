"""What a component rig of somebody else is made of: channels, settings, links, numbers, effects and
the equations.

A new kind of rig is one module with a ``Component`` in it, entered in ``kinds.py``; everything else
(files, filtering, baseline, the whole diagnosis) follows from it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from epa_rt.config.source import ConfigError
from epa_rt.gap.rig.foreign.signals import Signals
from epa_rt.gap.subject import Link
from epa_rt.models.effect import Effect

if TYPE_CHECKING:
    from epa_rt.gap.rig.foreign.reversals import Turning

Numbers = Mapping[
    str, float
]  # every parameter of a plant by key ('friction.coulomb_n'), settings of the rig by name


class Channel(NamedTuple):
    """A measured or commanded signal that the equations use; ``role`` is its name in them.
    ``size``: setting that says how large it is, roughly; '' where none does.
    """

    role: str
    unit: str
    says: str
    required: bool = True
    size: str = ""


class Setting(NamedTuple):
    """A number of the rig that is known and never fitted. ``default`` None: the rig file must say
    it.
    """

    name: str
    unit: str
    low: float
    high: float
    default: float | None
    says: str


class Parameter(NamedTuple):
    """One number of a plant. ``key``: block, dot, name with unit.

    A nominal parameter is of no effect; where its ``neutral`` is None the plant file must say it,
    else it may; its ``spread`` is relative, or in SI where ``absolute``. Of an effect's number
    ``low``, ``high`` and ``spread`` count in units of ``scale``, a product or quotient of settings
    such as 'typical_force/typical_speed' ('' for the SI unit itself); ``low`` in those of
    ``low_scale`` where that is said (never above ``neutral``).
    """

    key: str
    unit: str
    neutral: float | None
    low: float
    high: float
    spread: float
    links: tuple[str, ...]
    effect: str | None = None
    scale: str = ""
    absolute: bool = False
    low_scale: str = ""

    @property
    def block(self) -> str:
        return self.key.split(".")[0]

    @property
    def name(self) -> str:
        return self.key.split(".")[1]


class Experiment(NamedTuple):
    """One of a component rig's menu. ``commands``: (N,) each by role, at ``rate_hz``."""

    name: str
    settings: dict[str, str]
    says: str
    rate_hz: float
    commands: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Component:
    """A kind of rig.

    ``prepare(signals, numbers)``: what no parameter changes, for one recording; may narrow
    ``signals.valid`` per link. ``residual(prepared, numbers, link)``: measured minus predicted at
    the recording's own rate, (N,), unfiltered. ``features(prepared, link)``: (N,) each.
    ``free_run(prepared, numbers)``: measured channels by role, simulated forward from what was
    commanded, without noise; None where there is no model of the whole. ``menu(settings)``:
    experiments that the rig could run next. ``equations``: the model with every number that it has,
    so that another person could write it again. Two threads may call any of them at once.
    """

    kind: str
    says: str
    channels: tuple[Channel, ...]
    settings: tuple[Setting, ...]
    links: tuple[tuple[Link, str], ...]  # link and the role of its measured output
    parameters: tuple[Parameter, ...]
    effects: tuple[Effect, ...]  # starts in units of the scales of their knobs
    prepare: Callable[[Signals, Numbers], object]
    residual: Callable[[object, Numbers, str], np.ndarray]
    features: Callable[[object, str], Mapping[str, np.ndarray]]
    free_run: Callable[[object, Numbers], Mapping[str, np.ndarray]] | None = None
    menu: Callable[[Numbers], tuple[Experiment, ...]] | None = None
    # cut-off periods after which the filters have forgotten a hole or an end; 5 where two follow
    # each other
    settled: float = 2.0
    # weigh all frequencies up to the low-pass alike, whatever the colour of what laps differ by
    flat: bool = False
    needs: Mapping[str, tuple[str, ...]] = field(
        default_factory=dict
    )  # roles that a link needs beside its output
    undetermined: Callable[[object, Numbers], np.ndarray] | None = (
        None  # of what was prepared: (N,) rows in which no law foresees the outputs
    )
    # of what was prepared: the motion on whose direction the one link's output hangs
    turning: "Callable[[object, Numbers], Turning] | None" = None
    # role of the drive's effort where nothing but friction holds against it at rest
    effort: str | None = None
    # from the other channels, by a residual that is measured less foreseen: a turned sign then runs
    # against it
    output_is_foreseen: bool = False
    # of a residual, unfiltered: (N,) what it is behind the drive's lag
    at_load: Callable[[np.ndarray, Signals, Numbers], np.ndarray] | None = None
    equations: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Raises ConfigError where two effects, or two numbers, have one name."""
        for what, names in (
            ("effect", [one.name for one in self.effects]),
            ("number", [one.key for one in self.parameters]),
        ):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                from epa_rt.gap.rig.foreign.laws import place

                expected = f"a name that no other {what} of a {self.kind} has"
                raise ConfigError(*place(twice[0]), "", f"{what} '{twice[0]}'", expected)


def scaled(scale: str, settings: Numbers) -> float:
    """Value of a scale such as 'typical_force*typical_speed/stroke', in SI; 1 for ''. Raises
    KeyError for an unknown setting.
    """
    value, sign = 1.0, "*"
    for part in scale.replace("/", " / ").replace("*", " * ").split():
        if part in "*/":
            sign = part
        else:
            value = value * settings[part] if sign == "*" else value / settings[part]
    return value


def effect(
    name: str,
    family: str,
    block: str,
    knobs: tuple[str, ...],
    starts: tuple[tuple[float, ...], ...],
    says: str,
    equation: str,
    source: str,
    swings_over: str | None = None,
    sets_in: bool = False,
) -> Effect:
    """An entry of a component's catalogue; ``starts`` in units of the knobs' scales;
    ``swings_over``: the feature whose angle it swings over; ``sets_in`` as in Effect.
    """
    return Effect(
        name,
        family,
        block,
        knobs,
        starts,
        says,
        equation,
        source,
        swings_over=swings_over,
        sets_in=sets_in,
    )

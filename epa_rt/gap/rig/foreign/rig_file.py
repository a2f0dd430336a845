"""Rig files of component rigs: which column is what, settings that are known, rates. YAML, every
number with its unit.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from epa_rt.config.fields import Frozen, Name, quantity
from epa_rt.config.kinds import expect_kind
from epa_rt.config.source import Located, Location, load_yaml, validate
from epa_rt.config.units import UnitError, parse_quantity, with_unit
from epa_rt.gap.rig.foreign.component import Component


class SlowNoise(Frozen):
    """What a channel wanders by from one run to the next, as repeats show it: a first-order
    process.
    """

    rms: str | float
    time: quantity("s", 1e-3, 1e6)


class RigText(Frozen):
    """A component rig as it is written."""

    rig: Name
    kind: Name
    plant: str | None = None
    rate: quantity("Hz", 0.01, 1e5)  # of the residuals
    lowpass: quantity("Hz", 0.001, 1e5)  # zero-phase, before they are thinned out to that rate
    channels: dict[Name, str]
    settings: dict[Name, str | float] = {}
    steps: dict[Name, str | float] = {}  # by role: what a reading jumps by
    repeats_to: dict[
        Name, str | float
    ] = {}  # by role: rms by which one run differs from the mean of its like
    slow_noise: dict[Name, SlowNoise] = {}  # by role: what repeats differ by beyond sample noise


@dataclass(frozen=True)
class ForeignRig:
    """``channels``: role to column name; ``settings``: every setting of the kind in SI; ``steps``:
    role to a reading's step, ``slow_noise``: role to rms and time constant, ``repeats_to``: role to
    rms, where said.
    """

    name: str
    component: Component
    plant: Path | None
    rate_hz: float
    lowpass_hz: float
    channels: dict[str, str]
    settings: dict[str, float]
    steps: dict[str, float] = field(default_factory=dict)
    slow_noise: dict[str, tuple[float, float]] = field(default_factory=dict)
    repeats_to: dict[str, float] = field(default_factory=dict)

    @property
    def steps_by_column(self) -> dict[str, float]:
        """What a reading jumps by, SI, by the name of its column, where said."""
        return {
            self.channels[role]: step for role, step in self.steps.items() if role in self.channels
        }

    @property
    def asked_by_column(self) -> dict[str, tuple[str, ...]]:
        """What is asked of a place, by the name of its column: what a link foresees it from, in its
        own unit.
        """
        unit = {channel.role: channel.unit for channel in self.component.channels}
        found = {}
        for _, role in self.component.links:
            asked = [one for one in self.component.needs.get(role, ()) if unit[one] == unit[role]]
            if asked:
                found[self.channels[role]] = tuple(self.channels[one] for one in asked)
        return found


def load_rig(path: Path) -> ForeignRig:
    """Reads a component rig file. Raises ConfigError."""
    from epa_rt.gap.rig.foreign.kinds import KINDS

    source = load_yaml(path)
    expect_kind(source, "foreign rig")
    text = validate(source, RigText)
    if text.kind not in KINDS:
        raise source.error(("kind",), f"'{text.kind}'", "one of " + ", ".join(sorted(KINDS)))
    component = KINDS[text.kind]
    if text.lowpass > 0.5 * text.rate:
        raise source.error(
            ("lowpass",), f"{text.lowpass:g} Hz", f"at most half the rate, {0.5 * text.rate:g} Hz"
        )
    roles = {channel.role for channel in component.channels}
    for role in text.channels:
        if role not in roles:
            raise source.error(
                ("channels", role), f"'{role}'", f"one of {', '.join(sorted(roles))}"
            )
    for channel in component.channels:
        if channel.required and channel.role not in text.channels:
            raise source.error(
                ("channels",),
                "nothing",
                f"the key '{channel.role}': the column with {channel.says}",
            )
    _each_its_own(source, text.channels)
    plant = (path.parent / text.plant) if text.plant else None
    return ForeignRig(
        text.rig,
        component,
        plant,
        text.rate,
        text.lowpass,
        dict(text.channels),
        _settings(source, component, text.settings),
        _by_role(source, component, "steps", text.steps),
        _slow_noise(source, component, text.slow_noise),
        _by_role(source, component, "repeats_to", text.repeats_to),
    )


def _each_its_own(source: Located, channels: dict[str, str]) -> None:
    """Raises ConfigError where two roles have one column: it would answer for itself."""
    of_column: dict[str, str] = {}
    for role, column in channels.items():
        if column in of_column:
            raise source.error(
                ("channels", role), f"{column} for {of_column[column]} and {role}", "a column each"
            )
        of_column[column] = role


def _by_role(
    source: Located,
    component: Component,
    section: str,
    written: dict[str, Any],
    last: tuple[str, ...] = (),
) -> dict[str, float]:
    units = {channel.role: channel.unit for channel in component.channels}
    for role in written:
        if role not in units:
            raise source.error((section, role), f"'{role}'", f"one of {', '.join(sorted(units))}")
    return {
        role: bounded(source, (section, role, *last), text, units[role], 0.0, 1e9)
        for role, text in written.items()
    }


def _slow_noise(
    source: Located, component: Component, written: dict[str, SlowNoise]
) -> dict[str, tuple[float, float]]:
    sizes = _by_role(
        source,
        component,
        "slow_noise",
        {role: noise.rms for role, noise in written.items()},
        ("rms",),
    )
    return {role: (sizes[role], noise.time) for role, noise in written.items()}


def _settings(source: Located, component: Component, written: dict[str, Any]) -> dict[str, float]:
    known = {setting.name: setting for setting in component.settings}
    for name in written:
        if name not in known:
            raise source.error(("settings", name), f"'{name}'", f"one of {', '.join(known)}")
    values = {}
    for name, setting in known.items():
        if name in written:
            values[name] = bounded(
                source, ("settings", name), written[name], setting.unit, setting.low, setting.high
            )
        elif setting.default is None:
            raise source.error(
                ("settings",), "nothing", f"the key '{name}': {setting.says}, in {setting.unit}"
            )
        else:
            values[name] = setting.default
    return values


def bounded(
    source: Located, where: Location, text: Any, unit: str, low: float, high: float
) -> float:
    """A quantity of a file in SI. Raises ConfigError (no number, wrong unit, out of bounds)."""
    try:
        value = parse_quantity(text, unit)
    except UnitError as error:
        found, _, expected = str(error).removeprefix("found ").partition(", expected ")
        raise source.error(where, found, expected) from None
    if not low <= value <= high:
        raise source.error(where, f"{text}", with_unit(f"{low:g} to {high:g}", unit))
    return value

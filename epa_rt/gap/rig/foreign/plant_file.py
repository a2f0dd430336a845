"""Plant files of component rigs: nominal parameters, and effects with their numbers. YAML, every
number with its unit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from epa_rt.config.kinds import expect_kind
from epa_rt.config.source import Located, Location, load_yaml
from epa_rt.config.units import suffix_of
from epa_rt.gap.rig.foreign.component import Component, Parameter, scaled
from epa_rt.gap.rig.foreign.rig_file import ForeignRig, bounded


@dataclass(frozen=True)
class ForeignPlant:
    """``numbers``: every parameter by key in SI, neutral where the file is silent; ``effects``:
    those the file names. ``notes``: what of the file holds and may not be meant, a sentence each.
    """

    name: str
    kind: str
    numbers: dict[str, float]
    effects: tuple[str, ...]
    notes: tuple[str, ...] = field(default=(), compare=False)


def sized(parameter: Parameter, settings: dict[str, float]) -> Parameter:
    """A parameter with its bounds, spread and neutral value in SI."""
    if parameter.neutral is None:
        return parameter
    size = scaled(parameter.scale, settings)
    neutral = parameter.neutral * size
    low = (
        min(parameter.low * scaled(parameter.low_scale, settings), neutral)
        if parameter.low_scale
        else parameter.low * size
    )
    return parameter._replace(
        neutral=neutral, low=low, high=parameter.high * size, spread=parameter.spread * size
    )


def load_plant(path: Path, rig: ForeignRig) -> ForeignPlant:
    """Reads a plant file for a component rig. Raises ConfigError."""
    return read_plant(load_yaml(path), rig)


def read_plant(source: Located, rig: ForeignRig) -> ForeignPlant:
    """As load_plant, from YAML already read. A named effect starts neutral but for what the file
    says.
    """
    expect_kind(source, "foreign plant")
    component, data = rig.component, source.data
    parameters = [sized(parameter, rig.settings) for parameter in component.parameters]
    nominal = [p for p in parameters if p.effect is None]
    blocks = list(dict.fromkeys(p.block for p in nominal))
    if data.get("kind") != component.kind:
        raise source.error(
            ("kind",), _shown(data.get("kind")), f"{component.kind}, as the rig '{rig.name}' is"
        )
    for key in data:
        if key not in ("plant", "kind", "effects", *blocks):
            raise source.error(
                (key,), f"'{key}'", "one of " + ", ".join(("plant", "kind", *blocks, "effects"))
            )
    if not isinstance(data.get("plant"), str):
        raise source.error(("plant",), _shown(data.get("plant")), "the plant's name")
    numbers = {p.key: p.neutral for p in parameters if p.neutral is not None}
    for block in blocks:
        rows = [p for p in nominal if p.block == block]
        numbers |= _section(source, (block,), data.get(block, {}), rows)
        for row in rows:
            if row.key not in numbers:
                raise source.error((block,), "nothing", f"the key '{stem(row)}', in {row.unit}")
    numbers |= _effects(source, component, parameters)
    named = tuple(data.get("effects") or ())
    notes = _notes(source, component, parameters, numbers)
    return ForeignPlant(data["plant"], component.kind, numbers, named, notes)


def _notes(
    source: Located,
    component: Component,
    parameters: Sequence[Parameter],
    numbers: Mapping[str, float],
) -> tuple[str, ...]:
    """Notes on effects that the file names and that are absent by their numbers, and on laws of one
    family that stand beside each other.
    """
    rows, found = {row.key: row for row in parameters}, []
    acting: dict[str, list[str]] = {}
    by_name = {effect.name: effect for effect in component.effects}
    for name in source.data.get("effects") or ():
        knobs = [rows[key] for key in by_name[name].knobs]
        # of those that are 0 where it is absent one may be its strength, beside the first
        asked = [row for row in knobs if row.neutral == 0.0 or knobs[0].neutral != 0.0]
        if any(numbers[row.key] != row.neutral for row in asked):
            acting.setdefault(by_name[name].family, []).append(name)
            continue
        unit = "" if knobs[0].unit == "1" else f", in {knobs[0].unit}"
        expected = f"its strength, '{stem(knobs[0])}'{unit}; as it stands it does nothing"
        found.append(source.error(("effects", name), "an effect without strength", expected))
    for family, names in acting.items():
        if len(names) > 1:
            laws = f"{', '.join(names[:-1])} and {names[-1]}, laws of one family ({family})"
            expected = "one of them; as it stands all of them act"
            found.append(source.error(("effects", names[-1]), laws, expected))
    return tuple(map(str, found))


def _effects(
    source: Located, component: Component, parameters: list[Parameter]
) -> dict[str, float]:
    section = source.data.get("effects") or {}
    known = {effect.name: effect for effect in component.effects}
    numbers = {}
    for name, chosen in _mapping(source, ("effects",), section).items():
        if name not in known:
            raise source.error(("effects", name), f"'{name}'", "one of " + ", ".join(sorted(known)))
        numbers |= _section(
            source, ("effects", name), chosen, [p for p in parameters if p.key in known[name].knobs]
        )
    return numbers


def _section(
    source: Located, where: Location, section: Any, rows: list[Parameter]
) -> dict[str, float]:
    names = {p.name: p for p in rows} | {stem(p): p for p in rows}
    numbers = {}
    for name, text in _mapping(source, where, section).items():
        if name not in names:
            raise source.error(
                (*where, name), f"'{name}'", "one of " + ", ".join(stem(p) for p in rows)
            )
        row = names[name]
        numbers[row.key] = bounded(source, (*where, name), text, row.unit, row.low, row.high)
    return numbers


def stem(parameter: Parameter) -> str:
    """A parameter's name without its unit."""
    return parameter.name.removesuffix(suffix_of(parameter.unit))


def _mapping(source: Located, where: Location, data: Any) -> dict:
    if not isinstance(data, dict):
        raise source.error(where, _shown(data), "a mapping of keys to values")
    return data


def _shown(data: Any) -> str:
    return "nothing" if data is None else repr(data)


def plant_text(plant: ForeignPlant, rig: ForeignRig, effects: tuple[str, ...]) -> str:
    """A plant file that reads back to the same numbers, bit by bit; ``effects`` stand in it even
    where neutral.
    """
    text: dict[str, Any] = {"plant": plant.name, "kind": plant.kind}
    switched: dict[str, dict] = {name: {} for name in effects}
    for raw in rig.component.parameters:
        row = sized(raw, rig.settings)
        value = float(plant.numbers[row.key])
        said = f"{value!r} {row.unit}"
        if row.effect is None:
            if value != row.neutral:
                text.setdefault(row.block, {})[row.name] = said
        elif row.effect in switched or value != row.neutral:
            switched.setdefault(row.effect, {})[row.name] = said
    if switched:
        text["effects"] = switched
    return yaml.safe_dump(text, sort_keys=False, allow_unicode=True)

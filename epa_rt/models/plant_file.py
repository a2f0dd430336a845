"""Plant files: YAML with a quantity per parameter, checked against the tables."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from epa_rt.config.kinds import expect_kind
from epa_rt.config.source import Located, Location, load_yaml
from epa_rt.config.units import UnitError, parse_quantity, suffix_of, with_unit
from epa_rt.models.parameters import BLOCKS, TWICE, Parameter, Table, effects, neutral_params

SUBSTEPS = 2
MOST_SUBSTEPS = 1024
WHOLE = ("seed", "present", "law_code", "kind_code")


@dataclass(frozen=True)
class PlantFile:
    """A plant read from a file: its parameters (shape (1,), PARAMS), sub-steps per cycle, and the
    effects it names.
    """

    name: str
    params: np.ndarray
    substeps: int = SUBSTEPS
    effects: tuple[str, ...] = ()

    @property
    def seed(self) -> int:
        return int(self.params["sensors"]["seed"][0])


def load_plant(path: Path | str) -> PlantFile:
    """Reads a plant file. Raises ConfigError (unknown key, wrong unit, out of bounds), with file
    and line.
    """
    return read_plant(load_yaml(path))


def read_plant(source: Located) -> PlantFile:
    """As load_plant, from YAML already read."""
    expect_kind(source, "plant")
    data = _mapping(source, (), source.data)
    known = {
        "plant",
        "substeps",
        "effects",
        *BLOCKS,
        *(f"{block}{i}" for block in TWICE for i in (0, 1)),
    }
    for key in data:
        if key not in known:
            raise source.error((key,), f"'{key}'", "one of " + ", ".join(sorted(known)))
    if not isinstance(data.get("plant"), str):
        raise source.error(("plant",), repr(data.get("plant")), "the plant's name")
    params = neutral_params()
    for key in BLOCKS:
        _read_block(source, params, key, key, None)
    for key in TWICE:
        for i in (0, 1):
            _read_block(source, params, f"{key}{i}", key, i)
    named = _read_effects(source, params)
    return PlantFile(data["plant"], params, _substeps(source), named)


def _mapping(source: Located, where: Location, data: Any) -> dict:
    if not isinstance(data, dict):
        raise source.error(where, "nothing" if data is None else repr(data), "a mapping")
    return data


def _substeps(source: Located) -> int:
    value = source.data.get("substeps", SUBSTEPS)
    if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= MOST_SUBSTEPS:
        raise source.error(("substeps",), repr(value), f"a whole number from 1 to {MOST_SUBSTEPS}")
    return value


def _read_block(
    source: Located, params: np.ndarray, key: str, block: str, muscle: int | None
) -> None:
    """Reads section ``key`` into a block; of a block that exists twice, into both muscles if
    ``muscle`` is None.
    """
    if key not in source.data:
        return
    names = _names(BLOCKS[block])
    nominal = {name: row for name, row in names.items() if row.effect is None}
    special = {name: row for name, row in names.items() if row.effect is not None}
    for name, quantity in _mapping(source, (key,), source.data[key]).items():
        where = (key, name)
        if name in special:
            raise source.error(where, f"'{name}'", f"it under 'effects: {special[name].effect}:'")
        if name not in nominal:
            full = ", ".join(name for name, row in nominal.items() if name == row.name)
            raise source.error(where, f"'{name}'", f"one of {full}")
        write(
            params, block, nominal[name], _quantity(source, where, nominal[name], quantity), muscle
        )


def _read_effects(source: Located, params: np.ndarray) -> tuple[str, ...]:
    """Reads ``effects: {name: {parameter: quantity}}``; 'muscle0' or 'gas1' may stand between for
    one muscle only.
    """
    section = source.data.get("effects")
    if section is None:
        return ()
    catalogue = effects()
    for effect, chosen in _mapping(source, ("effects",), section).items():
        where = ("effects", effect)
        if effect not in catalogue:
            raise source.error(where, f"'{effect}'", "one of " + ", ".join(sorted(catalogue)))
        block = catalogue[effect][0][0]
        for name, quantity in _mapping(source, where, chosen).items():
            if name in ("muscle0", "muscle1") and block in TWICE:
                for inner, value in _mapping(source, (*where, name), quantity).items():
                    _read_effect(
                        source, params, effect, block, (*where, name, inner), value, int(name[-1])
                    )
            else:
                _read_effect(source, params, effect, block, (*where, name), quantity, None)
    return tuple(section)


def _read_effect(
    source: Located,
    params: np.ndarray,
    effect: str,
    block: str,
    where: Location,
    quantity: Any,
    muscle: int | None,
) -> None:
    allowed = {
        name: row for name, row in _names(BLOCKS[block]).items() if row.effect in (effect, None)
    }
    name = str(where[-1])
    if name not in allowed:
        own = ", ".join(row.name for row in BLOCKS[block] if row.effect == effect)
        raise source.error(
            where, f"'{name}'", f"a parameter of {effect} ({own}) or a nominal one of block {block}"
        )
    write(params, block, allowed[name], _quantity(source, where, allowed[name], quantity), muscle)


def _names(table: Table) -> dict[str, Parameter]:
    """Every name a file may use to its row: the full name, and the name without unit where only one
    row has it.
    """
    stems = Counter(stem_of(row) for row in table)
    named = {row.name: row for row in table}
    named.update({stem_of(row): row for row in table if stems[stem_of(row)] == 1})
    return named


def stem_of(row: Parameter) -> str:
    """A row's name without its unit suffix ('braid_length' of braid_length_m)."""
    return row.name.removesuffix(suffix_of(row.unit))


def _quantity(source: Located, where: Location, row: Parameter, quantity: Any) -> float:
    try:
        value = parse_quantity(quantity, row.unit)
    except UnitError as error:
        found, _, expected = str(error).removeprefix("found ").partition(", expected ")
        raise source.error(where, found, expected) from None
    if row.name in WHOLE and value != int(value):
        raise source.error(where, f"{quantity}", "a whole number")
    if not row.low <= value <= row.high:
        raise source.error(
            where, f"{quantity}", with_unit(f"{row.low:g} to {row.high:g}", row.unit)
        )
    return value


def write(
    params: np.ndarray, block: str, row: Parameter, value: float, muscle: int | None = None
) -> None:
    """Sets one parameter; of a block that exists twice, in both muscles unless ``muscle`` names
    one.
    """
    if block in TWICE and muscle is not None:
        params[block][row.name][0, muscle] = value
    else:
        params[block][row.name] = value


def save_plant(path: Path | str, plant: PlantFile) -> None:
    """Writes a plant file that load_plant reads back to the same parameters, bit by bit (all values
    in SI).
    """
    text: dict[str, Any] = {"plant": plant.name, "substeps": plant.substeps}
    switched: dict[str, dict] = {}
    for block, table in BLOCKS.items():
        for i in (0, 1) if block in TWICE else (None,):
            values = plant.params[block][0] if i is None else plant.params[block][0, i]
            for row in table:
                value = float(values[row.name])
                said = f"{value!r} {row.unit}"
                if row.effect is None:
                    text.setdefault(block if i is None else f"{block}{i}", {})[row.name] = said
                elif value != row.neutral or row.effect in plant.effects:
                    place = switched.setdefault(row.effect, {})
                    (place if i is None else place.setdefault(f"muscle{i}", {}))[row.name] = said
    text["effects"] = switched
    Path(path).write_text(
        yaml.safe_dump(text, sort_keys=False, allow_unicode=True), encoding="utf-8"
    )

"""The catalogue as a page for people (docs/effects.md) and a plant file's form as a JSON schema."""

import re
from collections import Counter

from epa_rt.models.catalogue import CATALOGUE, NOMINAL
from epa_rt.models.effect import Effect
from epa_rt.models.knobs import row_of
from epa_rt.models.parameters import BLOCKS, TWICE, Parameter, effects
from epa_rt.models.plant_file import MOST_SUBSTEPS, stem_of

WIDEST = 100  # characters of a cell
MOST_STARTS = 3  # of an effect that the page shows
_HEAD = """# Catalogue of effects

To look up what a diagnosis can name as the cause of a gap, or what a simulated rig can be given.
There are {count} effects that a nominal plant leaves out, {more} of them beside the gain and offset
of a channel.

- A *family* holds laws of which a rig has one at most.
- *Knobs* are the numbers that a fit may move. Where a cell is too short for them, the next row
  goes on.
- *Starts* are where fits begin, a typical strength first; of many the first {starts} are shown.

Equations, units, bounds and neutral values: [plant](plant.md), the section of the same name. Code:
`epa_rt/models/catalogue.py`; `knob`, `read_knob` and `write_knob` there handle a plant's numbers by
key. This page is written by `catalogue_page.page()`, and a test holds it to the code.
"""


def page() -> str:
    """docs/effects.md as text."""
    plain = [effect for effect in CATALOGUE if not effect.name.endswith(("_gain", "_offset"))]
    parts = [_HEAD.format(count=len(CATALOGUE), more=len(plain), starts=MOST_STARTS)]
    for section in dict.fromkeys(effect.equation for effect in CATALOGUE):
        parts.append(
            f"\n## {section}\n\n| Family | Effect | Says | Knobs | Starts | Source"
            " |\n|---|---|---|---|---|---|\n"
        )
        inside = [effect for effect in CATALOGUE if effect.equation == section]
        for family in dict.fromkeys(effect.family for effect in inside):
            parts += [_line(effect) for effect in inside if effect.family == family]
    parts.append(
        "\n## Nominal parameters that compete\n\n| Key | Spread | At least | Unit"
        " |\n|---|---|---|---|\n"
    )
    parts += [
        f"| `{n.key}` | {100 * n.relative:g} % | {n.least:g} | {row_of(n.key)[1].unit} |\n"
        for n in NOMINAL
    ]
    return "".join(parts)


def _line(effect: Effect) -> str:
    knobs = ", ".join(f"`{row_of(key)[1].name}`" for key in effect.knobs)
    shown, others = effect.starts[:MOST_STARTS], len(effect.starts) - MOST_STARTS
    starts = "; ".join(" ".join(f"{value:.4g}" for value in start) for start in shown)
    if others > 0:
        starts += f" and {others} more"
    return table_rows(effect.family, f"`{effect.name}`", effect.says, knobs, starts, effect.source)


def table_rows(*cells: str) -> str:
    """A row of a table, and as many below it as its longest list needs. A cell of more than WIDEST
    characters is cut behind a comma or a semicolon.
    """
    columns = [_cut(cell) for cell in cells]
    height = max(len(parts) for parts in columns)
    lines = ((parts[i] if i < len(parts) else "" for parts in columns) for i in range(height))
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _cut(cell: str) -> list[str]:
    parts, line = [], ""
    for piece in re.split(r"(?<=[,;]) ", cell):
        if line and len(line) + 1 + len(piece) > WIDEST:
            parts.append(line)
            line = piece
        else:
            line = f"{line} {piece}" if line else piece
    return [*parts, line]


def _quantity(row: Parameter) -> dict:
    """Schema of one row: a quantity as text, or a bare number where the row has no unit."""
    said = f"{row.meaning}; {row.low:g} to {row.high:g} {row.unit}, default {row.neutral:g}"
    return {"type": ["string", "number"] if row.unit == "1" else "string", "description": said}


def _rows(chosen: list[Parameter], table: tuple[Parameter, ...]) -> dict:
    """Schema of a mapping of rows, by full name and by the name without unit where that is unique
    in its table.
    """
    stems = Counter(stem_of(row) for row in table)
    named = {}
    for row in chosen:
        named[row.name] = _quantity(row)
        if stems[stem_of(row)] == 1:
            named[stem_of(row)] = _quantity(row)
    return {"type": "object", "properties": named, "additionalProperties": False}


def plant_schema() -> dict:
    """JSON schema (draft 2020-12) of a plant file: names, kinds and descriptions; bounds are
    checked by load_plant.
    """
    sections, switched = {}, {}
    for block, table in BLOCKS.items():
        nominal = [row for row in table if row.effect is None]
        for name in (block, *(f"{block}{i}" for i in (0, 1) if block in TWICE)):
            sections[name] = _rows(nominal, table)
    for effect, pairs in effects().items():
        block = pairs[0][0]
        entry = _rows([row for row in BLOCKS[block] if row.effect in (effect, None)], BLOCKS[block])
        if block in TWICE:
            entry["properties"] |= {
                f"muscle{i}": {**entry, "properties": dict(entry["properties"])} for i in (0, 1)
            }
        switched[effect] = entry
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "plant file",
        "type": "object",
        "properties": {
            "plant": {"type": "string"},
            "substeps": {"type": "integer", "minimum": 1, "maximum": MOST_SUBSTEPS},
            **sections,
            "effects": {
                "type": ["object", "null"],
                "properties": switched,
                "additionalProperties": False,
            },
        },
        "required": ["plant"],
        "additionalProperties": False,
    }

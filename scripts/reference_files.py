"""docs/files.md from the pydantic models, the plant's tables and the keys of study files."""

from collections.abc import Iterable, Iterator
from typing import Any

from pydantic import BaseModel
from reference_table import MOST_CELL, WRITTEN, cut, index, prose, table

from epa_rt.config.calibration_file import CalibrationFile
from epa_rt.config.experiment import ExperimentFile
from epa_rt.config.fields import NAME_PATTERN
from epa_rt.config.meanings import MEANINGS
from epa_rt.config.operator_file import OperatorFile
from epa_rt.config.queue import QueueFile
from epa_rt.config.rig import Rig
from epa_rt.config.rig_sensors import Sensors
from epa_rt.config.zero_file import ZeroFile
from epa_rt.control.valve_settings import ValveSettings
from epa_rt.logs.importers.mapping import Mapping
from epa_rt.models.parameters import BLOCKS, TWICE, Parameter
from epa_rt.models.plant_file import MOST_SUBSTEPS, stem_of
from epa_rt.study import arrangements, knee, rule, serial

FILES: tuple[tuple[str, type[BaseModel], str], ...] = (
    ("Rig file", Rig, "`config/rigs/*.yaml`: what hangs on the wire and what its numbers mean."),
    ("Experiment file", ExperimentFile, "`config/experiments/*.yaml`: what shall happen."),
    ("Queue file", QueueFile, "`config/queues/*.yaml`: runs one after the other."),
    ("Mapping file", Mapping, "`config/imports/*.yaml`: how a log of others is read."),
    ("Calibration file", CalibrationFile, "`RIG.calibration.yaml`, by `epa calibrate`."),
    ("Operator file", OperatorFile, "`operator.yaml` beside the rig files."),
    ("Zero file", ZeroFile, "`RIG.zero.yaml` beside the rig file, by `epa home`."),
)
HEAD = """# Files

Every key of every file. {written}
A quantity is a number with its unit (`20 mm/s`); any unit of the same kind will do.
A pressure says `gauge` or `abs`.
Unknown keys are refused. `epa schema` writes the same for an editor, `epa check` checks a file.

{index}"""
PLANT = """
## Plant file

`config/plants/*.yaml`: what the simulated rig is made of. Equations: [plant.md](plant.md).

| Key | Type | Unit | Default | Meaning |
|---|---|---|---|---|
| `plant` | text | – | required | name of the plant |
| `substeps` | whole number, 1 to {substeps} | – | 1 | steps of the plant per cycle |
| a block | section | – | – | its keys are below |
| `effects` | section | – | none | effect: its keys; [effects.md](effects.md) says what each is |
"""
# key, type, unit, default, meaning; keys are held to those that the study reads
_PLACES = (
    ("mean", "quantity", "m", "required", "middle of the sine"),
    ("amplitude", "quantity", "m", "required", "of the sine"),
)
_ROWS = (
    ("pressure", "range or list", "abs", "required", "of the muscle at no-load length"),
    ("frequency", "range or list", "Hz, rad/s", "required", "of the sine"),
)
_PLANT = ("plant", "file", "", "required", "plant file, from this file's folder")
STUDIES: dict[str, tuple[tuple[str, ...], tuple[tuple[str, str, str, str, str], ...]]] = {
    "serial": (
        serial.KEYS,
        (
            _PLANT,
            ("beside", "list of files", "", "none", "plants that are compared with it"),
            *_PLACES,
            *_ROWS,
            ("kp", "quantity", "1", f"{serial.PID[0]:g}", "of the position controller"),
            ("ki", "quantity", "1/s", f"{serial.PID[1]:g} 1/s", "of its integral"),
            ("kd", "quantity", "s", f"{serial.PID[2]:g} s", "of its slope"),
            ("servo_lag", "quantity", "s", f"{serial.LAG_S:g} s", "of the motor's servo"),
        ),
    ),
    "knee": (
        knee.KEYS,
        (
            ("rig", "file", "", "required", "rig file, from this file's folder"),
            ("spam", "range or list", "abs", "required", "pressures of the serial muscle"),
            ("ppam", "range or list", "abs", "required", "pressures of the parallel muscle"),
            ("peak_to_peak", "quantity", "rad", "required", "of the chirp"),
            ("from", "quantity", "Hz", "required", "first frequency of the chirp"),
            ("to", "quantity", "Hz", "required", "last frequency of the chirp"),
            ("seconds", "quantity", "s", "required", "length of the chirp"),
            ("catalogue_spam", "range or list", "abs", "required", "serial, of the catalogue"),
            ("catalogue_ppam", "range or list", "abs", "required", "parallel, of the catalogue"),
            ("catalogue_frequency", "range or list", "Hz, rad/s", "required", "of the catalogue"),
        ),
    ),
    "arrangements": (arrangements.KEYS, (_PLANT, *_PLACES, *_ROWS)),
    "rule": (
        rule.KEYS,
        (
            ("goal", "word", "", "required", "what the rule makes least"),
            *_PLACES,
            ("frequency", "list", "Hz, rad/s", "required", "rising frequencies"),
            ("pressure", "list", "abs", "required", "best pressure at each"),
        ),
    ),
}
COLUMNS = ("Key", "Type", "Unit", "Default", "Meaning")


def page() -> str:
    """docs/files.md as text. Raises KeyError for a key without a meaning."""
    parts: list[str] = []
    groups: list[list[str]] = []
    shown: set[str] = set()
    for title, model, where in FILES:
        schema = model.model_json_schema(by_alias=True)
        definitions = {model.__name__: schema, **schema.get("$defs", {})}
        parts.append(f"\n## {title}\n\n{where}\n")
        new = {name: found for name, found in definitions.items() if name not in shown}
        parts += [_section(name, found, model) for name, found in new.items()]
        groups.append([title, *(name for name in definitions if name != model.__name__)])
        shown |= set(new)
    groups += [["Plant file", *map(_block_title, BLOCKS), "Effects"]]
    groups += [["Study files", *map(_study_title, STUDIES)]]
    head = HEAD.format(written=WRITTEN, index=index(groups))
    return head + "".join([*parts, *_plant(), *_studies()])


def _section(name: str, schema: dict[str, Any], model: type[BaseModel]) -> str:
    rows, notes = [], []
    for key, taken in schema.get("properties", {}).items():
        kind, unit, choices = _taken(taken)
        if len(kind) > MOST_CELL:
            kind, note = "one of a list", f"- `{key}`: one of {choices}."
            notes.append(note)
        required = key in schema.get("required", ())
        default = "required" if required else _default(name, key, taken.get("default"), unit)
        rows.append((f"`{key}`", kind, unit, default, MEANINGS[name][key]))
    title = "" if name == model.__name__ else f"\n### {name}\n"
    said = "" if name == model.__name__ else f"\n{prose(schema.get('description', name))}\n"
    more = "\n" + "\n".join(notes) + "\n" if notes else ""
    return f"{title}{said}\n{table(COLUMNS, rows)}{more}"


def _taken(taken: dict[str, Any]) -> tuple[str, str, str]:
    """Type, unit and choices of a key, in words."""
    if "anyOf" in taken or "oneOf" in taken:
        options = [one for one in taken.get("anyOf", taken.get("oneOf", ())) if one != _NULL]
        found = [_taken(one) for one in options]
        kinds = " or ".join(dict.fromkeys(kind for kind, _, _ in found if kind))
        return kinds, found[0][1], found[0][2]
    if "$ref" in taken:
        name = taken["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})", "", ""
    return _simple(taken)


_DAY_S = 86400.0
_NULL = {"type": "null"}
_BRANCHES = ("enum", "const", "properties", "patternProperties", "additionalProperties")


def _simple(taken: dict[str, Any]) -> tuple[str, str, str]:
    words = str(taken.get("description", ""))
    if words.startswith("a number with a unit, as "):
        return "quantity", words.removeprefix("a number with a unit, as "), ""
    if words.startswith("a pressure"):
        return "pressure", "gauge, abs", ""
    if words.startswith("a number with its unit"):
        return "quantity or $name", "any that fits", ""
    if words.startswith("a place"):
        return "place, quantity or $name", "of the loop", ""
    if any(branch in taken for branch in _BRANCHES):
        return _branch(taken)
    kind = taken.get("type")
    if str(taken.get("pattern", "")) == NAME_PATTERN:
        return "name", "", ""
    if kind == "array":
        return _list(taken)
    if kind == "integer":
        return _whole(taken), "", ""
    if isinstance(kind, list):
        return "quantity", "as the signal", ""
    return (
        {"string": "text", "boolean": "true or false", "number": "number"}.get(
            str(kind), "text or number"
        ),
        "",
        "",
    )


def _branch(taken: dict[str, Any]) -> tuple[str, str, str]:
    """Words to choose from, or names with something behind each."""
    if "enum" in taken or "const" in taken:
        choices = ", ".join(f"`{one}`" for one in taken.get("enum", [taken.get("const")]))
        return choices, "", choices
    if "properties" in taken:
        return f"{{{', '.join(taken['properties'])}}}", "", ""
    inner = next(iter(taken.get("patternProperties", {}).values()), None)
    inner = inner if inner is not None else taken.get("additionalProperties")
    if not isinstance(inner, dict):
        return "section", "", ""
    kind, unit, _ = _taken(inner)
    return f"names: {kind}", unit, ""


def _list(taken: dict[str, Any]) -> tuple[str, str, str]:
    inner = taken.get("items") or next(iter(taken.get("prefixItems", ())), {})
    kind, unit, _ = _taken(inner)
    if taken.get("minItems") == taken.get("maxItems") == 2:
        return f"two of: {kind}", unit, ""
    most = f", at most {taken['maxItems']}" if "maxItems" in taken else ""
    return f"list of {kind}{most}", unit, ""


def _whole(taken: dict[str, Any]) -> str:
    low, high = taken.get("minimum"), taken.get("maximum", taken.get("exclusiveMaximum"))
    return "whole number" if high is None or low is None else f"whole number, {low} to {high}"


def _default(model: str, key: str, default: Any, unit: str) -> str:
    if model == "Valves":
        default, unit = _of_valves(key)
    if default in (None, "", [], {}) and not isinstance(default, bool):
        return "none"
    if isinstance(default, dict):
        return "as there"
    if isinstance(default, bool):
        return "true" if default else "false"
    if isinstance(default, list):
        return ", ".join(map(str, default))
    if isinstance(default, float) and unit not in ("", "1"):
        return _quantity(default, unit.split(",")[0])
    return f"{default:g}" if isinstance(default, float) else str(default)


def _quantity(value: float, unit: str) -> str:
    """A number in SI as people write it."""
    if unit == "s" and value >= _DAY_S:
        return f"{value / _DAY_S:g} d"
    if unit.startswith("Pa") and value >= 1e3:
        return f"{value / 1e3:g} k{unit}"
    return f"{value:g} {unit}"


def _of_valves(key: str) -> tuple[Any, str]:
    """The default that holds where a rig file does not say it."""
    if key == "vented":  # Rig.vented_pa
        return Sensors().vented, "Pa"
    settings = ValveSettings()
    for name in ValveSettings.__dataclass_fields__:
        stem, _, unit = name.rpartition("_")
        if name == key or (stem == key and unit in ("s", "pa")):
            value = getattr(settings, name)
            return value, {"s": "s", "pa": "Pa"}.get(unit, "") if stem == key else ""
    raise KeyError(key)


def _plant() -> Iterator[str]:
    yield PLANT.format(substeps=MOST_SUBSTEPS)
    columns = ("Key", "Unit", "Default", "Range", "Meaning")
    switched = []
    for block, rows in BLOCKS.items():
        names = f"`{block}`"
        if block in TWICE:
            names += f", or `{block}0` and `{block}1` for each muscle"
        yield f"\n### {_block_title(block)}\n\nSection {names}.\n\n"
        nominal = [row for row in rows if row.effect is None]
        yield table(columns, [_parameter(row) for row in nominal]) + _notes(nominal)
        switched += [row for row in rows if row.effect is not None]
    yield "\n### Effects\n\nSection `effects`, off where not named.\n\n"
    ordered = sorted(switched, key=lambda row: str(row.effect))
    yield table(("Effect", *columns), [(f"`{row.effect}`", *_parameter(row)) for row in ordered])
    yield _notes(ordered)


def _parameter(row: Parameter) -> tuple[str, str, str, str, str]:
    unit = "" if row.unit == "1" else row.unit
    return (
        f"`{stem_of(row)}`",
        unit,
        f"{row.neutral:g}",
        f"{row.low:g} to {row.high:g}",
        cut(row.meaning),
    )


def _notes(rows: Iterable[Parameter]) -> str:
    """What does not go into a cell."""
    lines = [
        f"- `{stem_of(row)}`: {row.meaning}.\n" for row in rows if cut(row.meaning) != row.meaning
    ]
    return "\n" + "".join(dict.fromkeys(lines)) if lines else ""


def _block_title(block: str) -> str:
    return f"Block {block}"


def _study_title(study: str) -> str:
    return f"Study {study}"


def _studies() -> Iterator[str]:
    """Raises KeyError where the keys here are not those that the study reads."""
    yield "\n## Study files\n\n`config/studies/*.yaml`. A range is `{from: A, to: B, points: N}`.\n"
    for study, (keys, rows) in STUDIES.items():
        if {row[0] for row in rows} != set(keys):
            raise KeyError(f"{study}: {sorted({row[0] for row in rows} ^ set(keys))}")
        shown = [(f"`{key}`", *rest) for key, *rest in rows]
        first = ("`study`", f"`{study}`", "", "required", "kind of the study")
        yield f"\n### {_study_title(study)}\n\n{table(COLUMNS, [first, *shown])}"

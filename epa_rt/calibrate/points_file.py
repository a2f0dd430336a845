"""Files of points: references to go through, or references beside readings already taken."""

import csv
import io
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from epa_rt.calibrate.point import Point
from epa_rt.calibrate.reference import Reader
from epa_rt.config.calibration_file import MOST_POINTS
from epa_rt.config.source import ConfigError, load_yaml
from epa_rt.config.units import UnitError, parse_quantity, unit

_LARGEST = 1 << 24  # bytes of a table: a million rows of two numbers
_HEAD = re.compile(r"\s*([a-z_ ]+?)\s*(?:[\[(]\s*([^\])]+?)\s*[\])])?\s*$", re.IGNORECASE)
COLUMNS = ("reference", "applied", "reading", "scatter", "uncertainty")


@dataclass(frozen=True)
class Asked:
    """A reference to be applied (the signal's unit), its standard uncertainty; ``applied``: what
    the simulation applies in its place.
    """

    reference: float
    reference_u: float
    applied: float | None
    is_mass: bool
    where: str


Row = dict[str, str]


def read_asked(path: Path, reader: Reader) -> list[Asked]:
    """References of a YAML file (points: [{reference: 10 N}, ...]) or a CSV table. Raises
    ConfigError.
    """
    found = []
    for line, row in _rows(path):

        def value(key: str, line: int = line, row: Row = row) -> tuple[float, float, bool] | None:
            return None if key not in row else _read(path, line, key, row[key], reader.read)

        reference = value("reference")
        if reference is None:
            raise ConfigError(path, line, "points", "a point without a reference", "reference: 5 N")
        applied = value("applied")
        found.append(
            Asked(
                reference[0],
                reference[1],
                None if applied is None else applied[0],
                reference[2],
                f"{path.name}:{line}",
            )
        )
    return found


def read_taken(path: Path, reader: Reader, native: str, step: float) -> tuple[list[Point], bool]:
    """Points of a table with references and readings (``native`` unit), one row each; and whether
    a reference was a mass. Raises ConfigError.
    """
    points, any_mass = [], False

    def in_native(text: str) -> float:
        return parse_quantity(text, native) / unit(native)[0]

    for line, row in _rows(path):
        for key in ("reference", "reading"):
            if key not in row:
                raise ConfigError(path, line, "", f"a row without a {key}", f"a column '{key}'")
        reference, u, mass = _read(path, line, "reference", row["reference"], reader.read)
        reading = _read(path, line, "reading", row["reading"], in_native)
        scatter = _read(path, line, "scatter", row["scatter"], in_native) if "scatter" in row else 0
        if "uncertainty" in row:
            u = _read(path, line, "uncertainty", row["uncertainty"], reader.read)[0]
        if scatter < 0.0 or not u > 0.0:
            raise ConfigError(
                path, line, "", "a scatter or an uncertainty below zero", "positive numbers"
            )
        # of a single number only the converter's step is known
        points.append(
            Point(
                reference,
                u,
                reading,
                step / math.sqrt(12.0),
                float(scatter),
                0.0,
                f"{path.name}:{line}",
            )
        )
        any_mass |= mass
    return points, any_mass


def _read(path: Path, line: int, key: str, text: str, read: Callable[[str], Any]) -> Any:
    try:
        return read(text)
    except UnitError as error:
        found, _, expected = str(error).removeprefix("found ").partition(", expected ")
        raise ConfigError(path, line, key, found, expected) from None


def _rows(path: Path) -> list[tuple[int, Row]]:
    """Line number and cells (text with unit) of each point. Raises ConfigError."""
    rows = _yaml_rows(path) if path.suffix.lower() in (".yaml", ".yml") else _csv_rows(path)
    if not rows:
        raise ConfigError(path, 1, "points", "no point", "at least two")
    if len(rows) > MOST_POINTS:
        raise ConfigError(path, 1, "points", f"{len(rows)} points", f"at most {MOST_POINTS}")
    return rows


def _yaml_rows(path: Path) -> list[tuple[int, Row]]:
    located = load_yaml(path)
    extra = sorted(set(located.data) - {"points"})
    if extra:
        raise located.error((extra[0],), f"an unknown key '{extra[0]}'", "points: [...]")
    points = located.data.get("points")
    if not isinstance(points, list):
        raise located.error(("points",), "no list", "points: [{reference: 10 N}, ...]")
    rows = []
    for i, point in enumerate(points):
        cells = point if isinstance(point, dict) else {"reference": point}
        for key, value in cells.items():
            if key not in COLUMNS:
                raise located.error(
                    ("points", i, key), f"an unknown key '{key}'", f"one of {', '.join(COLUMNS)}"
                )
            if isinstance(value, (dict, list)) or value is None:
                raise located.error(("points", i, key), "no value", "a number with a unit")
        rows.append((located.line(("points", i)), {k: str(v) for k, v in cells.items()}))
    return rows


def _csv_rows(path: Path) -> list[tuple[int, Row]]:
    text = _text(path)
    try:
        table = list(csv.reader(io.StringIO(text)))
    except csv.Error as error:
        raise ConfigError(
            path, 1, "", f"no CSV table ({error})", "comma-separated values"
        ) from None
    lines = [(n, cells) for n, cells in enumerate(table, 1) if any(c.strip() for c in cells)]
    lines = [(n, cells) for n, cells in lines if not cells[0].lstrip().startswith("#")]
    if not lines:
        return []
    heads = _heads(path, *lines[0])
    rows = []
    for line, cells in lines[1:]:
        if len(cells) != len(heads):
            raise ConfigError(
                path, line, "", f"{len(cells)} cells", f"{len(heads)}, as the head has"
            )
        rows.append(
            (
                line,
                {
                    name: f"{cell.strip()} {unit_text}".strip()
                    for (name, unit_text), cell in zip(heads, cells, strict=True)
                    if name in COLUMNS and cell.strip()
                },
            )
        )
    return rows


def _heads(path: Path, line: int, cells: list[str]) -> list[tuple[str, str]]:
    """Name and unit of each column: 'reference [N]', or 'reference' with the unit in the cells."""
    heads = []
    for cell in cells:
        match = _HEAD.match(cell[:60])
        name = match.group(1).lower().replace(" ", "_") if match else cell
        heads.append((name, (match.group(2) or "") if match else ""))
    names = [name for name, _ in heads]
    if "reference" not in names:
        raise ConfigError(
            path, line, "", f"the columns {', '.join(names)[:100]}", "a column 'reference [N]'"
        )
    for name in COLUMNS:
        if names.count(name) > 1:
            raise ConfigError(path, line, "", f"the column '{name}' twice", "each column once")
    return heads


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(_LARGEST + 1)
        if len(content) > _LARGEST:
            raise ConfigError(path, 1, "", f"more than {_LARGEST >> 20} MB", "a smaller table")
        return content.decode("utf-8-sig")
    except FileNotFoundError:
        raise ConfigError(path, 1, "", "no such file", "a table of points") from None
    except UnicodeDecodeError:
        raise ConfigError(path, 1, "", "bytes that are not UTF-8 text", "a CSV table") from None
    except OSError as error:
        raise ConfigError(
            path, 1, "", f"a file that cannot be read ({error.strerror})", "a table of points"
        ) from None

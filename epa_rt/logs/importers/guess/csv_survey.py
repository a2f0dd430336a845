"""How a CSV file is written: encoding, delimiter, decimal sign, header, units below it."""

import csv
import math
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from epa_rt.logs.importers.guess.seen import Seen, Survey
from epa_rt.logs.importers.guess.units import unit_of
from epa_rt.logs.importers.table import ImportRefused, why

_MOST_BYTES = 8 << 20  # enough for every trait; a longer file is judged by its begin
_LOOKED_AT = 400  # rows for delimiter, header and signs
_SAME_WIDTH = 0.95  # of the rows, where a delimiter is the right one
_DELIMITERS = ";\t|, "
_POINT = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?(\d+,?\d*|,\d+)([eE][+-]?\d+)?")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}([.,' ])\d{3}(\1\d{3})+|[+-]?[1-9]\d{0,2}(,\d{3})+\.\d+")
_LIST = re.compile(r"\[.*\]")
_NO_VALUES = ("", "nan", "na", "n/a", "none", "null", "nil", "-", "--", "#n/a", "missing")
_TEXT_SHARE = 0.2  # of the cells that are no number: a column of text


def survey_csv(path: Path) -> Survey:
    """Raises ImportRefused where no table of numbers is found."""
    text, encoding, unsure = _text(path)
    lines = text.splitlines()
    delimiter, rows, first = _split(path, lines)
    form: dict[str, Any] = {"delimiter": delimiter} if delimiter != "," else {}
    if encoding != "utf-8":
        form["encoding"] = encoding
    body = [row for _, row in rows]
    has_header = not _is_data(body[0])
    names = [cell.strip() for cell in body[0]] if has_header else []
    units: list[str] = []
    skip = rows[0][0]
    begin = int(has_header)
    if has_header and len(body) > 1 and _is_units(body[1]):
        units, begin = [cell.strip() for cell in body[1]], 2
    if skip:
        form["skip_lines"] = skip
    hints = _hints(lines[:skip], delimiter, len(body[0]), form) if not has_header else names
    by_number = not has_header or len(set(names)) < len(names)
    if has_header and by_number:  # names that stand twice cannot be asked for
        form["skip_lines"] = rows[begin][0]
        unsure = (*unsure, "names stand twice in the header: columns go by number")
    elif begin == 2:
        form["skip_below_header"] = 1
    if by_number:
        form["header"] = False
    if not text.endswith(("\n", "\r")):
        form["final_newline"] = False
    data = body[begin:]
    signs = _signs(data[:_LOOKED_AT], delimiter)
    form |= signs
    numbers = range(1, len(body[0]) + 1)
    keys: list[str | int] = [
        name if name and not by_number else number
        for name, number in zip(names or [""] * len(body[0]), numbers, strict=True)
    ]
    seen, missing = _columns(path, data, keys, signs)
    if missing:
        form["missing"] = sorted(missing)
    called = {k: hints[i] for i, k in enumerate(keys) if isinstance(k, int) and i < len(hints)}
    said = {key: units[i] for i, key in enumerate(keys) if i < len(units)}
    table = Seen(path, None, seen[0], "", said, seen[1], called)
    return Survey("csv", form, (table,), unsure)


def _text(path: Path) -> tuple[str, str, tuple[str, ...]]:
    try:
        with path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}:1: found {why(error)}, expected a CSV file") from None
    unsure: tuple[str, ...] = ()
    if len(content) > _MOST_BYTES:
        content = content[: content.rindex(b"\n") + 1] if b"\n" in content else content
        unsure = (f"only the first {_MOST_BYTES >> 20} MB of the file were looked at",)
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8"
    try:
        text = content.decode("utf-8-sig" if encoding == "utf-8" else encoding)
    except UnicodeError:
        if encoding == "utf-16" or b"\0" in content:
            raise ImportRefused(f"{path}:1: found bytes, expected text with columns") from None
        encoding, text = "latin-1", content.decode("latin-1")
        unsure = (*unsure, "the text is not UTF-8: latin-1 is taken")
    if "\0" in text:
        raise ImportRefused(f"{path}:1: found a zero byte, expected text with columns")
    return text, encoding, unsure


def _split(path: Path, lines: list[str]) -> tuple[str, list[tuple[int, list[str]]], int]:
    """The delimiter, and (lines before it, cells) of each row from the header on."""
    best: tuple[float, str, int] | None = None
    for delimiter in _DELIMITERS:
        rows = _rows(lines[:_LOOKED_AT], delimiter)
        widths = Counter(len(row) for _, row in rows[len(rows) // 3 :])
        if not widths:
            continue
        width, count = widths.most_common(1)[0]
        if width < 2 or count < _SAME_WIDTH * widths.total():
            continue
        cells = [cell for _, row in rows[len(rows) // 3 :] if len(row) == width for cell in row]
        share = sum(_is_number(cell) for cell in cells) / len(cells)
        if best is None or share > best[0] + 0.05:
            best = (share, delimiter, width)
    if best is None:
        if any(_is_number(line.strip()) for line in lines[:_LOOKED_AT]):
            best = (1.0, ",", 1)
        else:
            raise ImportRefused(
                f"{path}:1: found no delimiter that parts its lines alike, expected a CSV file"
            )
    _, delimiter, width = best
    rows = _rows(lines, delimiter)
    kept = [k for k, (_, row) in enumerate(rows) if len(row) == width]
    if not kept:
        raise ImportRefused(f"{path}:1: found no row of numbers, expected some")
    return delimiter, [rows[k] for k in range(kept[0], len(rows)) if len(rows[k][1]) == width], 0


def _rows(lines: list[str], delimiter: str) -> list[tuple[int, list[str]]]:
    found = []
    for number, line in enumerate(lines):
        if line.strip():
            try:
                found.append((number, next(csv.reader([line], delimiter=delimiter))))
            except (csv.Error, StopIteration):
                continue
    return found


def _is_number(cell: str) -> bool:
    plain = cell.strip()
    return bool(
        plain.lower() in _NO_VALUES
        or _POINT.fullmatch(plain)
        or _COMMA.fullmatch(plain)
        or _GROUPED.fullmatch(plain)
        or _LIST.fullmatch(plain)
    )


def _is_data(row: list[str]) -> bool:
    return any(_is_number(cell) and cell.strip().lower() not in _NO_VALUES for cell in row)


def _is_units(row: list[str]) -> bool:
    """Most cells are units, the others empty or signs for none."""
    known = [bool(unit_of(cell.strip(" []()"))) for cell in row if cell.strip(" []()-")]
    return bool(known) and not _is_data(row) and sum(known) >= 0.5 * len(known)


def _hints(before: list[str], delimiter: str, width: int, form: dict[str, Any]) -> list[str]:
    """Names in a comment above the numbers, '# t, q, v'."""
    for line in reversed(before):
        text = line.strip().lstrip("#%").strip()
        for cells in (text.split(delimiter), text.split(","), text.split()):
            if len(cells) == width and line.strip()[:1] in "#%":
                return [cell.strip() for cell in cells]
    return []


def _signs(data: list[list[str]], delimiter: str) -> dict[str, str]:
    """Decimal sign and sign for thousands, where they are not the usual ones."""
    cells = [cell.strip() for row in data for cell in row if not _LIST.fullmatch(cell.strip())]
    grouped = [match for cell in cells if (match := _GROUPED.fullmatch(cell))]
    found: dict[str, str] = {}
    if grouped:
        sign = grouped[0][1] or ","
        found["thousands"] = sign
        if sign == "." and any("," in cell for cell in cells):
            found["decimal"] = ","
        return found
    commas = sum(bool(_COMMA.fullmatch(c)) and "," in c for c in cells)
    points = sum(bool(_POINT.fullmatch(c)) and "." in c for c in cells)
    if delimiter != "," and commas and not points:
        found["decimal"] = ","
    return found


def _columns(
    path: Path, data: list[list[str]], keys: list[str | int], signs: dict[str, str]
) -> tuple[tuple[dict[str | int, np.ndarray], tuple[str, ...]], set[str]]:
    """Columns of numbers, the names of those of text, and what stands for no value."""
    columns: dict[str | int, np.ndarray] = {}
    texts: list[str] = []
    missing: set[str] = set()
    for i, key in enumerate(keys):
        cells = [row[i].strip() for row in data]
        if cells and _LIST.fullmatch(cells[0]):
            lists = [[_float(x, {}) for x in cell[1:-1].split(",")] for cell in cells]
            if len({len(one) for one in lists}) == 1 and isinstance(key, str):
                table = np.array(lists)
                columns |= {f"{key}[{k}]": table[:, k] for k in range(table.shape[1])}
                continue
        values = np.array([_float(cell, signs) for cell in cells])
        gone = np.isnan(values)
        if not len(values) or gone.mean() > _TEXT_SHARE and not _all_no_values(cells, gone):
            texts.append(str(key))
            continue
        if gone.all():
            texts.append(str(key))
            continue
        missing |= {cells[k] for k in np.flatnonzero(gone)[:1000]}
        columns[key] = values
    return (columns, tuple(texts)), missing


def _all_no_values(cells: list[str], gone: np.ndarray) -> bool:
    return all(cells[k].lower() in _NO_VALUES for k in np.flatnonzero(gone))


def _float(cell: str, signs: dict[str, str]) -> float:
    plain = cell.strip()
    sign, decimal = signs.get("thousands"), signs.get("decimal", ".")
    if sign is not None:
        if sign != decimal:
            plain = plain.replace(sign, "")
        elif plain.count(sign) > 1:
            plain = plain.replace(sign, "", plain.count(sign) - 1)
    if decimal == ",":
        plain = plain.replace(",", ".")
    try:
        value = float(plain) if "_" not in plain else math.nan
    except ValueError:
        return math.nan
    return value if math.isfinite(value) else math.nan

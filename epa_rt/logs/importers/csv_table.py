"""CSV files: every number read with its line, and refused with it."""

import csv
import io
import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from epa_rt.logs.importers.mapping import Format
from epa_rt.logs.importers.table import ImportRefused, Table, element_of, shown, why

_LARGEST = 1 << 30  # bytes of a file
_NO_VALUE = (
    "",
    "nan",
    "na",
    "n/a",
    "none",
    "null",
    "nil",
    "-",
    "--",
    "#n/a",
    "missing",
)  # texts that loggers write where they have none
UNITS_HINT = "; where units stand below the header, say 'skip_below_header: 1' under format"
_GROUPS = r"[+-]?[1-9]\d{{0,2}}(?:{sign}\d{{3}})+(?:{decimal}\d*)?(?:[eE][+-]?\d+)?"
_ENCODINGS = {"utf-8": "utf-8-sig", "latin-1": "latin-1", "utf-16": "utf-16"}


def read_csv(path: Path, form: Format, wanted: Sequence[str | int]) -> Table:
    """The wanted columns, by the header's name or by number from 1; 'name[2]' is an element of a
    list in brackets.

    Raises ImportRefused for the first thing that does not fit, with file, line and column.
    """
    rows, lines, header, ended = _rows(path, form)
    places = {column: _place(path, form, header, rows, lines, column) for column in wanted}
    if form.final_newline and not ended:
        raise ImportRefused(
            f"{path}:{lines[-1]}: found a last line without a line end, as of a file cut in the"
            " middle, expected a whole line (where the files end so, say 'final_newline: false'"
            " under format)"
        )
    columns = {}
    for column, (index, element) in places.items():
        values = np.empty(len(rows))
        for k, row in enumerate(rows):
            text = (
                row[index]
                if element is None
                else _element(row[index], element, path, lines[k], column)
            )
            values[k] = _number(
                text,
                form,
                path,
                lines[k],
                column,
                UNITS_HINT if k == 0 and header and not form.skip_below_header else "",
            )
        columns[column] = values
    return Table(str(path), columns, lambda row: f"{path}:{lines[row]}")


def _rows(path: Path, form: Format) -> tuple[list[list[str]], list[int], list[str] | None, bool]:
    """Rows of cells, the line on which each begins, the header's names, and whether the last line
    has its end.
    """
    text = _text(path, form)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=form.delimiter, strict=True)
    rows, lines, header, width, line, below = [], [], None, 0, 1, 0
    try:
        for row in reader:
            begin, line = line, reader.line_num + 1
            if begin <= form.skip_lines or not row:
                continue
            if not width:
                width = len(row)
                if form.header:
                    header, below = _header(path, begin, row), form.skip_below_header
                    continue
            if below:
                below -= 1
                continue
            if len(row) != width:
                guess = (
                    _delimiter_guess(form, header or rows[0])
                    or _comma_guess(form, len(row), width)
                    or _title_hint(rows)
                )
                raise ImportRefused(
                    f"{path}:{begin}: found {_columns(len(row))}, expected {width} as in the lines"
                    f" before{_cut(text, begin)}{guess}"
                )
            rows.append(row)
            lines.append(begin)
    except csv.Error as error:
        raise ImportRefused(
            f"{path}:{line}: found a line that is not CSV ({error}), expected cells between"
            f" {form.delimiter!r}"
        ) from None
    if not rows:
        raise ImportRefused(
            f"{path}:{line}: found no row of numbers, expected"
            f" some{' below the header' if header else ''}"
        )
    return rows, lines, header, text.endswith(("\n", "\r"))


def _text(path: Path, form: Format) -> str:
    try:
        if path.stat().st_size > _LARGEST:
            raise ImportRefused(
                f"{path}:1: found more than {_LARGEST >> 30} GB, expected a smaller file"
            )
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        raise ImportRefused(f"{path}:1: found {why(error)}, expected a CSV file") from None
    if not content.strip():
        raise ImportRefused(f"{path}:1: found an empty file, expected a CSV file")
    if form.encoding != "utf-16" and content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise ImportRefused(
            f"{path}:1: found the mark of UTF-16 text, expected {form.encoding} (say 'encoding:"
            " utf-16' under format)"
        )
    try:
        text = content.decode(_ENCODINGS[form.encoding])
    except UnicodeError as error:
        line = content.count(b"\n", 0, getattr(error, "start", 0)) + 1
        raise ImportRefused(
            f"{path}:{line}: found bytes that are not {form.encoding} text, expected that encoding"
            " (or another under format)"
        ) from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise ImportRefused(f"{path}:{line}: found a zero byte, expected text")
    return text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _header(path: Path, line: int, row: list[str]) -> list[str]:
    names = [cell.strip() for cell in row]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ImportRefused(
            f"{path}:{line}: found the column {shown(twice)} {names.count(twice)} times in the"
            " header, expected each name once"
            + (
                " (a file without a header: 'header: false', under format)"
                if _is_number(twice)
                else ""
            )
        )
    return names


def _place(
    path: Path,
    form: Format,
    header: list[str] | None,
    rows: list[list[str]],
    lines: list[int],
    column: str | int,
) -> tuple[int, int | None]:
    """Index of a column, and of the element in its lists."""
    width = len(rows[0])
    guess = _delimiter_guess(form, rows[0] if header is None else header)
    if isinstance(column, int):
        if column > width:
            raise ImportRefused(
                f"{path}:{lines[0]}: found {_columns(width)} with the delimiter {form.delimiter!r},"
                f" expected column {column}{guess}"
            )
        return column - 1, None
    if header is None:
        raise ImportRefused(
            f"{path}:1: column {shown(column)}: found a file said to have no header, expected"
            " columns by number, or 'header: true'"
        )
    name, element = (column, None) if column in header else element_of(column)
    if name not in header:
        names = ", ".join(shown(n) for n in header[:12])
        raise ImportRefused(
            f"{path}:{form.skip_lines + 1}: found no column {shown(name)}, expected it among"
            f" {names}{guess}"
        )
    return header.index(name), element


def _delimiter_guess(form: Format, row: list[str]) -> str:
    if len(row) > 1:
        return ""
    other = next((sign for sign in ";\t,|" if sign != form.delimiter and sign in row[0]), None)
    return (
        f"; the line has {row[0].count(other)} times {other!r}, which may be the delimiter"
        if other
        else ""
    )


def _comma_guess(form: Format, found: int, width: int) -> str:
    """Twice the columns between commas: every number has a decimal comma."""
    return (
        "; the numbers may have decimal commas, which need another delimiter or quotes"
        if form.delimiter == "," and found == 2 * width
        else ""
    )


def _element(cell: str, element: int, path: Path, line: int, column: str) -> str:
    inner = cell.strip()
    items = inner[1:-1].split(",") if inner.startswith("[") and inner.endswith("]") else None
    if items is None or element >= len(items):
        found = f"{shown(cell)}" if items is None else f"a list of {len(items)}"
        raise ImportRefused(
            f"{path}:{line}: column {shown(column)}: found {found}, expected a list in brackets"
            f" with an element {element}, counted from 0"
        )
    return items[element]


def _number(
    text: str, form: Format, path: Path, line: int, column: str | int, hint: str = ""
) -> float:
    plain = text.strip()
    if plain in form.missing:
        return math.nan
    plain, grouped = _ungrouped(plain, form)
    if form.decimal == ",":
        plain = "(a point)" if "." in plain else plain.replace(",", ".")
    try:
        value = float(plain) if plain.isascii() and "_" not in plain else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        found = "an empty cell" if not text.strip() else shown(text)
        expected = (
            "a number"
            if grouped
            else (
                f"a number with groups of three digits between {form.thousands!r}, its sign for"
                " thousands, or without that sign"
            )
        )
        raise ImportRefused(
            f"{path}:{line}: column {shown(column) if isinstance(column, str) else column}: found"
            f" {found}, expected"
            f" {expected}{_missing_hint(text.strip()) or hint * bool(text.strip())}"
        )
    return value


def _ungrouped(plain: str, form: Format) -> tuple[str, bool]:
    """A cell without its signs for thousands; and whether they part groups of three, the first of
    one to three without a leading zero, as '1.015' for 1015 and not '0.015'.
    """
    sign = form.thousands
    if sign is None or plain.count(sign) <= (sign == form.decimal):
        return plain, True
    if not re.fullmatch(
        _GROUPS.format(sign=re.escape(sign), decimal=re.escape(form.decimal)), plain, re.ASCII
    ):
        return "", False
    return plain.replace(sign, "", plain.count(sign) - 1 if sign == form.decimal else -1), True


def _missing_hint(text: str) -> str:
    return (
        "; where that means no value, name it in the mapping: format: {missing:"
        f" [{json.dumps(text, ensure_ascii=False)}]}}"
        if text.lower() in _NO_VALUE
        else ""
    )


def _title_hint(rows: list[list[str]]) -> str:
    """The first line that counts has another width than the second: it may be a title."""
    return (
        ""
        if rows
        else "; where lines stand before the header, say how many with 'skip_lines' under format"
    )


def _columns(count: int) -> str:
    return f"{count} column{'s' * (count != 1)}"


def _cut(text: str, line: int) -> str:
    is_last = line >= text.count("\n") + (not text.endswith("\n"))
    return "; it is the last line, the file may be cut" if is_last else ""

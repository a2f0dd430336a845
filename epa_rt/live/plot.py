"""Lines of the last seconds drawn with braille signs, two dots wide and four high each."""

from __future__ import annotations

import numpy as np

_BLANK = 0x2800
_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row and column of a sign
_LEAST_SPAN = 1e-9


def bounds(lines: list[np.ndarray], least_span: float) -> tuple[float, float]:
    """Lowest and highest value of all lines, at least so far apart; (0, least_span) without any."""
    found = [line[np.isfinite(line)] for line in lines]
    found = [line for line in found if len(line)]
    if not found:
        return 0.0, max(least_span, _LEAST_SPAN)
    low, high = min(line.min() for line in found), max(line.max() for line in found)
    missing = max(least_span, _LEAST_SPAN) - (high - low)
    return (low - missing / 2, high + missing / 2) if missing > 0 else (low, high)


def drawn(line: np.ndarray, columns: int, rows: int, low: float, high: float, of: int) -> list[str]:
    """One line of values, oldest first, as `rows` strings of `columns` signs. ``of``: how many
    values the whole width holds; what is missing is left blank on the left side.
    """
    signs = np.full((rows, columns), _BLANK, np.int64)
    values = line[-of:]
    if len(values) and columns > 0 and rows > 0:
        place = (np.arange(len(values)) + of - len(values)) * (2 * columns) // of
        level = (values - low) / max(high - low, _LEAST_SPAN) * (4 * rows - 1)
        is_seen = np.isfinite(level)
        height = np.clip(np.where(is_seen, level, 0.0), 0, 4 * rows - 1).round().astype(int)
        before: int | None = None
        for x, y, seen in zip(place.tolist(), height.tolist(), is_seen.tolist(), strict=True):
            if not seen:
                before = None
                continue
            span = range(min(before, y), max(before, y) + 1) if before is not None else (y,)
            for level_of in span:  # steep strokes stay joined
                down = 4 * rows - 1 - level_of
                signs[down // 4, x // 2] |= _DOTS[down % 4][x % 2]
            before = y
    return ["".join(map(chr, row)) for row in signs.tolist()]


def spark(line: np.ndarray, columns: int, low: float, high: float) -> str:
    """One row of blocks, for a value of which the trend is enough."""
    blocks = "▁▂▃▄▅▆▇█"
    if not len(line) or columns <= 0:
        return " " * max(columns, 0)
    parts = np.array_split(line, min(columns, len(line)))
    words = []
    for part in parts:
        seen = part[np.isfinite(part)]
        if not len(seen):
            words.append(" ")
            continue
        share = (seen.mean() - low) / max(high - low, _LEAST_SPAN)
        words.append(blocks[int(np.clip(share * 7.999, 0, 7))])
    return "".join(words).rjust(columns)

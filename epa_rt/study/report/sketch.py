"""The four wirings of the comparison as a drawing: frame, spool, muscles, strap and load."""

from epa_rt.report.charts import INK
from epa_rt.report.markup import Html, tag
from epa_rt.study.arrangements import NAMES_OF

WIDTH, HEIGHT = 300, 170  # of one wiring, in units of the drawing
MUSCLE, BESIDE, SOFT = "#1f5fa8", "#b8560f", "#5d6570"
SPOOL_X, UPPER, LOWER, LOAD_X, LOAD_END = 52, 62, 112, 205, 245
FRAME_X, RADIUS = 18, 20
WORDS = {
    "serial": "muscle 0 between spool and load",
    "parallel": "a strap to the spool; muscle 1 holds the load to the frame",
    "both": "muscle 0 to the spool, muscle 1 to the frame",
    "antagonistic": "the spool pulls muscle 0 and gives way to muscle 1",
}


def wirings() -> Html:
    """The four side by side, two by two; as wide as the page."""
    parts = [_place(name, i % 2, i // 2) for i, name in enumerate(NAMES_OF)]
    drawing = (
        f'<svg viewBox="0 0 {2 * WIDTH} {2 * HEIGHT}" role="img" width="100%"'
        ' style="max-width:720px" font-family="inherit" font-size="13">'
        f"<title>Four wirings of one motor and its muscles</title>{''.join(parts)}</svg>"
    )
    words = "; ".join(f"{name}: {WORDS[name]}" for name in NAMES_OF)
    return tag("figure", Html(drawing + tag("figcaption", f"{words}. S: spool on the motor.")))


def _place(name: str, column: int, row: int) -> str:
    x, y = column * WIDTH, row * HEIGHT
    title = _text(10, 18, name, INK, "font-weight='600'")
    return f'<g transform="translate({x} {y})">{title}{_wiring(name)}</g>'


def _wiring(name: str) -> str:
    spool_y = {"parallel": UPPER, "both": UPPER}.get(name, 87)
    above = {"serial": 87 - RADIUS, "antagonistic": 87 - RADIUS}.get(name, UPPER - RADIUS)
    parts = [_frame(), _spool(spool_y)]
    load = (above - 12, 87 + 32) if name in ("serial", "antagonistic") else (above - 8, LOWER + 20)
    parts.append(_load(*load))
    if name == "parallel":
        parts += [_rope(SPOOL_X, above, LOAD_X), _text(110, above - 6, "strap", SOFT)]
    else:
        parts.append(_muscle(SPOOL_X, above, LOAD_X, MUSCLE, "muscle 0"))
    if name in ("parallel", "both"):
        parts.append(_muscle(FRAME_X, LOWER, LOAD_X, BESIDE, "muscle 1"))
    elif name == "antagonistic":
        parts += _way_back(87 + RADIUS)
    return "".join(parts)


def _way_back(y: int) -> list[str]:
    """Muscle 1 from the far side of the load over a pulley to the other side of the spool."""
    pulley_x, low = 270, y + 22
    return [
        f"<circle cx='{pulley_x}' cy='{(87 + low) // 2}' r='{(low - 87) // 2}' fill='none'"
        f" stroke='{INK}' stroke-width='2'/>",
        _rope(LOAD_END, 87, pulley_x),
        _muscle(SPOOL_X, low, pulley_x, BESIDE, "muscle 1"),
        f"<path d='M{SPOOL_X} {y} V{low}' stroke='{INK}' stroke-width='2'/>",
    ]


def _frame() -> str:
    hatch = "".join(f"M{FRAME_X} {y} l-10 8 " for y in range(34, 142, 14))
    return (
        f"<path d='M{FRAME_X} 30 V146 {hatch}' stroke='{INK}' stroke-width='2' fill='none'/>"
        + _text(6, 162, "frame", SOFT)
    )


def _spool(y: int) -> str:
    return (
        f"<path d='M{FRAME_X} {y} H{SPOOL_X}' stroke='{INK}' stroke-width='4'/>"
        f"<circle cx='{SPOOL_X}' cy='{y}' r='{RADIUS}' fill='#f5f6f8' stroke='{INK}'"
        " stroke-width='2'/>" + _text(SPOOL_X - 4, y + 5, "S", INK)
    )


def _load(top: int, bottom: int) -> str:
    middle = (top + bottom) // 2 + 5
    return (
        f"<rect x='{LOAD_X}' y='{top}' width='{LOAD_END - LOAD_X}' height='{bottom - top}'"
        f" fill='#d8dbe0' stroke='{INK}' stroke-width='2'/>"
        + _text(LOAD_X + 7, middle, "load", INK)
    )


def _rope(x: int, y: int, end: int) -> str:
    return f"<path d='M{x} {y} H{end}' stroke='{INK}' stroke-width='2'/>"


def _muscle(x: int, y: int, end: int, colour: str, words: str) -> str:
    """A spindle amid a rope, with its name above."""
    begin, stop = x + (end - x) // 5, end - (end - x) // 5
    half = (stop - begin) // 3
    return (
        _rope(x, y, end) + f"<path d='M{begin} {y} c{half} -14 {2 * half} -14 {stop - begin} 0"
        f" c-{half} 14 -{2 * half} 14 -{stop - begin} 0 z' fill='{colour}'/>"
        + _text((begin + stop) // 2 - 27, y - 14, words, colour)
    )


def _text(x: int, y: int, words: str, colour: str, more: str = "") -> str:
    return f"<text x='{x}' y='{y}' fill='{colour}' {more}>{words}</text>"

"""Pieces of HTML. Text is escaped unless it says that it is Html."""

import html
from collections.abc import Iterable, Sequence


class Html(str):
    """Text that is markup already."""


def esc(text: object) -> Html:
    """Any text as markup; Html stays as it is."""
    return text if isinstance(text, Html) else Html(html.escape(str(text)))


def tag(name: str, content: object, **attributes: str) -> Html:
    """One element; ``class_`` is the attribute class."""
    written = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{html.escape(value)}"'
        for key, value in attributes.items()
    )
    return Html(f"<{name}{written}>{esc(content)}</{name}>")


def join(parts: Iterable[object], between: str = "") -> Html:
    return Html(between.join(esc(part) for part in parts))


def paragraph(*parts: object) -> Html:
    return tag("p", join(parts))


def note(*parts: object) -> Html:
    """Small print."""
    return tag("p", join(parts), class_="note")


def warning(*parts: object) -> Html:
    """A sentence that must not be overlooked."""
    return tag("p", join([tag("strong", "Note: "), *parts]), class_="warning")


def table(
    head: Sequence[object],
    rows: Iterable[Sequence[object]],
    text_columns: Sequence[int] = (0,),
    class_: str = "",
) -> Html:
    """A table; columns not in ``text_columns`` are numbers, set flush right. A row may begin with a
    class: Marked.
    """
    lines = [tag("tr", join(_cell("th", i, cell, text_columns) for i, cell in enumerate(head)))]
    body = []
    for row in rows:
        cells = join(_cell("td", i, cell, text_columns) for i, cell in enumerate(row))
        body.append(
            tag("tr", cells, class_=row.mark) if isinstance(row, Marked) else tag("tr", cells)
        )
    inner = tag("thead", join(lines)) + tag("tbody", join(body))
    attributes = {"class_": class_} if class_ else {}
    return tag("div", tag("table", Html(inner), **attributes), class_="wide")


class Marked(list):
    """A row with a class of its own."""

    def __init__(self, mark: str, cells: Sequence[object]):
        super().__init__(cells)
        self.mark = mark


LONG_FACT = 60  # characters: three lines of a column


def facts(pairs: Iterable[tuple[object, object]]) -> Html:
    """Names and values side by side; a long value has a line of its own."""
    parts = []
    for name, value in pairs:
        mark = {"class_": "long"} if len(str(value)) > LONG_FACT else {}
        parts.append(tag("div", join([tag("dt", name), tag("dd", value)]), **mark))
    return tag("dl", join(parts), class_="facts")


def folded(summary: object, content: object) -> Html:
    """Content that opens on a click (and is open in print)."""
    return tag("details", join([tag("summary", summary), content]))


def _cell(name: str, column: int, content: object, text_columns: Sequence[int]) -> Html:
    return tag(name, content) if column in text_columns else tag(name, content, class_="n")

"""A page taken apart: its tables, its links, whether every element is closed."""

from __future__ import annotations

from html.parser import HTMLParser

VOID = {"meta", "br", "hr", "img", "input", "link"}


class Page(HTMLParser):
    """Reads a page whole. ``text`` is without scripts and styles; ``sections`` holds the text of
    each by id.
    """

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[tuple[str, str]] = []
        self.handlers: list[str] = []
        self.rows: dict[str, list[list[str]]] = {}
        self.sections: dict[str, str] = {"": ""}
        self.styles = ""
        self.charts = 0
        self._section = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        self.links += [
            (tag, given[name] or "")
            for name in ("src", "href", "action", "data", "poster", "srcset")
            if name in given
        ]
        self.handlers += [name for name in given if name.startswith("on")]
        self.charts += given.get("class") == "chart"
        if tag == "section":
            self._section = given["id"]
            self.sections[self._section] = ""
        if tag == "tr":
            self.rows.setdefault(self._section, []).append([])
        if tag in ("td", "th"):
            self.rows[self._section][-1].append("")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in VOID:
            return
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()
        if tag == "section":
            self._section = ""

    def handle_data(self, data: str) -> None:
        if "style" in self.open:
            self.styles += data
        elif "script" not in self.open:
            self.sections[self._section] += data
            if {"td", "th"} & set(self.open):
                self.rows[self._section][-1][-1] += data

    def table_row(self, section: str, first: str) -> list[str]:
        """The first row of a section whose first cell begins so."""
        return next(row for row in self.rows[section] if row and row[0].startswith(first))

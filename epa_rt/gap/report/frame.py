"""The frame of every page about a gap: title, header, links to its sections, style."""

from collections.abc import Sequence
from importlib.resources import files
from string import Template

from epa_rt.report.markup import Html, join, tag


def framed(title: str, header: Html, sections: Sequence[tuple[str, str, Html]]) -> str:
    """A self-contained HTML page: nothing in it is fetched, and it runs no script. ``sections``: of
    each its key, title and content; those without content are left out.
    """
    sections = [one for one in sections if one[2]]
    links = join((tag("a", heading, href=f"#{key}") for key, heading, _ in sections), " ")
    body = join(
        tag("section", join([tag("h2", heading), content]), id=key)
        for key, heading, content in sections
    )
    place = files("epa_rt.gap.report")
    style = files("epa_rt.report").joinpath("page.css").read_text("utf-8") + place.joinpath(
        "gap.css"
    ).read_text("utf-8")
    return Template(place.joinpath("gap.html").read_text("utf-8")).substitute(
        title=tag("title", title),
        style=style,
        header=tag("header", header),
        navigation=tag("nav", links),
        sections=body,
    )

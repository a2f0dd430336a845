"""One self-contained HTML page for one run."""

from collections.abc import Callable, Sequence
from functools import partial
from importlib.resources import files
from string import Template

from epa_rt.report.markup import Html, join, paragraph, tag
from epa_rt.report.run import NotShown, Run
from epa_rt.report.sections.asked import asked
from epa_rt.report.sections.energy import energy
from epa_rt.report.sections.events import events
from epa_rt.report.sections.happened import happened
from epa_rt.report.sections.header import header
from epa_rt.report.sections.health import health
from epa_rt.report.sections.loops import loops
from epa_rt.report.sections.pressures import pressures
from epa_rt.report.sections.provenance import provenance
from epa_rt.report.sections.section import Section
from epa_rt.report.sections.timing import timing
from epa_rt.report.sections.tracking import tracking
from epa_rt.report.sections.valves import valves

TITLES = {
    "asked": "What was asked",
    "happened": "What happened",
    "tracking": "Tracking",
    "pressures": "Pressures",
    "loops": "Force against travel",
    "valves": "Valve switchings",
    "energy": "Energy",
    "timing": "Timing",
    "health": "Health",
    "events": "Events",
    "provenance": "Provenance",
}


def run_page(run: Run, winding_ohm: float | None = None) -> str:
    """The report of a run. ``winding_ohm``: the motor's winding, where it is known."""
    makers: dict[str, Callable[[Run], Section]] = {
        "asked": asked,
        "happened": happened,
        "tracking": tracking,
        "pressures": pressures,
        "loops": loops,
        "valves": valves,
        "energy": partial(energy, winding_ohm=winding_ohm),
        "timing": timing,
        "health": health,
        "events": events,
        "provenance": provenance,
    }
    sections = [_made(key, make, run) for key, make in makers.items()]
    title = f"{run.facts.get('experiment', 'run')} on {run.facts.get('rig', 'rig')}: {run.outcome}"
    return page(title, header(run), sections)


def page(title: str, head: Html, sections: Sequence[Section]) -> str:
    """A page with plotly.js inside, so that it needs no network."""
    links = join((tag("a", section.title, href=f"#{section.key}") for section in sections), " ")
    body = join(
        tag("section", join([tag("h2", section.title), section.content]), id=section.key)
        for section in sections
    )
    place = files("epa_rt.report")
    return Template(place.joinpath("page.html").read_text("utf-8")).substitute(
        title=tag("title", title),
        style=place.joinpath("page.css").read_text("utf-8"),
        plotly=_plotly(),
        header=tag("header", head),
        navigation=tag("nav", links) if len(sections) > 1 else "",
        sections=body,
    )


def _made(key: str, make: Callable[[Run], Section], run: Run) -> Section:
    """A section, or the sentence why there is none: half a log must still give a page."""
    if not len(run.t_s) and key not in ("asked", "events", "provenance"):
        return Section(key, TITLES[key], paragraph("Not shown: the log holds no whole sample."))
    try:
        return make(run)
    except NotShown as error:
        return Section(key, TITLES[key], paragraph(f"Not shown: {error}."))
    except KeyError as error:
        return Section(
            key, TITLES[key], paragraph(f"Not shown: the log has no signal {error.args[0]}.")
        )


def _plotly() -> str:
    # read as a file: importing plotly takes a second, and nothing else of it is used
    return files("plotly").joinpath("package_data", "plotly.min.js").read_text("utf-8")

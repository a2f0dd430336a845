"""The events, filtered by typing."""

from epa_rt.logs.reader import Event
from epa_rt.report.markup import Marked, folded, join, note, paragraph, table, tag
from epa_rt.report.run import Run
from epa_rt.report.sections.section import Section
from epa_rt.report.shown import count

MOST_ROWS = 300
GRAVE = ("trip", "error", "failure", "failed", "brake")


def events(run: Run) -> Section:
    """At most ``MOST_ROWS`` of them: the first, the last, and every grave one."""
    chosen = chosen_events(run.events)
    left = len(run.events) - len(chosen)
    rows = [_row(run, event) for event in chosen]
    more = (
        f" {left:,} more, from the middle of the run, are not shown; “epa info --events” lists all."
        if left
        else ""
    )
    field = tag(
        "label",
        join(
            [
                "Show only events with ",
                tag("input", "", type="search", class_="filter", aria_label="filter events"),
            ]
        ),
    )
    content = [
        paragraph(field),
        note(f"Times are since the first cycle.{more}"),
        table(("Time, s", "Cycle", "Kind", "What"), rows, (2, 3), "events"),
    ]
    return Section(
        "events",
        "Events",
        folded(f"{count(len(run.events), 'event')}, {len(chosen):,} shown", join(content)),
    )


def chosen_events(found: list[Event], most: int = MOST_ROWS) -> list[Event]:
    """All where they fit; else the first and last ones, with the grave ones between (as many as
    fit).
    """
    if len(found) <= most:
        return found
    grave = [i for i, event in enumerate(found) if event.kind in GRAVE][: most // 3]
    rest = most - len(grave)
    first = (
        set(range(rest * 2 // 3))
        | set(grave)
        | set(range(len(found) - (rest - rest * 2 // 3), len(found)))
    )
    return [found[i] for i in sorted(first)]


def _row(run: Run, event: Event) -> list[object]:
    text = event.text or event.kind
    cells = [f"{run.event_s(event):.3f}", f"{event.cycle:,}", event.kind, text]
    return Marked("grave", cells) if event.kind in GRAVE else cells

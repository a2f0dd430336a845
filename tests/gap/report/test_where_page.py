"""The page of where alone: whole, safe to open, and it says what was found and names no cause."""

from dataclasses import replace

from epa_rt.gap.report.where_page import Located, where_page
from tests.gap.report.answers import EXPLAINED, NOT_IN_CATALOGUE
from tests.gap.report.test_page import HOSTILE
from tests.report.reading import Page

FOUND = Located(
    (),
    EXPLAINED.location,
    (),
    (),
    {"rig": "bench.yaml", "plant": "plant.yaml", "logs": ["a.mcap", "b.mcap"]},
)


def headline(found):
    return where_page(found).partition("<h1>")[2].partition("</h1>")[0]


def test_the_page_is_whole_and_says_which_link_shows_most():
    text = where_page(FOUND)
    page = Page(text)
    worst = max(FOUND.location, key=lambda place: place.times_floor)
    assert (
        not page.open
        and not page.handlers
        and "<script" not in text
        and list(page.sections)[1:] == ["where", "inputs"]
    )
    assert worst.link in headline(FOUND) and "a.mcap, b.mcap" in page.sections["inputs"]
    assert "epa gap diagnose asks for that" in text


def test_it_says_whether_the_plant_file_was_refitted():
    freely = replace(FOUND, free_run_location=FOUND.location)
    refitted, as_is = where_page(freely), where_page(replace(freely, as_is=True))
    assert "parameters fitted to that" in refitted and "parameters fitted to that" not in as_is
    assert "have been refitted" in refitted and "nothing refitted" not in refitted
    assert "nothing refitted" in as_is and "have been refitted" not in as_is


def test_where_nothing_shows_it_says_so():
    quiet = tuple(
        replace(place, times_floor=1.1, excess=0.0, significance=0.5) for place in FOUND.location
    )
    at_floor = replace(FOUND, location=quiet)
    assert "Every block is at its noise floor." in where_page(at_floor)
    assert "at its noise floor." not in headline(
        replace(FOUND, location=tuple(replace(place, significance=50.0) for place in quiet))
    )
    assert "the whole plant is not" in headline(replace(at_floor, free_run_location=FOUND.location))
    assert "No link of this rig could be judged" in headline(
        replace(FOUND, location=tuple(replace(place, times_floor=float("nan")) for place in quiet))
    )
    assert "No link of this rig could be judged" in where_page(replace(FOUND, location=()))


def test_what_was_found_in_the_logs_stands_first_and_cannot_become_markup():
    text = where_page(
        replace(FOUND, found_first=(HOSTILE,), inputs={**FOUND.inputs, "rig": HOSTILE})
    )
    assert (
        "<img" not in text
        and "<script" not in text
        and text.index("Found in the logs first") < text.index("<h1>")
    )


def test_where_it_may_come_from_is_shown_on_the_map():
    where = Page(where_page(replace(FOUND, origins=NOT_IN_CATALOGUE.origins))).sections["where"]
    assert NOT_IN_CATALOGUE.origins[0].says in where and "Where it comes from" in where

"""Shares that say something: none above the whole, none of thousands of per cent below nothing."""

from dataclasses import replace
from io import StringIO

import pytest
from rich.console import Console

from epa_rt.gap.diagnosis import Remainder
from epa_rt.gap.report.far import how_far
from epa_rt.gap.report.head_words import far_words
from epa_rt.gap.report.left_words import ends_words, explained_words, goes_with
from epa_rt.gap.report.page import gap_page
from epa_rt.gap.report.rest import remainder
from epa_rt.gap.report.terminal import show
from epa_rt.gap.report.words import share_words
from tests.gap.report.answers import EXPLAINED, GONE, NOT_IN_CATALOGUE, SLIP, shrunk

BELOW_THE_FLOOR = Remainder(
    "pressure",
    "p_pa",
    "Pa",
    1214.0,
    86.6,
    (
        ("pressure_pa, slowly forgotten", 1.39),
        ("hold_time_s", 0.076),
        ("rate of pressure_pa", 0.065),
    ),
    1.55,
    1.0035,
)


def said(diagnosis) -> str:
    out = Console(highlight=False, markup=False, width=160, file=StringIO())
    show(diagnosis, out)
    return out.file.getvalue()


def test_no_state_explains_more_than_all_of_what_is_left():
    """A floor that holds more noise than the logs have: chi-square falls by 1.55 of its excess over
    that floor.
    """
    shares = dict(goes_with(BELOW_THE_FLOOR))
    assert (
        shares["pressure_pa, slowly forgotten"] == pytest.approx(1.39 / 1.55)
        and sum(shares.values()) <= 1.0
    )
    answer = replace(NOT_IN_CATALOGUE, remainder=(BELOW_THE_FLOOR,))
    assert "goes with pressure, slowly forgotten 90 %, hold time 5 %" in said(answer)
    page = str(remainder(answer))
    assert "139 %" not in page and "155 %" not in page and "100.4 %" not in page
    assert (
        explained_words(BELOW_THE_FLOOR)
        == "States explain 100 % of what lies above the floor. The named effects explain all of"
        " what a description by data alone could have explained at first."
    )


def test_shares_that_stay_below_the_whole_are_what_they_were():
    left = NOT_IN_CATALOGUE.remainder[0]
    assert goes_with(left) == list(left.depends_on)


def test_what_got_much_worse_is_said_in_multiples_of_the_floor():
    rows = tuple(
        shrunk(channel, unit, 1.46 * floor, 7.57 * floor, floor, "teacher_forced", baseline)
        for channel, unit, floor in (("all channels", "x floor", 1.0), ("joint_rad", "rad", 5e-4))
        for baseline in ("refitted", "plant_file")
    )
    assert rows[0].closed_share < -40.0 and share_words(rows[0]) == "worse: 1.5 × → 7.6 × floor"
    for answer in (replace(EXPLAINED, shrinkage=rows), replace(NOT_IN_CATALOGUE, shrinkage=rows)):
        text, page = said(answer), str(how_far(answer))
        for words in (text, page):
            assert (
                "worse: 1.5 × → 7.6 × floor" in words and "−48" not in words and "−49" not in words
            )
        assert "floor closed" not in page.replace("</strong>", "")
    assert (
        far_words(replace(NOT_IN_CATALOGUE, shrinkage=rows))
        == "worse by refitting nominal parameters: 1.5 × → 7.6 × floor"
    )


def test_a_little_worse_stays_a_share():
    assert share_words(shrunk("joint_rad", "rad", 17.0, 18.0, 1.0, "teacher_forced")).startswith(
        "−12 % ("
    )


def test_a_number_at_the_end_of_its_law_is_said_beside_the_name_with_the_floors_that_are_left():
    """'Explained' with 37 % of confidence, heat_ratio at its bound and 9.9 floors left read like
    any other answer.
    """
    ratio, reach = SLIP.parameters
    at_end = replace(
        EXPLAINED, effects=(replace(SLIP, parameters=(ratio, replace(reach, at_end=True))),)
    )
    words = ends_words(at_end)
    assert words.startswith("muscle0.slip_reach_m = 1.9") and words.endswith(
        "stands at the end of the range of its law; 1.2 × floor left block by block"
    )
    assert (
        words in said(at_end)
        and words in gap_page(at_end)
        and "muscle0.slip_reach_m at the end of the range of its law" in gap_page(at_end)
    )
    assert "the range of its law" not in said(EXPLAINED) + gap_page(EXPLAINED)
    assert (
        ends_words(
            replace(EXPLAINED, effects=(replace(GONE, parameters=(replace(ratio, at_end=True),)),))
        )
        == ""
    )

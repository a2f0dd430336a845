"""The page of a diagnosis: whole, self-contained, safe to open, and it says what the diagnosis
says.
"""

from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from epa_rt.gap.diagnosis import Could, Diagnosis, Posterior
from epa_rt.gap.report.curves import path, ticks
from epa_rt.gap.report.gate import gate_line
from epa_rt.gap.report.head_words import next_words
from epa_rt.gap.report.map import AT_FLOOR, _regions, heat
from epa_rt.gap.report.page import gap_page
from epa_rt.gap.report.picture import gap_picture
from epa_rt.gap.report.terminal import console, show
from epa_rt.gap.report.traces import alongside_trace, traces
from tests.gap.damper import Damper, recorded, white_floor
from tests.gap.report.answers import ANSWERS, EXPLAINED, GATE, GONE, NOT_SEPARABLE, SLIP, curves
from tests.report.reading import Page

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&"


@pytest.mark.parametrize("which", ANSWERS)
def test_every_verdict_gives_a_whole_page(which):
    page = Page(gap_page(ANSWERS[which], curves()))
    assert not page.open and list(page.sections)[1:4] == ["where", "seen", "which"]
    assert ANSWERS[which].says in gap_page(ANSWERS[which])


@pytest.mark.parametrize(
    ("verdict", "none", "law", "word"),
    [
        ("no_gap", 0.6, 0.2, "No gap"),
        ("no_gap", 0.4, 0.5, "Left open"),
        ("not_in_catalogue", 0.05, 0.25, "Not in the catalogue"),
        ("not_in_catalogue", 0.05, 0.6, "Left open"),
    ],
)
def test_what_the_logs_leave_open_is_not_headed_by_an_answer(verdict, none, law, word):
    models = (Could((), none, 1.0), Could(("leak",), law, 0.1))
    could = Posterior(models, {"leak": law}, 1 - none - law, "blocks", verdict, {}, (), 1)
    said = replace(EXPLAINED, verdict=verdict, effects=(), posterior=could)
    page, out = gap_page(said), console()
    assert f"Sim-to-real gap: {word.lower()}" in page
    looks = "good" if word == "No gap" else "open"
    assert f'<span class="badge {looks}">{word}</span>' in page
    with out.capture() as shown:
        show(said, out)
    assert f"{word.upper()}: " in shown.get()


def test_the_page_needs_no_network_and_runs_no_script():
    text = gap_page(EXPLAINED, curves())
    page = Page(text)
    assert all(target.startswith("#") for _, target in page.links)
    assert "<script" not in text and "url(" not in text and "@import" not in text
    assert not page.handlers and len(text) < 300_000


def test_text_from_logs_and_files_cannot_become_markup():
    hostile = replace(
        NOT_SEPARABLE,
        says=HOSTILE,
        found_first=(HOSTILE,),
        effects=(replace(SLIP, name=HOSTILE, not_separable_from=(HOSTILE,)),),
        location=tuple(
            replace(place, link=HOSTILE, block=HOSTILE, state={HOSTILE: 2.0})
            for place in EXPLAINED.location
        ),
        next_experiment=replace(NOT_SEPARABLE.next_experiment, file=HOSTILE, says=HOSTILE),
        inputs={HOSTILE: HOSTILE},
        gate=GATE | {"log": HOSTILE},
        not_tested=(HOSTILE,),
    )
    text = gap_page(hostile, [replace(curves()[0], title=HOSTILE, log=HOSTILE)])
    assert "<script" not in text and "<img" not in text and not Page(text).handlers


def test_what_was_found_in_the_logs_stands_before_the_verdict():
    text = gap_page(NOT_SEPARABLE)
    assert text.index("cycles are missing") < text.index("<h1>") < text.index("Which effect")


def test_the_map_marks_the_block_of_the_effect_and_says_what_is_not_measured():
    where = Page(gap_page(EXPLAINED)).sections["where"]
    assert "not measured on its own" in where and "braid maxwell slip" in where
    assert "reversal of muscle speed" in where and "20 ×" in where


def test_the_page_speaks_no_statistics_without_saying_what_it_is():
    which = Page(gap_page(EXPLAINED)).sections["which"]
    assert "chi-square" not in gap_page(EXPLAINED) and "units of noise" not in which
    assert (
        "probability that the rig has an effect of its family and the plant file does not" in which
        and "each divided by the rms of the noise, by 48,210" in which
    )


def test_an_effect_that_only_the_plant_file_has_is_said_to_be_taken_out():
    text = gap_page(replace(EXPLAINED, effects=(GONE,)))
    page = Page(text)
    assert "braid maxwell slip (in the plant file, not in the rig)" in page.sections["where"]
    assert (
        "the patched plant file is without it" in page.sections["which"]
        and "0.5000" not in page.sections["which"]
    )
    picture = gap_picture(replace(EXPLAINED, effects=(GONE,)), curves()[0])
    assert (
        "not in the rig).</text>" in picture and "The plant file was patched accordingly" in picture
    ), "two lines where one would be cut"


def test_the_gate_shows_no_share_of_noise():
    quiet = GATE["channels"][1] | {
        "channel": "muscle_pressure_pa",
        "unit": "Pa",
        "before": 285.0,
        "after": 197.0,
        "floor": 245.0,
        "achieved_share": 1.98,
        "points": 58.0,
    }
    gate = Page(
        gap_page(replace(EXPLAINED, gate=GATE | {"channels": [*GATE["channels"], quiet]}))
    ).sections["gate"]
    assert "at the floor" in gate and "198 %" not in gate and "58" not in gate and "98.6 %" in gate


def test_a_gate_without_a_promise_is_not_judged_and_says_why():
    none = GATE | {
        "passed": None,
        "predicted_share": None,
        "points": None,
        "not_judged": "nothing was predicted",
    }
    for says in (Page(gap_page(replace(EXPLAINED, gate=none))).sections["gate"], gate_line(none)):
        assert (
            "not judged: nothing was predicted" in says
            and "not passed" not in says.lower().split("passed where")[0]
        )
        assert "closes 98.5 % of the gap" in says and "predicted –" not in says.lower()


def test_the_gate_says_of_which_trials_its_shares_are():
    part = GATE | {"trials": 1}
    assert "98.5 % of the gap over the trial set aside (predicted 97 %)" in gate_line(
        part
    ) and "set aside" not in gate_line(GATE)
    assert (
        "97 % of the gap closed over the trial set aside"
        in Page(gap_page(replace(EXPLAINED, gate=part))).sections["gate"]
    )
    assert "over the trial set aside" in gap_picture(replace(EXPLAINED, gate=part), curves()[0])


def test_colour_grows_with_the_gap_and_starts_above_the_floor():
    values = [heat(x) for x in (0.5, 1.0, AT_FLOOR, 1.5, 3.0, 10.0, 30.0, 1000.0)]
    assert (
        values[:3] == [0.0, 0.0, 0.0]
        and values == sorted(values)
        and values[-1] == values[-2] == 1.0
    )
    assert heat(float("nan")) == 0.0


def test_a_diagnosis_of_nothing_gives_a_page():
    assert not Page(gap_page(Diagnosis("no_gap", "Nothing."))).open


@pytest.mark.parametrize(
    "low, high", [(0.0, 1.0), (-5.3, 4.9), (80.0, 160.0), (1e-7, 3e-7), (0.0, 0.0)]
)
def test_ticks_are_round_and_inside(low, high):
    found = ticks(low, high)
    assert found and all(low - 1e-12 <= tick <= high + 1e-12 for tick in found) and len(found) <= 11


def test_a_gap_in_the_data_is_a_gap_in_the_curve():
    values = np.array([0.0, 1.0, np.nan, 1.0, 0.0])
    assert path(np.arange(5.0), values, (0.0, 4.0), (0.0, 1.0)).count("M") == 2


def test_curves_are_of_the_channel_with_the_gap_and_after_is_closer():
    truth = {"muscle.coulomb_n": 1.0}
    alongside, left = traces(Damper(), [recorded(truth)], {}, truth, {"damper": white_floor()})
    assert "force_n" in alongside.title and not alongside.is_error and left.is_error
    for trace in (alongside, left):
        by = {kind: values for _, kind, values in trace.lines}
        real = by.get("measured", 0.0)
        assert np.nanstd(real - by["before"]) > 3.0 * np.nanstd(real - by["after"])
        assert len(trace.t_s) == len(by["before"])


def test_the_picture_stands_alone_and_says_what_was_closed_over_the_whole_log():
    from xml.etree import ElementTree

    text = gap_picture(EXPLAINED, curves()[0])
    words = [
        "".join(node.itertext())
        for node in ElementTree.fromstring(text).iter("{http://www.w3.org/2000/svg}text")
    ]
    assert (
        "98.6 %" in words
        and "over all trials of the log" in words
        and any("braid maxwell slip" in one for one in words)
    )
    alone = gap_picture(replace(EXPLAINED, gate=None), curves()[0])
    assert "in these seconds" in alone and "on the recorded commands" in alone


def test_a_law_of_the_same_family_that_cannot_be_told_apart_leaves_an_experiment_to_be_looked_for():
    page = Page(
        gap_page(replace(EXPLAINED, effects=(replace(SLIP, not_separable_from=("braid_dahl",)),)))
    )
    assert "Cannot be told apart from braid dahl" in page.sections["which"]
    assert (
        "tells braid maxwell slip from braid dahl: epa gap plan looks for it"
        in page.sections["next"]
        and "None is needed" not in page.sections["next"]
    )
    assert (
        next_words(EXPLAINED) == "none needed"
        and "None is needed" in Page(gap_page(EXPLAINED)).sections["next"]
    )


def test_the_plant_before_is_called_what_it_is():
    """The page draws the refitted plant, which the shares are of; the picture of the gate the plant
    file as it stands.
    """
    truth = {"muscle.coulomb_n": 1.0}
    real, before, after, twin = (
        recorded(truth),
        *(
            Damper().free_run(recorded(truth), values, seed)
            for values, seed in (({}, None), (truth, None), (truth, 1))
        ),
    )
    refitted, left = traces(Damper(), [real], {}, truth, {"damper": white_floor()})
    believed = alongside_trace(Damper(), real, before, after, twin)
    named = {kind: words for words, kind, _ in (*left.lines, *refitted.lines)}
    assert (
        named["before"] == "the plant with nominal parameters refitted"
        and left.lines[0][0] == "before, with nominal parameters refitted"
    )
    assert (
        "refitted" not in believed.title
        and "the plant as believed" in believed.title
        and "as believed" not in gap_page(EXPLAINED, [refitted, left])
    )
    alone, gated = (
        gap_picture(replace(EXPLAINED, gate=None), refitted),
        gap_picture(EXPLAINED, believed),
    )
    assert (
        "simulation, refitted" in alone
        and "before: nominal parameters refitted, no effect" in alone
        and "as believed" not in alone
    )
    assert "simulation, as believed" in gated and "refitted" not in gated


def test_a_difference_of_pressures_is_neither_absolute_nor_gauge():
    gas = replace(curves()[0], title="muscle_pressure_pa: the rig", unit="Pa")
    text = gap_picture(EXPLAINED, gas)
    assert (
        "muscle pressure, kPa abs<" in text
        and "rig minus simulation, kPa (grey" in text
        and "rms of what is left, kPa<" in text
    )


def test_page_and_terminal_say_which_laws_of_the_family_say_the_same_with_more_numbers(capsys):
    words = (
        "raid preisach and braid lugre, of the same family, say the same of these logs with more"
        " numbers"
    )
    more = replace(
        EXPLAINED, effects=(replace(SLIP, in_more_numbers=("braid_preisach", "braid_lugre")),)
    )
    assert f"B{words}." in unescape(gap_page(more)) and words not in unescape(gap_page(EXPLAINED))
    show(more, console())
    assert f"{SLIP.name.replace('_', ' ')}: b{words}" in " ".join(capsys.readouterr().out.split())


def test_the_page_says_what_an_error_of_each_place_would_explain():
    page = unescape(gap_page(ANSWERS["not_in_catalogue"]))
    words = "It may come from a muscle's force, its line's stretch or its volume (100 %)"
    assert words in page and "6.2 \u03c3" in page and "what flows into a muscle" not in page
    assert "It may come from" not in gap_page(ANSWERS["explained"])


def test_a_link_that_stands_for_another_block_is_shown_once_and_that_block_is_marked():
    from epa_rt.gap.where.origin import origin_first

    told = ANSWERS["not_in_catalogue"]
    cell = replace(
        told.origins[0], place="force_cell", block="load", says="the reading of the force"
    )
    told = replace(
        told, origins=(cell, *told.origins[1:]), location=origin_first(told.location, (cell,))
    )
    assert (
        told.location[0].block == "load"
        and len(told.location) == len(ANSWERS["not_in_catalogue"].location) + 1
    )
    page = gap_page(told)
    assert "from the reading of the force?" in page
    shown = told.location[0].link
    assert (
        page.count(f'<span class="name">{shown}</span>')
        == gap_page(ANSWERS["not_in_catalogue"]).count(f'<span class="name">{shown}</span>')
        == 1
    )


def test_where_no_place_explains_the_gap_the_page_says_so():
    weak = replace(
        ANSWERS["not_in_catalogue"],
        origins=tuple(replace(one, gain=20.0) for one in ANSWERS["not_in_catalogue"].origins),
    )
    assert "what it comes from cannot be told" in gap_page(weak)
    both = replace(
        weak,
        origins=tuple(
            replace(one, gain=2000.0, explained_share=0.9, behind=min(one.behind, 1.0))
            for one in weak.origins[:2]
        ),
    )
    assert "or its volume (90 %) or the way that the spool gives the lines (90 %)" in unescape(
        gap_page(both)
    )


def test_a_region_never_stands_without_the_other_side_of_its_quantity():
    state = {
        f"{name} {side}": 5.0 + k
        for k, name in enumerate(
            ("length_m", "pressure_pa", "force_n", "heat_k", "time", "travel_m", "load_n")
        )
        for side in ("low", "high")
    }
    state |= {
        "speed_m_s > 0": 53.0,
        "speed_m_s < 0": 52.0,
        "speed_m_s near 0": 3.0,
        "reversal of speed_m_s": 50.0,
    }
    rows = _regions([replace(EXPLAINED.location[0], state=state)])
    assert {"speed_m_s > 0", "speed_m_s < 0", "speed_m_s near 0", "reversal of speed_m_s"} <= set(
        rows
    ) and len(rows) == 14
    assert all(name.replace("low", "high") in rows for name in rows if name.endswith("low"))

"""The page and the terminal say what the answer holds."""

import io
import math
import re

import pytest
from rich.console import Console

from epa_rt.identify.identify import Asked, identify_trials
from epa_rt.identify.report.curves import cloud, forces, stretches
from epa_rt.identify.report.identified import best, residual_figures
from epa_rt.identify.report.page import identify_page
from epa_rt.identify.report.terminal import show
from epa_rt.identify.report.words import coefficients, condition, number
from tests.identify.made import SLIP, made, params


@pytest.fixture(scope="module")
def found():
    trials = made(params(SLIP), 2, 8.0, 2.4)
    answer, data = identify_trials(trials, params())
    return answer, trials, data


def test_the_terminal_shows_every_model_and_every_way(found):
    text = io.StringIO()
    show(found[0], Console(file=text, width=200))
    for name in (
        *(score.name for score in found[0].scores),
        *(way.name for way in found[0].selected),
        "loop work",
        "normalised",
        "0.971",
    ):
        assert name in text.getvalue()


def test_a_terminal_of_80_columns_cuts_no_figure(found):
    text = io.StringIO()
    show(found[0], Console(file=text, width=80))
    assert "…" not in text.getvalue()
    assert all(len(line) <= 80 for line in text.getvalue().splitlines())
    for score in found[0].scores:
        row = next(x for x in text.getvalue().splitlines() if x.strip().startswith(score.name))
        assert f"{score.r2:.3f}" in row
    rows = [x.split() for x in text.getvalue().splitlines()]
    for score in found[0].scores:  # the last figure of the second table is whole
        if math.isfinite(score.condition):
            words = score.name.split()
            last = condition(score.condition)
            assert any(row[: len(words)] == words and row[-1] == last for row in rows)


def test_the_page_shows_every_model_and_every_picture(found):
    page = identify_page(*found)
    body = page.split("<main>")[1]
    for score in found[0].scores:
        assert f"<td>{score.name}</td>" in body and f'<td class="n">{number(score.r2)}</td>' in body
    assert body.count('"type":"scatter3d"') == 2 and len(re.findall(r"<figure>", body)) == 10


def test_a_trial_alone_has_a_page_too(found):
    _, trials, _ = found
    answer, data = identify_trials(trials[:1], params(), Asked(physical=False, terms=False))
    page = identify_page(answer, trials[:1], data)
    assert (
        "one no-load pressure only" in page
        and "NaN" not in page.split("<main>")[1].split("</main>")[0]
    )


def test_clouds_are_thinned_and_stretches_are_of_the_trial(found):
    answer, trials, data = found
    few = cloud(answer, trials, data, "polynomial", 1000)
    assert (
        len(few.force_n) == 1000
        and few.force_n[0] == trials[0].force_n[0]
        and few.model_n[0] == forces(answer, "polynomial", trials[0], data[0])[0]
    )
    lowest, highest = stretches(answer, trials, data)
    assert lowest.p0_kpa < highest.p0_kpa and len(lowest.time_s) == 500 == len(
        lowest.models.get("physical", lowest.force_n)
    )


def test_figures_have_the_digits_that_their_intervals_are_worth(found):
    rows = {
        row[0]: row
        for row in coefficients(next(s for s in found[0].scores if s.name == "physical"))
    }
    assert rows["braid length"][3] == "mm" and float(rows["braid length"][1]) == pytest.approx(
        207.8, rel=1e-3
    )
    assert rows["viscous"][3] == "N s/m" and len(rows["viscous"][1]) <= 5
    assert (condition(1.0), condition(23.4), condition(1.2e6)) == ("–", "23", "1e6")


def test_the_page_leads_with_what_is_identified_and_what_it_leaves(found):
    answer, trials, data = found
    body = identify_page(*found).split("<main>")[1]
    chosen = best(answer)
    assert body.index("What is identified") < body.index("What it leaves") < body.index("Models")
    lead = body[: body.index("What it leaves")]
    for shown in (chosen.name, *(row[0] for row in coefficients(chosen))):
        assert shown in lead
    few = cloud(answer, trials, data, chosen.name, 1000)
    for figure in residual_figures(few, chosen.name):
        low, high = figure.layout["yaxis"]["range"]
        assert low < (few.force_n - few.model_n).min() < (few.force_n - few.model_n).max() < high

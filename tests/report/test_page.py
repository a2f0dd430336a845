"""The page of a run: right figures, whole, self-contained, safe to open."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from epa_rt.logs.reader import Event, LogReader
from epa_rt.report import charts
from epa_rt.report.markup import facts
from epa_rt.report.page import run_page
from epa_rt.report.run import Run, load_run
from tests.report.reading import Page

WINDING_OHM = 1.03
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&"


@pytest.fixture(scope="module")
def bench_page(bench: Run) -> Page:
    return Page(run_page(bench, WINDING_OHM))


@pytest.fixture(scope="module")
def knee_page(knee: Run) -> Page:
    return Page(run_page(knee))


def test_a_long_value_has_a_line_of_its_own():
    assert 'class="long"' not in facts([("End", "at rest")])
    assert 'class="long"' in facts([("End", "motor travel 0.0 mm, " * 4)])


def trial_columns(log: Path, trial: int) -> dict[str, np.ndarray]:
    """The columns of one trial, cut out by the events and nothing of the report's own."""
    with LogReader(log) as reader:
        starts = [
            e for e in reader.events() if e.kind == "phase_start" and e.data["trial_index"] == trial
        ]
        end = next(
            e
            for e in reader.events()
            if e.kind == "phase_end" and e.data["index"] == starts[0].data["index"]
        )
        tables = reader.tables({"/measured": None, "/reference": None, "/command": None})
        begin = starts[0].data["cycle"]
        columns = {
            name: column[begin : end.data["cycle"]]
            for table in tables.values()
            for name, column in table.items()
        }
        before = tables["/measured"][
            (
                "muscle_pressure_pa"
                if "muscle_pressure_pa" in tables["/measured"]
                else "spam_pressure_pa"
            )
        ]
        return columns | {"before": before[begin - 500 : begin]}


def test_every_element_is_closed_and_every_section_is_there(
    bench_page: Page, knee_page: Page
) -> None:
    for page in (bench_page, knee_page):
        assert not page.open
        assert list(page.sections)[1:] == [
            "asked",
            "happened",
            "tracking",
            "pressures",
            "loops",
            "valves",
            "energy",
            "timing",
            "health",
            "events",
            "provenance",
        ]
        assert "Not shown" not in "".join(page.sections.values())


def test_nothing_is_fetched(bench_page: Page) -> None:
    assert all(target.startswith("#") for _, target in bench_page.links)
    assert "url(" not in bench_page.styles and "@import" not in bench_page.styles
    assert not bench_page.handlers


def test_the_page_is_small_enough_to_send(bench: Run) -> None:
    assert len(run_page(bench).encode()) < 6_000_000


def test_tracking_figures_are_those_of_the_columns(bench_log: Path, bench_page: Page) -> None:
    for trial in (0, 1):
        columns = trial_columns(bench_log, trial)
        error_mm = 1e3 * (columns["motor_travel_m"] - columns["ref_motor_travel_m"])
        row = bench_page.table_row("tracking", f"{trial + 1} (p0")
        assert row[2] == f"{np.sqrt(np.mean(error_mm**2)):.3g} mm"
        peak = float(error_mm[np.argmax(np.abs(error_mm))])
        assert row[3].replace("−", "-").startswith(f"{peak:+.3f} mm at ")


def test_knee_tracking_is_in_degrees(knee_log: Path, knee_page: Page) -> None:
    columns = trial_columns(knee_log, 0)
    error_deg = np.degrees(columns["knee_angle_rad"] - columns["ref_knee_angle_rad"])
    row = knee_page.table_row("tracking", "1")
    assert (row[1], row[2]) == ("knee angle", f"{np.sqrt(np.mean(error_deg**2)):.3f} deg")


def test_pressures_are_those_before_the_trial_in_the_kind_of_the_file(
    bench_log: Path, bench_page: Page
) -> None:
    for trial, target in ((0, 460.0), (1, 640.0)):
        start_pa = trial_columns(bench_log, trial)["before"].mean()
        row = bench_page.table_row("pressures", f"{trial + 1} (p0")
        assert row[2] == f"{target:.1f}"
        assert row[5] == f"{(start_pa - 101_325.0) / 1e3:.2f}"
        assert row[6].replace("−", "-") == f"{(start_pa - 101_325.0) / 1e3 - target:+.2f}"
    assert "P0 at start, kPa gauge" in bench_page.rows["pressures"][0]


def test_knee_pressures_are_absolute(knee_page: Page) -> None:
    assert "P0 at start, kPa abs" in knee_page.rows["pressures"][0]
    assert [row[2] for row in knee_page.rows["pressures"][1:3]] == ["185.0", "170.0"]


def test_energy_is_the_integral_of_the_squared_current(bench_log: Path, bench_page: Page) -> None:
    integral = np.sum(trial_columns(bench_log, 0)["motor_current_a"] ** 2) * 1e-3
    row = bench_page.table_row("energy", "1 (p0")
    assert float(row[2]) == pytest.approx(integral, rel=1e-3)
    assert float(row[3]) == pytest.approx(integral / 5.0, rel=1e-3)
    assert float(row[6]) == pytest.approx(integral * WINDING_OHM, rel=1e-3)
    assert "equation 9" in bench_page.sections["energy"]


def test_without_a_winding_there_is_no_copper_loss(knee_page: Page) -> None:
    assert "Copper loss, J" not in knee_page.rows["energy"][0]
    assert "not known" in knee_page.sections["energy"]


def test_valves_are_counted_from_the_commands(bench_log: Path, bench_page: Page) -> None:
    with LogReader(bench_log) as reader:
        inlet = reader.columns("/command", ["cmd_muscle_inlet_open"])["cmd_muscle_inlet_open"]
    row = bench_page.table_row("valves", "muscle")
    assert row[1:4] == ["inlet", str(np.count_nonzero(np.diff(inlet))), "0"]
    assert "No valve switched during a trial." in bench_page.sections["valves"]


def test_health_shows_the_range_of_each_signal(bench_log: Path, bench_page: Page) -> None:
    with LogReader(bench_log) as reader:
        force = reader.columns("/measured", ["muscle_force_n"])["muscle_force_n"]
    row = bench_page.table_row("health", "muscle_force_n")
    assert f"{force.max():.1f} N" in row[1] and "350.0" in row[1]
    assert row[3:5] == ["0", "0"]


def test_an_unpaced_simulation_says_that_it_has_no_timing(bench_page: Page) -> None:
    assert "Unpaced simulation: no timing." in bench_page.sections["timing"]


def test_a_tripped_run_shows_its_cause_before_anything_else(tripped_log: Path) -> None:
    run = load_run(tripped_log)
    head = Page(run_page(run)).sections[""]
    assert run.outcome == "tripped" and run.cause.startswith("over-force: muscle_force_n = ")
    assert "▲ tripped" in head
    assert head.index(run.cause) < head.index("Duration")
    assert "The last second before that" in head
    assert "1 cut short" in head


def test_a_cut_log_gives_a_page_that_says_what_is_missing(cut_log: Path) -> None:
    page = Page(run_page(load_run(cut_log)))
    assert (
        "the log is not whole" in page.sections[""]
        and "the file was cut at byte" in page.sections[""]
    )
    assert "1 of 2 begun" in page.sections[""] and "cut short" not in page.sections[""]
    assert "p0 = 460 kPa gauge" in page.sections["tracking"]


@pytest.mark.parametrize("share", [0.01, 0.02, 0.05, 0.1, 0.3, 0.9])
def test_a_log_cut_anywhere_after_its_head_gives_a_page(
    bench_log: Path, tmp_path: Path, share: float
) -> None:
    data = bench_log.read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: int(share * len(data))])
    assert "the file was cut" in Page(run_page(load_run(path))).sections["provenance"]


def test_hostile_text_stays_text(bench: Run) -> None:
    run = dataclasses.replace(
        bench,
        name=HOSTILE,
        cause=HOSTILE,
        outcome=HOSTILE,
        missing=[HOSTILE],
        events=[Event(5, 6_000_000, "trip", HOSTILE, {"signal": HOSTILE}), *bench.events],
        layout=dataclasses.replace(
            bench.layout,
            phases=tuple(HOSTILE for _ in bench.layout.phases),
            states=tuple(HOSTILE for _ in bench.layout.states),
        ),
        metadata=bench.metadata
        | {
            "run": {
                "experiment": HOSTILE,
                "rig": HOSTILE,
                "plant": HOSTILE,
                "seed": HOSTILE,
                "speed": HOSTILE,
            }
        },
        attachments=bench.attachments
        | {
            HOSTILE: b"x",
            "version.json": b'{"package": "</script><script>alert(1)</script>"}',
            "plant.yaml": HOSTILE.encode(),
        },
    )
    text = run_page(run)
    page = Page(text)
    assert not page.handlers and all(target.startswith("#") for _, target in page.links)
    assert "alert(1)</script>" not in text
    assert page.sections[""].count("alert(1)") >= 3


def test_no_text_in_a_picture_ends_its_script() -> None:
    markup = charts.embed(charts.Figure([{"name": HOSTILE}], {"title": HOSTILE}, 10, HOSTILE))
    assert markup.count("</script>") == 1 and "<img" not in markup


@pytest.mark.parametrize(
    "outcome, words",
    [
        ("died", "✕ died"),
        ("failed", "✕ failed"),
        ("stopped", "◼ stopped"),
        ("unknown", "? not known"),
    ],
)
def test_every_outcome_is_said_in_words_with_its_cause(
    bench: Run, outcome: str, words: str
) -> None:
    head = Page(
        run_page(dataclasses.replace(bench, outcome=outcome, cause="a cause of its own"))
    ).sections[""]
    assert words in head and "a cause of its own" in head


def test_a_description_with_markup_stays_text(bench: Run) -> None:
    text = (
        bench.attachments["experiment.yaml"]
        .decode()
        .replace("description: ", "description: <b onclick=x>bold</b> ")
    )
    page = Page(
        run_page(
            dataclasses.replace(
                bench, attachments=bench.attachments | {"experiment.yaml": text.encode()}
            )
        )
    )
    assert "<b onclick=x>bold</b>" in page.sections[""] and not page.handlers


@pytest.mark.parametrize("lacking", ["rig.yaml", "experiment.yaml", "plant.yaml", "version.json"])
def test_a_log_that_lacks_a_file_still_gives_a_page(bench: Run, lacking: str) -> None:
    attachments = {name: data for name, data in bench.attachments.items() if name != lacking}
    page = Page(run_page(dataclasses.replace(bench, attachments=attachments)))
    if lacking in ("rig.yaml", "experiment.yaml"):
        assert f"the log carries no {lacking}" in page.sections["tracking"]


def test_signals_that_are_gone_are_named(bench: Run) -> None:
    signals = {
        name: values for name, values in bench.signals.items() if name != "muscle_pressure_pa"
    }
    page = Page(run_page(dataclasses.replace(bench, signals=signals)))
    assert "Not shown: the log has no signal muscle_pressure_pa." in page.sections["pressures"]

"""epa run --dry: what would move is shown, nothing is recorded."""

import pytest

from epa_rt.cli.dry import narrow_table
from epa_rt.cli.main import main
from epa_rt.config.rig import load_rig
from epa_rt.experiments.dry import dry_run
from epa_rt.experiments.experiment import load_experiment
from epa_rt.report.dry import dry_rows
from tests.cli.shell import EXPERIMENTS, RIGS
from tests.report.reading import Page

PAIRS = [
    ("identification", "bench"),
    ("identification", "bench_analog"),
    ("knee_chirp", "knee"),
    ("mass_sine", "mass"),
    ("sealed_hold", "bench"),
    ("step", "bench"),
    ("multisine", "bench"),
    ("no_load_sweep", "bench"),
    ("repeat_and_rest", "bench"),
]


def dry(experiment, rig, out):
    return main(
        ["run", str(experiment), "--rig", str(RIGS / f"{rig}.yaml"), "--dry", "-o", str(out)]
    )


@pytest.mark.parametrize("experiment, rig", PAIRS)
def test_every_delivered_experiment_is_within_its_rig(experiment, rig, tmp_path, capsys):
    assert dry(EXPERIMENTS / f"{experiment}.yaml", rig, tmp_path) == 0
    text = capsys.readouterr().out
    assert "within every limit of the rig" in text and "FINDING" not in text
    assert [path.name for path in tmp_path.iterdir()] == [f"dry-{experiment}-{rig}.html"]


def test_the_table_says_range_speed_and_valves(tmp_path, capsys):
    dry(EXPERIMENTS / "identification_short.yaml", "bench", tmp_path)
    text = capsys.readouterr().out
    row = next(line for line in text.splitlines() if line.strip().startswith("trial"))
    for words in (
        "2",
        "5.000 s",
        "random speed: between 1 mm and 27 mm",
        "27.00 mm",
        "mm/s",
        "%",
        "all: hold",
    ):
        assert words in row
    assert "p0 = 460 kPa gauge, 640 kPa gauge" in text


def test_a_narrow_terminal_gets_every_word_of_the_table_whole():
    experiment, rig = EXPERIMENTS / "identification.yaml", load_rig(RIGS / "bench.yaml")
    head, rows = dry_rows(dry_run(load_experiment(experiment, rig), rig), rig)
    text = narrow_table(head, rows)
    assert all(cell in text for row in rows for cell in row)
    figures = [line for line in text.splitlines() if not line.startswith("    ")]
    assert len(figures) == len(rows) + 1 and max(map(len, figures)) <= 80


def test_the_page_is_whole_and_names_the_limits(tmp_path):
    dry(EXPERIMENTS / "identification_short.yaml", "bench", tmp_path)
    text = (tmp_path / "dry-identification_short-bench.html").read_text()
    page = Page(text)
    assert (
        not page.open
        and page.charts == 1
        and all(target.startswith("#") for _, target in page.links)
    )
    assert "limit 31 mm" in text and "limit 780 kPa gauge" in text


def test_what_a_command_row_would_hold_back_is_a_finding_and_no_success(tmp_path, capsys):
    rig = tmp_path / "rigs" / "bench.yaml"
    rig.parent.mkdir()
    text = (RIGS / "bench.yaml").read_text()
    rig.write_text(text.replace("limits: [-80 mm/s, 80 mm/s]", "limits: [-30 mm/s, 30 mm/s]"))
    code = main(
        [
            "run",
            str(EXPERIMENTS / "identification_short.yaml"),
            "--rig",
            str(rig),
            "--dry",
            "-o",
            str(tmp_path / "out"),
        ]
    )
    out = capsys.readouterr().out
    assert (
        code == 1
        and "FINDING: trial: reaches a speed of" in out
        and "cmd_motor_speed_m_s is limited to 30 mm/s" in out
    )
    assert "▲ findings" in (tmp_path / "out" / "dry-identification_short-bench.html").read_text()


def test_a_folder_that_cannot_be_made_is_said_so(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert dry(EXPERIMENTS / "step.yaml", "bench", tmp_path / "file" / "out") == 2
    assert "in which nothing can be written" in capsys.readouterr().err

"""epa import --guess: right beside mappings by hand, or unsure where it is wrong."""

import guess_files
import guess_files_fresh
import pytest
from guess_score import score, table
from hypothesis import given
from hypothesis import strategies as st

from epa_rt.cli.main import main
from epa_rt.config.units import unit
from epa_rt.logs.importers.guess.draft import guess
from epa_rt.logs.importers.guess.units import unit_of
from epa_rt.logs.importers.guess.words import words_of
from epa_rt.logs.importers.mapping import load_mapping

SETS = {
    "conventions": guess_files.made,
    "other conventions": guess_files_fresh.made,
    "recordings of others": lambda folder: guess_files.real(0) + guess_files.real(1),
}
LEAST_SURE = {"conventions": 0.6, "other conventions": 0.5, "recordings of others": 0.3}
"""Items that are right without a doubt: one that doubts everything would pass the other check."""


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("name", SETS)
def test_a_guess_is_right_or_says_that_it_is_unsure(name, tmp_path):
    cases = SETS[name](tmp_path)
    if not cases:
        pytest.skip("the recordings of others are not beside the checkout (../shared)")
    results = {case.name: score(case, tmp_path) for case in cases}
    verdicts = [verdict for found in results.values() for _, verdict in found]
    assert "wrong" not in verdicts, table(results)
    assert verdicts.count("right") >= LEAST_SURE[name] * len(verdicts), table(results)


def test_the_draft_is_written_once_says_its_doubts_and_can_be_imported(tmp_path, capsys):
    path = tmp_path / "run.csv"
    lines = [f"{0.01 * k:.2f},{k % 7},{k * k % 11 / 10}" for k in range(50)]
    path.write_text("t,force,pressure\n" + "\n".join(lines) + "\n")
    out = tmp_path / "drafts" / "run.yaml"
    assert main(["import", "--guess", str(path), "-o", str(out)]) == 0
    said = capsys.readouterr().out.replace(str(tmp_path), "folder")  # as long as it may be
    assert "unsure: pressure_pa: gauge or abs" in " ".join(said.split())
    assert "tried: 50 rows" in said and all(len(line) < 200 for line in said.splitlines())
    text = out.read_text()
    assert "pressure_pa: {column: pressure, unit: bar gauge}  # unsure:" in text
    assert load_mapping(out)[0].clock.period == 0.01
    assert main(["import", "--guess", str(path), "-o", str(out)]) == 2
    assert "found a file" in capsys.readouterr().err and out.read_text() == text
    (tmp_path / "link.yaml").symlink_to("nowhere")
    assert main(["import", "--guess", str(path), "-o", str(tmp_path / "link.yaml")]) == 2
    assert "link.yaml: found a file, expected a name" in capsys.readouterr().err
    assert main(["import", "--guess", str(path)]) == 0
    shown = capsys.readouterr()
    assert shown.out == text and "unsure: force_n" in shown.err
    log = tmp_path / "run.mcap"
    assert main(["import", str(out), str(path), "-o", str(log)]) == 0


HOSTILE = {
    "empty.csv": b"",
    "text.csv": b"hello\nworld\n",
    "zero.csv": b"a,b\n1,2\n\0\0\n",
    "words.csv": b"a,b\nx,y\nz,w\n",
    "deep.jsonl": b'{"a":' * 900 + b"1" + b"}" * 900 + b"\n",
    "deeper.jsonl": b'{"a":' * 90_000,
    "short.parquet": b"PAR1PAR1",
    "short.npz": b"PK\x03\x04xx",
    "short.db3": b"SQLite format 3\x00" + bytes(100),
    "short.mcap": b"\x89MCAP0\r\n",
    "short.mat": b"MATLAB 5.0 MAT-file" + bytes(200),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_cannot_be_guessed_at_is_one_sentence(name, tmp_path, capsys):
    path = tmp_path / name
    path.write_bytes(HOSTILE[name])
    assert main(["import", "--guess", str(path)]) == 2
    said = capsys.readouterr()
    assert not said.out and said.err.count("\n") == 1 and "found" in said.err, said


def test_names_from_a_file_cannot_leave_their_line(tmp_path, capsys):
    """A column's name is data: it becomes a quoted text, and a comment without a line end."""
    path = tmp_path / "run.jsonl"
    name = "x\\n# rig: other\\nmeasured: {}\\u2028\\ud83c\\udf00"
    path.write_text("".join(f'{{"t": {k / 10}, "{name}": {k % 3}}}\n' for k in range(30)))
    assert main(["import", "--guess", str(path), "-o", str(tmp_path / "m.yaml")]) == 0
    mapping, _ = load_mapping(tmp_path / "m.yaml")
    assert [s.column for s in mapping.measured.values()] == [
        "x\n# rig: other\nmeasured: {}\u2028\U0001f300"
    ]
    capsys.readouterr()


def test_time_that_goes_back_is_said(tmp_path, capsys):
    path = tmp_path / "run.csv"
    path.write_text("t,force\n" + "".join(f"{k % 50 / 10},{k % 3}\n" for k in range(100)))
    assert main(["import", "--guess", str(path), "-o", str(tmp_path / "m.yaml")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "time goes back at row 50 of 100" in said and "as it stands it is refused" in said


@pytest.mark.parametrize(
    ("name", "quantity", "text", "part"),
    [
        ("knee_angle_deg", "angle", "deg", "measured"),
        ("cmd_speed [mm/s]", "speed", "mm/s", "command"),
        ("motorVelocityRpm", "turning", "rpm", "measured"),
        ("omega_deg_per_s", "turning", "deg/s", "measured"),
        ("p_supply_bar_g", "pressure", "bar", "measured"),
        ("Temperature (degC)", "temperature", "K", "measured"),
        ("F/N", "force", "N", "measured"),
        ("ref_x_mm", "length", "mm", "reference"),
        ("Sollposition [\N{MICRO SIGN}m]", "length", "um", "either"),
        ("Motorkraft [N]", "force", "N", "measured"),
    ],
)
def test_units_in_names(name, quantity, text, part):
    words = words_of(name)
    assert words.unit is not None
    assert (words.unit.quantity, words.unit.text, words.part) == (quantity, text, part)


@pytest.mark.parametrize(
    ("name", "tokens"),
    [
        ("Motorkraft", ("motor", "kraft")),
        ("jointangle", ("joint", "angle")),
        ("loadcell", ("loadcell",)),
        ("overpressure_kPa", ("overpressure",)),  # a unit says it, and no part of it does
        ("acceleration", ("acceleration",)),
    ],
)
def test_a_compound_is_read_by_the_quantity_that_it_ends_in(name, tokens):
    assert words_of(name).tokens == tokens


@given(st.text(max_size=60))
def test_any_name_is_read_and_gives_a_unit_of_the_mapping_or_none(name):
    words = words_of(name)
    found = words.unit or unit_of(name)
    assert found is None or unit(found.text)[0] > 0


def test_a_name_that_says_open_is_not_said_twice(tmp_path):
    rows = [f"{0.01 * i:g},{i % 2},{1.0 + i}" for i in range(300)]
    path = tmp_path / "v.csv"
    path.write_text("\n".join(["t_s,cmd_muscle_inlet_open,force_n", *rows]) + "\n")
    text = guess([path]).text
    assert "cmd_muscle_inlet_open:" in text and "open_open" not in text

"""Foreign recordings become logs of ours, with the numbers that they had."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from foreign_files import (
    CSV,
    FORCE,
    MAT,
    MCAP,
    POSITION,
    ROWS,
    T,
    csv_text,
    mat_bytes,
    mcap_json,
    mcap_protobuf,
)

from epa_rt.cli.main import main
from epa_rt.gap.rig.read import read_recording
from epa_rt.logs.reader import LogReader

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def files(tmp_path):
    (tmp_path / "cart.csv").write_text(csv_text())
    (tmp_path / "cart.mat").write_bytes(mat_bytes())
    mcap_json(tmp_path / "json.mcap")
    mcap_protobuf(tmp_path / "protobuf.mcap")
    return tmp_path


@pytest.mark.parametrize(
    ("name", "mapping", "close"),
    [
        ("cart.csv", CSV, 1e-6),
        ("cart.mat", MAT, 1e-12),
        ("json.mcap", MCAP, 1e-12),
        ("protobuf.mcap", MCAP, 1e-6),
    ],
)
def test_columns_come_out_in_si(files, imported, name, mapping, close):
    code, said, log = imported(mapping, files / name)
    assert code == 0 and f"{ROWS} rows" in said
    recording = read_recording(log)
    assert recording.found == () and (recording.rig, recording.experiment, recording.period_s) == (
        "cart",
        "cart",
        0.01,
    )
    assert np.array_equal(recording.cycle, np.arange(ROWS))
    for column, truth in (
        ("cart_position_m", POSITION),
        ("cart_force_n", FORCE),
        ("cmd_cart_force_n", FORCE),
    ):
        assert np.allclose(recording.columns[column], truth, rtol=close, atol=10 * close)
    trials = [span for span in recording.spans if span.trial]
    assert [(s.name, s.start, s.stop) for s in trials] == (
        [("first", 50, 100)] if "trials" in mapping else [("recording", 0, ROWS)]
    )
    assert (
        json.loads(recording.attachments["sources.json"])[0]["sha256"]
        == hashlib.sha256((files / name).read_bytes()).hexdigest()
    )


def test_the_log_is_whole_and_opens_in_the_other_verbs(files, imported, capsys):
    _, _, log = imported(CSV, files / "cart.csv")
    with LogReader(log) as reader:
        assert reader.missing == [] and reader.outcome == "imported"
    assert main(["info", str(log), "--check"]) == 0
    assert "nothing, every checksum compared" in capsys.readouterr().out
    assert main(["plot", str(log), "cart_position_m"]) == 0


def test_the_same_files_give_the_same_bytes(files, imported):
    logs = [imported(CSV, files / "cart.csv")[2] for _ in range(2)]
    assert logs[0].read_bytes() == logs[1].read_bytes()


def test_dry_shows_and_writes_nothing(files, imported):
    code, said, log = imported(CSV, files / "cart.csv", arguments=("--dry",))
    assert code == 0 and "cart_position_m" in said and "-0.1 to 0.1" in said and not log.exists()


def test_no_log_is_overwritten(files, tmp_path, capsys):
    (tmp_path / "m.yaml").write_text(CSV)
    (tmp_path / "there.mcap").write_bytes(b"precious")
    assert (
        main(
            [
                "import",
                str(tmp_path / "m.yaml"),
                str(files / "cart.csv"),
                "-o",
                str(tmp_path / "there.mcap"),
            ]
        )
        == 2
    )
    assert (
        "no log is overwritten" in capsys.readouterr().err
        and (tmp_path / "there.mcap").read_bytes() == b"precious"
    )


def test_rows_that_are_missing_become_lost_cycles(files, imported, tmp_path):
    lines = csv_text().splitlines(keepends=True)
    (tmp_path / "gap.csv").write_text("".join(lines[:50] + lines[57:]))
    code, said, log = imported(CSV, tmp_path / "gap.csv")
    assert code == 0 and "7 cycles in 1 gap have no row" in said
    assert np.diff(read_recording(log).cycle).max() == 8


def test_resampling_is_said_and_right(imported, tmp_path):
    t = T + 0.004 * np.sin(np.arange(ROWS))
    (tmp_path / "jitter.csv").write_text(csv_text(t - t[0], 3.0 * t, FORCE))
    code, said, _ = imported(CSV, tmp_path / "jitter.csv")
    assert code == 2 and "ms off a grid of 10 ms" in said and "jitter.csv:" in said
    code, said, log = imported(
        CSV.replace("period: 10 ms", "period: 10 ms, resample: linear"), tmp_path / "jitter.csv"
    )
    recording = read_recording(log)
    assert code == 0 and f"{ROWS} rows were put onto {recording.samples} cycles" in said
    assert np.allclose(
        recording.columns["cart_position_m"], 3.0 * (t[0] + recording.cycle * 0.01), atol=1e-6
    )


def test_resampling_leaves_gaps_open(imported, tmp_path):
    t = np.delete(T + 0.0011 * (np.arange(ROWS) % 2), np.arange(60, 90))
    (tmp_path / "pause.csv").write_text(csv_text(t, t, t))
    code, said, log = imported(
        CSV.replace("period: 10 ms", "period: 10 ms, resample: linear, max_gap: 50 ms"),
        tmp_path / "pause.csv",
    )
    assert code == 0 and "1 gap" in said
    assert 28 <= np.diff(read_recording(log).cycle).max() <= 31


GROUPED = {
    "point": (
        "decimal: ',', thousands: '.'",
        ["1.234,5", "-12.345.678", "0,015", "1234,5", "7", "1.015", "1.000,5E-3"],
        [1234.5, -12345678.0, 0.015, 1234.5, 7.0, 1015.0, 1.0005],
    ),
    "comma": (
        "decimal: '.', thousands: ','",
        ["1,234.5", "12.5", "+1,000", ".5"],
        [1234.5, 12.5, 1000.0, 0.5],
    ),
    "space": ("thousands: ' '", ["1 234.5", "12.5"], [1234.5, 12.5]),
    "both the point": (
        "thousands: '.'",
        ["100.092.000", "92.5", "0.015", "1.000.5"],
        [100092.0, 92.5, 0.015, 1000.5],
    ),
}


@pytest.mark.parametrize("name", GROUPED)
def test_signs_for_thousands_part_groups_of_three(imported, tmp_path, name):
    signs, cells, values = GROUPED[name]
    cells = (cells * ROWS)[:ROWS]
    rows = [f"{10 * k};{cell}" for k, cell in enumerate(cells)]
    (tmp_path / "thousands.csv").write_text("\n".join(["time;pos", *rows]) + "\n")
    text = (
        f"mapping: cart\nrig: cart\nformat: {{kind: csv, delimiter: ';', {signs}}}\nclock:"
        " {column: time, unit: ms, period: 10 ms}\nmeasured: {cart_position_m: {column: pos,"
        " unit: m}}\n"
    )
    code, said, log = imported(text, tmp_path / "thousands.csv")
    assert code == 0 and np.allclose(
        read_recording(log).columns["cart_position_m"], (values * ROWS)[:ROWS]
    ), said


@pytest.mark.parametrize(
    ("signs", "cell"),
    [
        ("decimal: ',', thousands: '.'", "0.015"),
        ("decimal: ',', thousands: '.'", "1.5E-3"),
        ("decimal: ',', thousands: '.'", "1.5"),
        ("decimal: '.', thousands: ','", "12,5"),
        ("decimal: '.', thousands: ','", "1,2345"),
        ("decimal: '.', thousands: ','", "1.5,000"),
        ("thousands: ' '", "1 2"),
        ("thousands: '.'", "10.57.000"),
    ],
)
def test_a_sign_for_thousands_that_parts_no_groups_is_refused(imported, tmp_path, signs, cell):
    (tmp_path / "thousands.csv").write_text(f"time;pos\n0;1\n10;{cell}\n20;3\n")
    text = (
        f"mapping: cart\nrig: cart\nformat: {{kind: csv, delimiter: ';', {signs}}}\nclock:"
        " {column: time, unit: ms, period: 10 ms}\nmeasured: {cart_position_m: {column: pos,"
        " unit: m}}\n"
    )
    code, said, _ = imported(text, tmp_path / "thousands.csv")
    assert (
        code == 2
        and f"thousands.csv:3: column 'pos': found {cell!r}, expected a number with groups of three digits between"  # noqa: E501
        in said
    )


TWO = (
    CSV.replace("cart_force_n: {column: force", "cart_force_n: {file: cell, column: force")
    .replace("cart_position_m: {", "cart_position_m: {file: place, ")
    .replace("cmd_cart_force_n: {", "cmd_cart_force_n: {file: cell, ")
    .replace("trials: [{name: first, begin: 0.5 s, end: 1 s}]\n", "")
)


def _two(folder, kept, t=T):
    """A complete file, and another with the rows ``kept`` alone."""
    (folder / "place.csv").write_text(csv_text())
    (folder / "cell.csv").write_text(csv_text(t[kept], POSITION[kept], FORCE[kept]))
    return folder / "place.csv", folder / "cell.csv"


@pytest.mark.parametrize(
    ("clock", "beside_s"),
    [("", 0.0), ("", 0.003), (", resample: linear", 0.003), (", max_gap: 100 ms", 0.0)],
)
def test_a_dropout_of_a_second_file_is_no_straight_line(imported, tmp_path, clock, beside_s):
    """Rows 60 to 110 are gone in one file of two; a hole of one row is bridged."""
    kept = np.delete(np.arange(ROWS), [*range(60, 111), 150])
    code, said, log = imported(
        TWO.replace("period: 10 ms", "period: 10 ms" + clock), *_two(tmp_path, kept, T + beside_s)
    )
    assert (
        code == 0
        and "cell.csv:62: found 0.52 s without a row; 51 cycles lie in 1 such gap, where its columns have no value"  # noqa: E501
        in said
    )
    recording = read_recording(log)
    for name in ("cart_force_n", "cmd_cart_force_n"):
        lost = np.flatnonzero(np.isnan(recording.columns[name])[1:]) + 1
        assert (
            lost.tolist() == list(range(60, 111))
            if beside_s == 0.0
            else (len(lost) == 51 and lost[0] in (60, 61))
        )
    assert "cart_force_n has no value on " in said and "they are marked invalid" in said
    assert "cmd_cart_force_n has no value on " in said and "nothing is put in their place" in said
    assert np.isfinite(recording.columns["cart_position_m"]).all()


def test_a_second_file_may_be_slower_and_its_gaps_may_be_allowed(imported, tmp_path):
    slow = np.arange(0, ROWS, 5)
    for clock, kept in (
        ("", slow),
        (", max_gap: 20 ms", slow),
        (", max_gap: 600 ms", np.delete(np.arange(ROWS), range(60, 111))),
    ):
        code, _, log = imported(
            TWO.replace("period: 10 ms", "period: 10 ms" + clock), *_two(tmp_path, kept)
        )
        assert (
            code == 0 and np.isfinite(read_recording(log).columns["cart_force_n"][: kept[-1]]).all()
        )


def test_words_of_a_second_file_hold_through_its_gaps(imported, tmp_path):
    kept = np.delete(np.arange(ROWS), range(60, 111))
    text = TWO.replace(
        "cart_force_n: {file: cell, column: force, unit: N}",
        "brake_raw: {file: cell, column: force, unit: '1'}",
    )
    code, said, log = imported(text, *_two(tmp_path, kept))
    values = read_recording(log).columns["brake_raw"]
    assert (
        code == 0
        and "valves, enables and words hold theirs" in said
        and np.all(values[60:111] == values[59])
    )


def test_missing_values_are_allowed_by_name_only_and_counted(imported, tmp_path):
    lines = csv_text().splitlines()
    lines[20] = lines[20].replace(lines[20].split(";")[2], "n/a")
    (tmp_path / "holes.csv").write_text("\n".join(lines) + "\n")
    code, said, _ = imported(CSV, tmp_path / "holes.csv")
    assert (
        code == 2
        and "holes.csv:21: column 'force': found 'n/a', expected a number; where that means no value, name it in the mapping: format: {missing: [\"n/a\"]}"  # noqa: E501
        in said
    )
    code, said, log = imported(
        CSV.replace("csv, ", "csv, missing: [n/a], "), tmp_path / "holes.csv"
    )
    assert code == 0 and "cart_force_n has no value on 1 of 200 rows" in said
    assert np.flatnonzero(np.isnan(read_recording(log).columns["cart_force_n"])).tolist() == [19]


def test_pressures_say_what_they_are_against(imported, files):
    for word, zero in (("gauge", 101325.0), ("abs", 0.0), ("difference", 0.0)):
        text = CSV.replace(
            "cart_force_n: {column: force, unit: N}",
            f"cart_pressure_pa: {{column: force, unit: bar {word}}}",
            1,
        )
        _, _, log = imported(text, files / "cart.csv")
        assert np.allclose(
            read_recording(log).columns["cart_pressure_pa"], 1e5 * FORCE + zero, atol=1.0
        )


def test_trials_by_a_column(imported, tmp_path):
    lap = np.repeat([0, 1, 2, 0], 50)
    rows = csv_text().splitlines()
    (tmp_path / "laps.csv").write_text(
        "\n".join([rows[0] + ";lap", *(f"{row};{k}" for row, k in zip(rows[1:], lap, strict=True))])
        + "\n"
    )
    _, _, log = imported(
        CSV.replace("trials: [{name: first, begin: 0.5 s, end: 1 s}]", "trials: {column: lap}"),
        tmp_path / "laps.csv",
    )
    assert [(s.name, s.start, s.stop, s.trial) for s in read_recording(log).spans] == [
        ("between", 0, 50, False),
        ("trial 1", 50, 100, True),
        ("trial 2", 100, 150, True),
        ("between", 150, 200, False),
    ]


@pytest.mark.parametrize("number", ["0", ""])
def test_a_column_of_trials_without_any_is_refused_where_the_mapping_names_it(
    imported, tmp_path, number
):
    rows = csv_text().splitlines()
    (tmp_path / "laps.csv").write_text(
        "\n".join([rows[0] + ";lap", *(f"{row};{number}" for row in rows[1:])]) + "\n"
    )
    mapping = CSV.replace(
        "trials: [{name: first, begin: 0.5 s, end: 1 s}]", "trials: {column: lap}"
    ).replace("format: {", "format: {missing: [''], ")
    line = mapping[: mapping.index("trials:")].count("\n") + 1
    code, said, log = imported(mapping, tmp_path / "laps.csv")
    assert code == 2 and not log.exists()
    assert f"yaml:{line}: trials" in said and "no number other than zero in the column lap" in said


def test_a_trial_that_was_to_end_after_the_recording_is_said_to_be_cut(imported, files):
    code, said, _ = imported(CSV.replace("end: 1 s", "end: 60 s"), files / "cart.csv")
    assert (
        code == 0
        and "trial first was to end at 60 s and is cut at 1.99 s, where the recording ends" in said
    )
    assert "is cut at" not in imported(CSV.replace("end: 1 s", "end: 2 s"), files / "cart.csv")[1]


@pytest.mark.parametrize(("number", "shown"), [(2_000_000, "2e+06"), (1.5, "1.5")])
def test_a_number_that_is_no_trial_is_named(imported, tmp_path, number, shown):
    lap = np.where(np.arange(ROWS) == 120, number, 1.0)
    rows = csv_text().splitlines()
    (tmp_path / "laps.csv").write_text(
        "\n".join(
            [rows[0] + ";lap", *(f"{row};{k:.1f}" for row, k in zip(rows[1:], lap, strict=True))]
        )
        + "\n"
    )
    code, said, _ = imported(
        CSV.replace("trials: [{name: first, begin: 0.5 s, end: 1 s}]", "trials: {column: lap}"),
        tmp_path / "laps.csv",
    )
    assert (
        code == 2
        and f"laps.csv:122: column lap: found {shown}, expected the number of a trial" in said
    )


def test_a_rig_file_is_attached_and_must_be_of_that_rig(imported, files, tmp_path):
    (tmp_path / "rig.yaml").write_text("rig: cart\nmass: 2 kg\n")
    _, _, log = imported(
        CSV.replace("rig: cart\n", "rig: cart\nrig_file: rig.yaml\n"), files / "cart.csv"
    )
    assert read_recording(log).attachments["rig.yaml"] == b"rig: cart\nmass: 2 kg\n"
    code, said, _ = imported(
        CSV.replace("rig: cart\n", "rig: wagon\nrig_file: rig.yaml\n"), files / "cart.csv"
    )
    assert code == 2 and "found 'cart', expected 'wagon'" in said


CELL = CSV.replace(
    "cart_force_n: {column: force, unit: N}",
    "cart_pressure_pa: {column: force, unit: bar gauge}",
    1,
)


@pytest.mark.parametrize(
    "rig", ["rig: cart\nkind: piston\nsettings: {atmosphere: 83 kPa}\n", "ours"]
)
def test_the_atmosphere_is_that_of_the_rig_file(imported, files, tmp_path, rig):
    """Taken from there where the mapping does not say it; refused where it says another."""
    name, text = "cart", CELL
    if rig == "ours":
        bench = (ROOT / "config/rigs/bench.yaml").read_text()
        name, rig = "bench", bench.replace("atmosphere: 101.325 kPa abs", "atmosphere: 83 kPa abs")
        text = (
            CELL.replace("cart_position_m", "motor_travel_m")
            .replace("cart_pressure_pa", "muscle_pressure_pa")
            .replace("cmd_cart_force_n", "cmd_motor_torque_nm")
            .replace("kN", "kN*m")
        )
    (tmp_path / "rig.yaml").write_text(rig)
    text = text.replace("rig: cart\n", f"rig: {name}\nrig_file: rig.yaml\n")
    pressure = text.partition("_pressure_pa")[0].split()[-1] + "_pressure_pa"
    for line in ("", "atmosphere: 830 mbar abs\n"):
        code, said, log = imported(line + text, files / "cart.csv")
        assert code == 0 and np.allclose(
            read_recording(log).columns[pressure], 1e5 * FORCE + 83e3, atol=1.0
        ), said
    code, said, _ = imported("atmosphere: 101.325 kPa abs\n" + text, files / "cart.csv")
    assert (
        code == 2
        and ".yaml:1: atmosphere: found 101.325 kPa abs, expected 83 kPa abs, as the rig file rig.yaml says"  # noqa: E501
        in said
    )


def test_the_atmosphere_that_a_kind_takes_by_default_counts_too(imported, files, tmp_path):
    (tmp_path / "rig.yaml").write_text("rig: cart\nkind: piston\n")
    text = "atmosphere: 83 kPa abs\n" + CELL.replace(
        "rig: cart\n", "rig: cart\nrig_file: rig.yaml\n"
    )
    code, said, _ = imported(text, files / "cart.csv")
    assert (
        code == 2
        and ".yaml:1: atmosphere: found 83 kPa abs, expected 101.325 kPa abs, which a piston takes where its rig file rig.yaml does not say 'settings: {atmosphere: ...}'"  # noqa: E501
        in said
    )
    (tmp_path / "rig.yaml").write_text("rig: cart\nkind: carriage\n")
    assert imported(text, files / "cart.csv")[0] == 0  # of which nothing hangs on it


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("83", "without a unit"),
        ("83 mm", "expected a quantity in Pa"),
        ("-1 kPa", "expected a pressure above zero"),
    ],
)
def test_an_atmosphere_of_a_rig_of_others_that_is_none_is_refused(
    imported, files, tmp_path, setting, expected
):
    (tmp_path / "rig.yaml").write_text(f"rig: cart\nsettings:\n  atmosphere: {setting}\n")
    code, said, _ = imported(
        CELL.replace("rig: cart\n", "rig: cart\nrig_file: rig.yaml\n"), files / "cart.csv"
    )
    assert code == 2 and "rig.yaml:3: settings.atmosphere: found " in said and expected in said

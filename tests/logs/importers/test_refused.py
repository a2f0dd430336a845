"""What does not fit is refused with file, line and column, and nothing is written."""

import numpy as np
import pytest
from foreign_files import (
    CSV,
    FORCE,
    MAT,
    MCAP,
    POSITION,
    T,
    csv_text,
    mat_bytes,
    mcap_json,
    write_all,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from epa_rt.cli.main import main

LINES = csv_text().splitlines()


def line(number: int, text: str) -> str:
    return "\n".join([*LINES[: number - 1], text, *LINES[number:]]) + "\n"


CSVS = {
    "text": (line(7, "50.000;x;1.0;0.0"), "bad.csv:7: column 'pos': found 'x', expected a number"),
    "nan": (
        line(7, "50.000;nan;1.0;0.0"),
        "bad.csv:7: column 'pos': found 'nan', expected a number",
    ),
    "infinite": (
        line(7, "50.000;1e999;1.0;0.0"),
        "bad.csv:7: column 'pos': found '1e999', expected a number",
    ),
    "empty cell": (
        line(9, "70.000;;1.0;0.0"),
        "bad.csv:9: column 'pos': found an empty cell, expected a number",
    ),
    "comma": (
        line(9, "70,000;1,5;1.0;0.0"),
        "bad.csv:9: column 'pos': found '1,5', expected a number",
    ),
    "too few cells": (line(9, "70.000;1.0"), "bad.csv:9: found 2 columns, expected 4"),
    "no such column": (
        csv_text().replace("force", "kraft", 1),
        "bad.csv:1: found no column 'force', expected it among 'time', 'pos', 'kraft'",
    ),
    "header twice": (
        csv_text().replace("asked", "pos", 1),
        "bad.csv:1: found the column 'pos' 2 times",
    ),
    "back in time": (
        line(9, "65.000;1.0;1.0;0.0").replace("60.000;", "66.000;"),
        "bad.csv:9: found a stamp 0.001 s before that of the row before",
    ),
    "twice the time": (
        line(9, "60.000;1.0;1.0;0.0"),
        "bad.csv:9: found the same stamp as on the row before",
    ),
    "stamps in microseconds": (
        "\n".join(
            [
                LINES[0],
                *(
                    f"{float(row.partition(';')[0]) * 1e3:.3f};{row.partition(';')[2]}"
                    for row in LINES[1:]
                ),
            ]
        )
        + "\n",
        "bad.csv:3: found rows 10 s apart as a rule, expected the period of 0.01 s",
    ),
    "empty": ("", "bad.csv:1: found an empty file"),
    "blank": ("\n\n", "bad.csv:1: found an empty file"),
    "header only": (LINES[0] + "\n", "bad.csv:2: found no row of numbers"),
    "one row": ("\n".join(LINES[:2]) + "\n", "bad.csv:2: found one row, expected two at least"),
    "another delimiter": (csv_text().replace(";", "\t"), "which may be the delimiter"),
    "cut in a row": (csv_text()[:-30], "bad.csv:201: found "),
    "cut in a number": (csv_text()[:-3], "bad.csv:201: found a last line without a line end"),
    "zero byte": (csv_text().replace("50.000", "5\0", 1), "bad.csv:7: found a zero byte"),
    "open quote": (line(9, '"70.000;1.0;1.0;0.0'), "bad.csv:9: found a line that is not CSV"),
}


@pytest.mark.parametrize("name", CSVS)
def test_csv(name, imported, tmp_path):
    text, expected = CSVS[name]
    (tmp_path / "bad.csv").write_text(text)
    code, said, _ = imported(CSV, tmp_path / "bad.csv")
    assert code == 2 and expected in said


def test_what_may_be_wrong_is_said(imported, tmp_path):
    """Decimal commas between commas; a header with another delimiter than the rows; an output below
    a file.
    """
    (tmp_path / "a.csv").write_text(csv_text().replace(";", ",").replace(".", ","))
    assert (
        "found 8 columns, expected 4 as in the lines before; the numbers may have decimal commas"
        in imported(CSV.replace('";"', '","'), tmp_path / "a.csv")[1]
    )
    (tmp_path / "b.csv").write_text(csv_text().replace(".", ","))
    said = imported(CSV.replace('";"', '","'), tmp_path / "b.csv")[1]
    assert (
        "b.csv:2: found 5 columns, expected 1 as in the lines before; the line has 3 times ';',"
        " which may be the delimiter" in said
    )
    (tmp_path / "c.csv").write_text(csv_text())
    (tmp_path / "m.yaml").write_text(CSV)
    assert (
        main(
            [
                "import",
                str(tmp_path / "m.yaml"),
                str(tmp_path / "c.csv"),
                "-o",
                str(tmp_path / "c.csv/log.mcap"),
            ]
        )
        == 2
    )
    assert (tmp_path / "c.csv").read_text() == csv_text()


def test_lines_about_the_header(imported, tmp_path):
    """A title before it, units below it: said, and what is said helps."""
    (tmp_path / "title.csv").write_text("second run of the cart\n" + csv_text())
    said = imported(CSV, tmp_path / "title.csv")[1]
    assert (
        "title.csv:2: found 4 columns, expected 1 as in the lines before; where lines stand before"
        " the header, say how many with 'skip_lines' under format" in said
    )
    assert imported(CSV.replace("csv,", "csv, skip_lines: 1,"), tmp_path / "title.csv")[0] == 0
    (tmp_path / "units.csv").write_text(line(1, LINES[0] + "\nms;mm;N"))
    said = imported(CSV, tmp_path / "units.csv")[1]
    assert "units.csv:2: found 3 columns" in said
    (tmp_path / "units.csv").write_text(line(1, LINES[0] + "\nms;mm;N;kN"))
    assert (
        "units.csv:2: column 'pos': found 'mm', expected a number; where units stand below the"
        " header, say 'skip_below_header: 1'" in imported(CSV, tmp_path / "units.csv")[1]
    )
    code, said, _ = imported(
        CSV.replace("csv,", "csv, skip_below_header: 1,"), tmp_path / "units.csv"
    )
    assert code == 0 and "200 rows" in said
    assert (
        "found 'skip_below_header: 1' with 'header: false'"
        in imported(
            CSV.replace("csv,", "csv, header: false, skip_below_header: 1,"), tmp_path / "units.csv"
        )[1]
    )


def test_encodings(imported, tmp_path):
    (tmp_path / "a.csv").write_bytes(
        csv_text().replace("time", "Kraft in µ;time", 1).encode("latin-1")
    )
    assert "a.csv:1: found bytes that are not utf-8 text" in imported(CSV, tmp_path / "a.csv")[1]
    (tmp_path / "b.csv").write_bytes(csv_text().encode("utf-16"))
    assert "b.csv:1: found the mark of UTF-16 text" in imported(CSV, tmp_path / "b.csv")[1]
    assert imported(CSV.replace("csv,", "csv, encoding: utf-16,"), tmp_path / "b.csv")[0] == 0
    (tmp_path / "c.csv").write_bytes(b"\xef\xbb\xbf" + csv_text().encode())
    assert imported(CSV, tmp_path / "c.csv")[0] == 0


BAD_POSITION = np.where(np.arange(len(T)) == 17, np.nan, POSITION)
MATS = {
    "nan": (
        mat_bytes(pos=BAD_POSITION),
        "variable 'pos', index 17: found nan, expected a number (1 of 200 are none)",
    ),
    "missing": (
        mat_bytes(pos=None),
        "found no variable 'pos', expected it among asked, force, time",
    ),
    "lengths": (
        mat_bytes(pos=POSITION[:-1]),
        "found variables of different lengths (pos 199, force 200",
    ),
    "text": (mat_bytes(pos="hello"), "variable 'pos': found text, expected numbers"),
    "matrix": (
        mat_bytes(pos=np.ones((200, 3))),
        "expected a vector (a matrix's column is 'pos[0]')",
    ),
    "complex": (mat_bytes(pos=POSITION * 1j), "variable 'pos': found an array of complex128"),
    "structure": (mat_bytes(pos={"a": 1.0}), "variable 'pos': found a structure"),
    "hdf5": (
        b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n" + bytes(100),
        "found a MAT file of version 7.3 (HDF5), expected version 7 or older",
    ),
    "empty": (b"", "found an empty file, expected a MAT file"),
    "cut": (mat_bytes()[:1500], "bad.mat: found "),
    "text file": (csv_text().encode(), "found a file that is no whole MAT file"),
}


@pytest.mark.parametrize("name", MATS)
def test_mat(name, imported, tmp_path):
    content, expected = MATS[name]
    (tmp_path / "bad.mat").write_bytes(content)
    code, said, _ = imported(MAT, tmp_path / "bad.mat")
    assert code == 2 and expected in said


def test_mat_scales_and_columns(imported, tmp_path):
    (tmp_path / "a.mat").write_bytes(
        mat_bytes(pos=np.column_stack([POSITION, 1e3 * POSITION]), gain=0.0, data={"q": FORCE})
    )
    text = MAT.replace("column: pos,", "column: 'pos[1]',").replace(
        "column: force", "column: data.q"
    )
    assert imported(text, tmp_path / "a.mat")[0] == 0
    text = text.replace("unit: mm", "unit: mm, scale_variable: gain")
    assert (
        "variable 'gain': found 0.0, expected a number other than zero"
        in imported(text, tmp_path / "a.mat")[1]
    )


MCAPS = {
    "nothing there": (
        lambda k, m: {"pos": m["pos"]},
        "/cart, message 0: field 'force': found nothing, expected a number",
    ),
    "text": (
        lambda k, m: m | ({"force": "x"} if k == 9 else {}),
        "/cart, message 9: field 'force': found 'x', expected a number",
    ),
    "nan": (
        lambda k, m: m | ({"force": float("nan")} if k == 9 else {}),
        "/cart, message 9: field 'force': found 'nan'",
    ),
    "short list": (lambda k, m: m | {"pos": [1.0]}, "field 'pos[1]': found no element 1"),
    "no json": (
        lambda k, m: b"{" if k == 3 else m,
        "/cart, message 3: found a message that cannot be decoded",
    ),
    "a list": (lambda k, m: b"[1]", "field 'pos[1]': found no element 1"),
    "huge": (lambda k, m: m | {"force": 10**400}, "field 'force': found"),
}


@pytest.mark.parametrize("name", MCAPS)
def test_mcap(name, imported, tmp_path):
    change, expected = MCAPS[name]
    mcap_json(tmp_path / "bad.mcap", change)
    code, said, _ = imported(MCAP, tmp_path / "bad.mcap")
    assert code == 2 and expected in said


def test_a_topic_that_is_not_there(imported, tmp_path):
    mcap_json(tmp_path / "a.mcap")
    assert (
        "found no message on '/wagon', expected some (topics: '/cart')"
        in imported(MCAP.replace("/cart", "/wagon"), tmp_path / "a.mcap")[1]
    )


MAPPINGS = {
    "unit of another quantity": (
        ("unit: mm", "unit: N"),
        ":8: measured.cart_position_m: found the unit 'N', expected a unit of m",
    ),
    "no unit": (("unit: mm", "unit: furlong"), "found unit 'furlong', expected a known unit"),
    "scale of zero": (("scale: 2", "scale: 0"), "found a scale of zero"),
    "scale with a unit too many": (
        ("scale: 2", "scale: 2 N/V"),
        "times 'N/V', expected a unit of N",
    ),
    "scale true": (("scale: 2", "scale: true"), "found 'True', expected a number"),
    "scale of nothing": (("scale: 2", "scale: .nan"), "expected"),
    "unknown key": (("scale: 2", "faktor: 2"), "found an unknown key 'faktor'"),
    "name without unit": (
        ("cart_force_n: {column: force", "cart_force: {column: force"),
        "expected a name that ends in its unit",
    ),
    "command among the measured": (
        ("  cart_force_n", "  cmd_force_n"),
        "expected a measured signal, without prefix",
    ),
    "measured among the commands": (
        ("  cmd_cart", "  cart2"),
        "expected a name that begins with cmd_",
    ),
    "rate and column": (
        ("period: 10 ms", "rate: 100 Hz"),
        "found both, expected one of column and rate",
    ),
    "clock in metres": (("unit: ms", "unit: m"), "found the unit 'm', expected a unit of time"),
    "delimiter": (('";"', '"."'), "expected signs that differ"),
    "topic of a CSV": (("scale: 2", "topic: /a"), "a CSV file has no topics"),
    "trial past the end": (("end: 1 s", "end: 0.4 s"), "expected the begin before the end"),
    "column zero": (("column: pos", "column: 0"), "expected a column's name, or its number from 1"),
    "no YAML": (("mapping: cart", "mapping: ["), "text that is not YAML"),
    "rig file that is not there": (
        ("rig: cart", "rig: cart\nrig_file: no.yaml"),
        ".yaml:3: rig_file: found no such",
    ),
    "file that is not given": (
        ("scale: 2", "file: other"),
        "found 0 files whose name holds 'other'",
    ),
}


@pytest.mark.parametrize("name", MAPPINGS)
def test_mapping(name, imported, tmp_path):
    (old, new), expected = MAPPINGS[name]
    assert old in CSV
    (tmp_path / "cart.csv").write_text(csv_text())
    code, said, _ = imported(CSV.replace(old, new, 1), tmp_path / "cart.csv")
    assert code == 2 and expected in said and ".yaml:" in said


def test_files_that_are_none(imported, tmp_path):
    for kind, mapping in (("csv", CSV), ("mat", MAT), ("mcap", MCAP)):
        assert imported(mapping, tmp_path / f"nowhere.{kind}")[0] == 2
        assert imported(mapping, tmp_path)[0] == 2
    (tmp_path / "a.csv").write_text(csv_text())
    (tmp_path / "b.csv").write_text(csv_text())
    assert "found 2 files, expected one" in imported(CSV, tmp_path / "a.csv", tmp_path / "b.csv")[1]


def _damaged(draw, content: bytes) -> bytes:
    data = bytearray(content)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(data)))
        how = draw(st.sampled_from(["cut", "byte", "insert", "drop", "double"]))
        size = draw(st.integers(1, 40))
        if how == "cut":
            del data[max(at, 1) :]
        elif how == "byte" and at < len(data):
            data[at] = draw(st.integers(0, 255))
        elif how == "insert":
            data[at:at] = draw(st.binary(max_size=20))
        elif how == "drop":
            del data[at : at + size]
        else:
            data[at:at] = data[at : at + size]
        if not data:
            data = bytearray(b"\0")
    return bytes(data)


def _one_sentence(kind, what, data, imported, tmp_path):
    """``imported`` holds that an exit code other than 0 is 2, with one line and no file left
    behind.
    """
    mapping, file = write_all(tmp_path)[kind]
    damaged = mapping if what == "mapping" else file
    damaged.write_bytes(_damaged(data.draw, damaged.read_bytes()))
    imported(mapping, file)


_QUICK = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.mark.parametrize("kind", ["csv", "mcap", "protobuf"])
@pytest.mark.parametrize("what", ["file", "mapping"])
@_QUICK
@given(data=st.data())
def test_damage_is_one_sentence_or_none_at_all(kind, what, data, imported, tmp_path):
    _one_sentence(kind, what, data, imported, tmp_path)


@settings(_QUICK, max_examples=10)
@given(data=st.data())
def test_damage_to_a_mat_file_is_one_sentence_or_none_at_all(data, imported, tmp_path):
    """Few examples, for each is read in a process of its own."""
    _one_sentence("mat", "file", data, imported, tmp_path)


def test_a_mat_file_on_which_its_reader_crashes(imported, tmp_path, monkeypatch):
    from epa_rt.logs.importers import mat_child

    run = mat_child.subprocess.run
    monkeypatch.setattr(
        mat_child.subprocess,
        "run",
        lambda command, **rest: run([command[0], "-c", "import os; os.abort()"], **rest),
    )
    (tmp_path / "a.mat").write_bytes(mat_bytes())
    assert "its reader crashes on it" in imported(MAT, tmp_path / "a.mat")[1]


@pytest.mark.parametrize(
    ("kept", "words"),
    [
        (0, "found an empty file, expected an MCAP file"),
        (8, "found a file that was cut at byte 8"),
        (2000, "found a file that was cut at byte 2000"),
    ],
)
def test_an_mcap_file_that_was_cut_says_so(kept, words, imported, tmp_path):
    mcap_json(tmp_path / "a.mcap")
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "a.mcap").read_bytes()[:kept])
    assert words in imported(MCAP, tmp_path / "cut.mcap")[1]
    assert (
        "found a file that begins with 'time;pos'"
        in imported(MCAP, _written(tmp_path / "b.mcap", csv_text()))[1]
    )


def test_a_first_row_of_numbers_is_no_header(imported, tmp_path):
    said = imported(
        CSV.replace("time,", "'0.0',"), _written(tmp_path / "a.csv", "0.0;0.0;1.0\n10.0;0.1;1.0\n")
    )[1]
    assert (
        "found the column '0.0' 2 times in the header" in said
        and "'header: false', under format" in said
    )


def _written(path, text):
    path.write_text(text)
    return path

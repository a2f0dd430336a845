"""epa import as a process of its own: exit codes and streams."""

import os
import subprocess
import sys

from tests.cli.shell import ROOT, epa_here

MAPPING = """mapping: two
rig: two
format: {kind: csv}
clock: {rate: 100 Hz}
measured: {x_position_m: {column: x, unit: mm}}
"""


def test_a_file_becomes_a_log(tmp_path):
    (tmp_path / "m.yaml").write_text(MAPPING)
    (tmp_path / "a.csv").write_text("x\n1\n2\n3\n")
    done = epa_here("import", tmp_path / "m.yaml", tmp_path / "a.csv", "-o", tmp_path / "a.mcap")
    assert done.returncode == 0 and "3 rows" in done.stdout and (tmp_path / "a.mcap").exists()
    info = epa_here("info", tmp_path / "a.mcap")
    assert info.returncode == 0 and "imported: from a.csv" in info.stdout


def test_what_is_refused_is_one_sentence_and_exit_code_2(tmp_path):
    (tmp_path / "m.yaml").write_text(MAPPING)
    (tmp_path / "a.csv").write_text("x\n1\ntwo\n3\n")
    done = epa_here("import", tmp_path / "m.yaml", tmp_path / "a.csv", "-o", tmp_path / "a.mcap")
    assert (done.returncode, done.stdout) == (2, "") and done.stderr.count("\n") == 1
    assert (
        done.stderr.startswith("epa import: ")
        and "a.csv:3: column 'x': found 'two', expected a number" in done.stderr
    )
    assert not (tmp_path / "a.mcap").exists()
    done = epa_here("import", tmp_path / "m.yaml", tmp_path / "a.csv")
    assert done.returncode == 2 and "found no log to write, expected -o" in done.stderr


def test_the_log_is_there_although_nobody_reads_what_is_printed(tmp_path):
    (tmp_path / "m.yaml").write_text(MAPPING)
    (tmp_path / "a.csv").write_text("x\n1\n2\n3\n")
    reads, writes = os.pipe()
    os.close(reads)
    with os.fdopen(writes, "wb") as hung_up:
        subprocess.run(
            [
                sys.executable,
                "-m",
                "epa_rt",
                "import",
                tmp_path / "m.yaml",
                tmp_path / "a.csv",
                "-o",
                tmp_path / "a.mcap",
            ],
            cwd=ROOT,
            stdout=hung_up,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
            check=False,
        )
    assert (tmp_path / "a.mcap").exists()

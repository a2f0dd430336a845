"""Tables for other programs: every number to its last bit, and files whole or not at all."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest
import scipy.io
from pyarrow import parquet

from epa_rt.cli.main import main
from epa_rt.runs.new_file import write_new
from epa_rt.runs.table import Named, table_of
from tests.cli.shell import ROOT


@pytest.fixture(scope="module")
def files(logs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    for ending in ("csv", "parquet", "mat"):
        assert main(["export", str(logs["first"]), "-o", str(folder / f"run.{ending}")]) == 0
    return folder


def by_csv(files):
    return pd.read_csv(files / "run.csv")


def by_parquet(files):
    return pd.read_parquet(files / "run.parquet")


def by_arrow(files):
    table = parquet.read_table(files / "run.parquet")
    return {name: table[name].to_numpy(zero_copy_only=False) for name in table.column_names}


def by_scipy(files):
    return scipy.io.loadmat(files / "run.mat", simplify_cells=True)["run"]


@pytest.mark.parametrize("read", [by_csv, by_parquet, by_arrow, by_scipy])
def test_every_number_comes_back_with_its_last_bit(read, files, runs):
    found, run = read(files), runs["first"]
    assert set(run.signals) < set(found)
    assert any(np.isnan(values).any() for values in run.signals.values())
    for name, values in run.signals.items():
        assert np.asarray(found[name], np.float64).tobytes() == values.tobytes(), name
    for name in ("cycle", "t_ns", "flags", "lateness_ns", "invalid_mask"):
        assert np.array_equal(np.asarray(found[name]).astype(np.int64), run.cycle[name]), name
    assert np.asarray(found["t_s"]).tobytes() == run.t_s.tobytes()


def test_counts_stay_whole_numbers(files):
    for found in (by_csv(files), by_parquet(files), by_scipy(files)):
        assert np.issubdtype(np.asarray(found["drive_status_raw"]).dtype, np.integer)


def test_states_phases_and_trials_stand_in_each_row(files, runs):
    run = runs["first"]
    (trial,) = run.trials
    for found in (by_csv(files), by_parquet(files)):
        rows = found[found["trial"] == 1]
        assert (rows.index[0], len(rows)) == (trial.begin, trial.end - trial.begin)
        assert set(rows["phase"]) == {trial.name} and set(rows["state"]) == {"run"}
        assert found["phase"][0] != found["phase"][0] and found["state"][0] == "bring_up"
    mat = by_scipy(files)
    names = mat["phase_names"][mat["phase"][trial.samples] - 1]
    assert set(names) == {trial.name} and mat["phase"][0] == 0


def test_units_events_and_who_ran_come_along(files, runs):
    events = [event.text for event in runs["first"].events]
    beside = json.loads((files / "run.about.json").read_text())
    attrs = by_parquet(files).attrs
    mat = by_scipy(files)
    for units in (beside["units"], attrs["units"], mat["units"]):
        assert units["muscle_pressure_pa"] == "Pa" and units["motor_torque_nm"] == "N*m"
    schema = parquet.read_schema(files / "run.parquet")
    assert schema.field("muscle_force_n").metadata == {b"unit": b"N"}
    assert json.loads(mat["about"])["record"]["operator"] == "Ada"
    for found in (beside, attrs):
        assert [event["text"] for event in found["events"]] == events
        assert found["record"]["operator"] == "Ada" and found["outcome"] == "completed"
        (trial,) = found["trials"]
        assert trial["last_cycle"] - trial["begin_cycle"] + 1 == len(
            by_csv(files).query("trial==1")
        )
    assert [json.loads(text)["text"] for text in mat["events"]] == events


def test_infinity_nan_and_unknown_names_survive(runs, tmp_path):
    import dataclasses

    from epa_rt.runs.export import WRITERS

    run = runs["first"]
    odd = run.signals["muscle_force_n"].copy()
    odd[:6] = [np.inf, -np.inf, np.nan, -0.0, 5e-324, 1.7976931348623157e308]
    state = run.cycle["state"].copy()
    state[3] = 99
    run = dataclasses.replace(
        run, signals=run.signals | {"muscle_force_n": odd}, cycle=run.cycle | {"state": state}
    )
    table = table_of(run, slice(0, 50), ("muscle_force_n",))
    column = table.columns["state"]
    assert isinstance(column, Named) and column.texts()[3] == ""
    for ending, write in WRITERS.items():
        with (tmp_path / f"odd{ending}").open("wb") as file:
            write(table, file)
    for found in (
        pd.read_csv(tmp_path / "odd.csv"),
        pd.read_parquet(tmp_path / "odd.parquet"),
        scipy.io.loadmat(tmp_path / "odd.mat", simplify_cells=True)["run"],
    ):
        assert np.asarray(found["muscle_force_n"], float).tobytes() == odd[:50].tobytes()


def test_one_trial_and_chosen_signals(logs, runs, tmp_path):
    out = tmp_path / "trial.csv"
    words = ["export", str(logs["first"]), "-o", str(out), "--trial", "1", "--signals"]
    assert main([*words, "muscle_*", "motor_travel_m"]) == 0
    found, run = pd.read_csv(out), runs["first"]
    samples = run.trials[0].samples
    assert found["muscle_force_n"].to_numpy().tobytes() == (
        run.signals["muscle_force_n"][samples].tobytes()
    )
    assert "motor_current_a" not in found and "motor_travel_m" in found


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["-o", "x.xlsx"], "expected .csv or .parquet or .mat"),
        (["-o", "x.csv", "--trial", "2"], "found no trial 2, expected 1 to 1"),
        (["-o", "x.csv", "--signals", "knee*"], "found no signal 'knee*'"),
    ],
)
def test_what_cannot_be_written_is_said_in_a_sentence(
    options, words, logs, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(logs["first"]), *options]) == 2
    assert words in capsys.readouterr().err and not list(tmp_path.iterdir())


def test_nothing_is_written_over(files, logs, tmp_path, capsys):
    for name in ("run.mat", "run.about.json"):
        (tmp_path / name).write_text("precious")
    for out in ("run.mat", "run.csv"):
        assert main(["export", str(logs["first"]), "-o", str(tmp_path / out)]) == 2
        assert "found a file" in capsys.readouterr().err
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "run.mat": "precious",
        "run.about.json": "precious",
    }
    assert main(["export", str(logs["first"]), "-o", str(tmp_path / "run.mat"), "--force"]) == 0
    # not even with --force over a log
    disguised = tmp_path / "log.csv"
    disguised.write_bytes(logs["first"].read_bytes())
    assert main(["export", str(logs["first"]), "-o", str(disguised), "--force"]) == 2
    assert disguised.read_bytes() == logs["first"].read_bytes()


@pytest.mark.parametrize("error", [KeyboardInterrupt, OSError(28, "No space left on device")])
def test_an_interruption_leaves_nothing(error, tmp_path):
    def half(file):
        file.write(b"half of it")
        raise error

    with pytest.raises((KeyboardInterrupt, OSError)):
        write_new(tmp_path / "new.csv", half)
    assert not list(tmp_path.iterdir())


def test_a_file_that_comes_meanwhile_stays(tmp_path):
    path = tmp_path / "new.csv"

    def write(file):
        file.write(b"ours")
        path.write_bytes(b"theirs")

    with pytest.raises(FileExistsError):
        write_new(path, write)
    assert path.read_bytes() == b"theirs" and list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_said_and_leaves_nothing(logs, tmp_path):
    """Full by a limit on the size of files, which the kernel refuses alike."""
    code = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000));"
        "from epa_rt.cli.main import main;"
        "print([main(['export', sys.argv[1], '-o', out]) for out in sys.argv[2:]])"
    )
    outs = [str(tmp_path / f"run.{ending}") for ending in ("csv", "parquet", "mat")]
    words = [sys.executable, "-c", code, str(logs["first"]), *outs]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "[4, 4, 4]\n", done.stderr
    assert done.stderr.count("cannot be written (File too large)") == 3
    assert "Traceback" not in done.stderr and [*tmp_path.iterdir()] == []

"""A log of a house rig that somebody else recorded: imported by the mapping that comes with it, diagnosed as far as it goes; nobody can run its experiment again."""

import argparse
import csv
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap_diagnose import _confirmed
from epa_rt.cli.gap_inputs import _with_rig, opened
from epa_rt.cli.inputs import RIG
from tests.cli.shell import RIGS, ROOT, epa
from tests.gap.recorded import recording_of

MAPPING = ROOT / "config/imports/bench_csv.yaml"
PER_SI = {"kPa gauge": 1e-3, "N": 1.0, "mm": 1e3, "mm/s": 1e3, "mNm": 1e3, "A": 1.0, "1": 1.0}


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    folder, log = tmp_path_factory.mktemp("imported"), recording_of("bench", "step")
    asked = yaml.safe_load(MAPPING.read_text())
    rows = {one["column"]: (log.columns[name] - (101_325.0 if one["unit"] == "kPa gauge" else 0.0)) * PER_SI[one["unit"]] for name, one in (asked["measured"] | asked["commands"]).items()}
    trial = np.zeros(log.samples)
    for k, span in enumerate((span for span in log.spans if span.trial), 1):
        trial[span.start:span.stop] = k
    rows = {"t": log.cycle * log.period_s, **rows, "trial": trial}
    with (folder / "own.csv").open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(rows)
        out.writerows(zip(*(np.char.mod("%.9g", values) for values in rows.values()), strict=True))
    done = epa("import", MAPPING, folder / "own.csv", "-o", folder / "own.mcap")
    assert done.returncode == 0, done.stdout + done.stderr
    return opened(argparse.Namespace(rig=RIGS / "bench.yaml", plant=None, logs=[folder / "own.mcap"]))


def test_it_is_read_like_the_log_that_it_is(imported):
    ours, theirs = recording_of("bench", "step"), imported.recordings[0]
    for name in ("muscle_force_n", "motor_travel_m", "muscle_pressure_pa"):
        assert np.allclose(theirs.columns[name], ours.columns[name], rtol=1e-6, atol=1e-6), name
    assert sum(span.trial for span in theirs.spans) == sum(span.trial for span in ours.spans)


def test_that_no_gate_can_run_it_again_is_said_and_breaks_nothing(imported):
    assert [one for one in imported.found if "experiment.yaml" in one and "gate" in one]
    assert RIG in imported.recordings[0].attachments
    bare = dataclasses.replace(imported.recordings[0], attachments={})  # of a mapping without a rig file
    assert _with_rig(bare, RIGS / "bench.yaml").attachments[RIG] == (RIGS / "bench.yaml").read_bytes()
    named = SimpleNamespace(effects=("leak",))
    assert _confirmed(imported, named, argparse.Namespace(no_gate=False, patch=None), lambda stage, share: None) is None


def test_a_control_file_that_ends_early_is_no_gap_of_the_drive(tmp_path):
    """The targets of the second half and more are missing: that is said, at the import and before any diagnosis."""
    log, asked = recording_of("bench", "step"), yaml.safe_load(MAPPING.read_text())
    asked.pop("trials")
    asked["rig_file"] = str(RIGS / "bench.yaml")
    for one in asked["measured"].values():
        one["file"] = "measured"
    for one in asked["commands"].values():
        one["file"] = "control"
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(asked, sort_keys=False))
    for file, section, rows in (("measured", "measured", log.samples), ("control", "commands", int(0.3 * log.samples))):
        columns = {one["column"]: (log.columns[name] - (101_325.0 if one["unit"] == "kPa gauge" else 0.0)) * PER_SI[one["unit"]] for name, one in asked[section].items()}
        with (tmp_path / f"{file}.csv").open("w", newline="") as into:
            out = csv.writer(into)
            out.writerow(["t", *columns])
            out.writerows(zip(*(np.char.mod("%.9g", values[:rows]) for values in (log.cycle * log.period_s, *columns.values())), strict=True))
    done = epa("import", tmp_path / "map.yaml", tmp_path / "measured.csv", tmp_path / "control.csv", "-o", tmp_path / "cut.mcap")
    assert done.returncode == 0 and "cmd_motor_travel_m has no value on " in done.stdout and "nothing is put in their place" in done.stdout, done.stdout + done.stderr
    with pytest.raises(VerbError, match="cut: cmd_muscle_inlet_open: found no valid value on .* rows .*, expected values throughout"):
        opened(argparse.Namespace(rig=RIGS / "bench.yaml", plant=None, logs=[tmp_path / "cut.mcap"]))

"""A log of a house rig that somebody else recorded: imported by the mapping that comes with it,
diagnosed as far as it goes; nobody can run its experiment again.
"""

import argparse
import csv
import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from epa_rt.cli.exits import VerbError
from epa_rt.cli.gap.diagnose import _confirmed
from epa_rt.cli.gap.inputs import _with_rig, opened
from epa_rt.cli.inputs import RIG
from epa_rt.config.source import ConfigError
from epa_rt.gap.rig.read import read_recording
from epa_rt.logs.importers.mapping import load_mapping
from epa_rt.logs.importers.rig_text import rig_text
from tests.cli.shell import RIGS, ROOT, epa_here
from tests.gap.recorded import recording_of

MAPPING = ROOT / "config/imports/bench_csv.yaml"
PER_SI = {"kPa gauge": 1e-3, "N": 1.0, "mm": 1e3, "mm/s": 1e3, "mNm": 1e3, "A": 1.0, "1": 1.0}


def written(path, columns):
    """Numbers under their heads, as a spreadsheet would write them."""
    with path.open("w", newline="") as file:
        out = csv.writer(file)
        out.writerow(columns)
        out.writerows(
            zip(*(np.char.mod("%.9g", values) for values in columns.values()), strict=True)
        )
    return path


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    folder, log = tmp_path_factory.mktemp("imported"), recording_of("bench", "step")
    asked = yaml.safe_load(MAPPING.read_text())
    rows = {
        one["column"]: (
            (log.columns[name] - (101_325.0 if one["unit"] == "kPa gauge" else 0.0))
            * PER_SI[one["unit"]]
        )
        for name, one in (asked["measured"] | asked["commands"]).items()
    }
    trial = np.zeros(log.samples)
    for k, span in enumerate((span for span in log.spans if span.trial), 1):
        trial[span.start : span.stop] = k
    rows = {"t": log.cycle * log.period_s, **rows, "trial": trial}
    done = epa_here("import", MAPPING, written(folder / "own.csv", rows), "-o", folder / "own.mcap")
    assert done.returncode == 0, done.stdout + done.stderr
    return opened(
        argparse.Namespace(rig=RIGS / "bench.yaml", plant=None, logs=[folder / "own.mcap"])
    )


def test_it_is_read_like_the_log_that_it_is(imported):
    ours, theirs = recording_of("bench", "step"), imported.recordings[0]
    for name in ("muscle_force_n", "motor_travel_m", "muscle_pressure_pa"):
        assert np.allclose(theirs.columns[name], ours.columns[name], rtol=1e-6, atol=1e-6), name
    assert sum(span.trial for span in theirs.spans) == sum(span.trial for span in ours.spans)


def test_that_no_gate_can_run_it_again_is_said_and_breaks_nothing(imported):
    assert [one for one in imported.found if "experiment.yaml" in one and "gate" in one]
    assert RIG in imported.recordings[0].attachments
    bare = dataclasses.replace(
        imported.recordings[0], attachments={}
    )  # of a mapping without a rig file
    assert (
        _with_rig(bare, RIGS / "bench.yaml").attachments[RIG] == (RIGS / "bench.yaml").read_bytes()
    )
    named = SimpleNamespace(effects=("leak",))
    assert (
        _confirmed(
            imported,
            named,
            argparse.Namespace(no_gate=False, patch=None),
            lambda stage, share: None,
        )
        is None
    )


def test_a_control_file_that_ends_early_is_no_gap_of_the_drive(tmp_path):
    """The targets of the second half and more are missing: that is said, at the import and before
    any diagnosis.
    """
    log, asked = recording_of("bench", "step"), yaml.safe_load(MAPPING.read_text())
    asked.pop("trials")
    asked["rig_file"] = str(RIGS / "bench.yaml")
    for one in asked["measured"].values():
        one["file"] = "measured"
    for one in asked["commands"].values():
        one["file"] = "control"
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(asked, sort_keys=False))
    for file, section, rows in (
        ("measured", "measured", log.samples),
        ("control", "commands", int(0.3 * log.samples)),
    ):
        columns = {
            one["column"]: (
                (log.columns[name] - (101_325.0 if one["unit"] == "kPa gauge" else 0.0))
                * PER_SI[one["unit"]]
            )
            for name, one in asked[section].items()
        }
        written(
            tmp_path / f"{file}.csv",
            {
                name: values[:rows]
                for name, values in {"t": log.cycle * log.period_s, **columns}.items()
            },
        )
    done = epa_here(
        "import",
        tmp_path / "map.yaml",
        tmp_path / "measured.csv",
        tmp_path / "control.csv",
        "-o",
        tmp_path / "cut.mcap",
    )
    assert (
        done.returncode == 0
        and "cmd_motor_travel_m has no value on " in done.stdout
        and "nothing is put in their place" in done.stdout
    ), done.stdout + done.stderr
    with pytest.raises(
        VerbError,
        match=(
            "cut: cmd_muscle_inlet_open: found no valid value on .* rows .*, expected values"
            " throughout"
        ),
    ):
        opened(
            argparse.Namespace(rig=RIGS / "bench.yaml", plant=None, logs=[tmp_path / "cut.mcap"])
        )


@pytest.mark.parametrize("after", [1, 0])
def test_commands_of_another_convention_are_put_where_the_house_has_them(tmp_path, after):
    """A simulator that writes the state and the command that acts next, or what was read at the end
    of the cycle of its commands.
    """
    log, asked, late = recording_of("bench", "step"), yaml.safe_load(MAPPING.read_text()), 2 - after
    asked |= {"rig_file": str(RIGS / "bench.yaml"), "answered_after": after, "trials": []}
    lost = np.delete(np.arange(log.samples), np.arange(700, 720))
    columns = {
        one["column"]: (
            (log.columns[name] - (101_325.0 if one["unit"] == "kPa gauge" else 0.0))
            * PER_SI[one["unit"]]
        )
        for name, one in asked["measured"].items()
    }
    columns |= {
        one["column"]: (
            np.concatenate([log.columns[name][:1].repeat(late), log.columns[name][:-late]])
            * PER_SI[one["unit"]]
        )
        for name, one in asked["commands"].items()
        if one["column"] not in columns
    }
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(asked, sort_keys=False))
    done = epa_here(
        "import",
        tmp_path / "map.yaml",
        written(
            tmp_path / "own.csv",
            {
                "t": (log.cycle * log.period_s)[lost],
                **{name: values[lost] for name, values in columns.items()},
            },
        ),
        "-o",
        tmp_path / "own.mcap",
    )
    assert done.returncode == 0 and f"commands are put {late} row" in done.stdout, (
        done.stdout + done.stderr
    )
    read = read_recording(tmp_path / "own.mcap")
    at = read.cycle - read.cycle[0]
    known = (at < 690) | ((at > 730) & (at < log.samples - 3))
    for name in ("cmd_motor_travel_m", "cmd_muscle_inlet_open"):
        assert np.allclose(read.columns[name][known], log.columns[name][at[known]], atol=1e-8), name


def test_rigs_of_others_have_no_such_convention(tmp_path):
    mapping = yaml.safe_load((ROOT / "config/imports/emps.yaml").read_text())
    mapping |= {"rig_file": str(ROOT / "config/rigs_foreign/emps.yaml"), "answered_after": 1}
    (tmp_path / "map.yaml").write_text(yaml.safe_dump(mapping, sort_keys=False))
    with pytest.raises(
        ConfigError,
        match="map.yaml:[0-9]+: answered_after: found 1 rows for a rig of others, expected none",
    ):
        rig_text(*load_mapping(tmp_path / "map.yaml"))

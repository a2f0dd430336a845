"""What a rig was asked to do, and what its drive says of itself, is missing: where it is read
nothing is judged, and above half of it nothing at all.
"""

import dataclasses

import numpy as np
import pytest

from epa_rt.gap.hygiene.check import check, clean
from epa_rt.gap.rig.foreign.dead import check_dead
from epa_rt.gap.rig.house.commands import commands_of, read_rows
from epa_rt.gap.rig.house.subject import open_house
from tests.cli.shell import RIGS
from tests.gap.foreign.made import subject_of, with_output
from tests.gap.recorded import PLANTS, column, recording_of, rig_of_name, written_over

RIG = rig_of_name("bench")
HOUSE = open_house(RIGS / "bench.yaml", PLANTS / "bench.yaml")
INLET, EXHAUST = "cmd_muscle_inlet_open", "cmd_muscle_exhaust_open"
ASKED = {"cmd_motor_travel_m": 8, "cmd_motor_speed_m_s": 9, "cmd_motor_torque_nm": 10}


def log():
    return recording_of("bench", "identification_short")


def used_target() -> str:
    """The target of the mode that the run is in for most of its trials."""
    read = read_rows(RIG, log().columns)
    return max(ASKED, key=lambda name: read[name].sum())


@pytest.mark.parametrize("name", [None, INLET, EXHAUST, "drive_status_raw", "drive_mode_raw"])
def test_what_is_missing_above_half_is_refused(name):
    name = name or used_target()
    damaged = written_over(name, np.nan, int(0.3 * log().samples))(log())
    refused = [f for f in check([damaged], RIG) if f.severity == "refuse"]
    assert [(f.kind, f.channel) for f in refused] == [("dropped channel", name)], [
        f.says for f in refused
    ]
    assert (
        "found no valid value on " in refused[0].says
        and "expected values throughout" in refused[0].says
    )


@pytest.mark.parametrize("name", [None, INLET, EXHAUST, "drive_status_raw", "drive_mode_raw"])
def test_where_less_is_missing_no_channel_is_judged(name):
    name = name or used_target()
    damaged = written_over(name, np.nan, 9000, 9300)(log())
    (finding,) = check([damaged], RIG)
    assert (
        (finding.severity, finding.kind, finding.rows) == ("exclude", "invalid", ((9000, 9302),))
        and name in finding.says
        and finding.says.endswith("no channel is judged there, and free run not on this log")
    )
    cleaned = clean([damaged], [finding])[0]
    for measured in ("muscle_pressure_pa", "muscle_force_n", "motor_travel_m", "motor_current_a"):
        assert np.flatnonzero(np.isnan(cleaned.columns[measured])).tolist() == list(
            range(9000, 9302)
        )


def test_a_target_of_a_mode_that_is_not_used_may_be_missing():
    read = read_rows(RIG, log().columns)
    idle = [name for name in ASKED if not read[name].any()]
    assert idle
    for name in (*idle, "cmd_drive_control_raw", "cmd_drive_mode_raw", "drive_error_raw"):
        assert check([written_over(name, np.nan)(log())], RIG) == ()


def test_a_target_may_be_missing_while_the_drive_is_off():
    name = used_target()
    off = ~read_rows(RIG, log().columns)["drive_mode_raw"]
    assert off.any()
    assert check([column(log(), name, np.where(off, np.nan, log().columns[name]))], RIG) == ()


def test_cycles_without_process_data_are_said_of_the_channels_alone():
    gone = {
        row.name: np.where(np.arange(log().samples) // 5 == 1800, np.nan, log().columns[row.name])
        for row in RIG.inputs
    }
    findings = check([dataclasses.replace(log(), columns=log().columns | gone)], RIG)
    assert findings and not [f for f in findings if "_raw" in f.says]


def test_before_the_first_value_a_valve_is_safe():
    """A normally open exhaust vents until it is told otherwise; without a word the drive is off."""
    columns = {name: values.copy() for name, values in log().columns.items()}
    for name in (INLET, EXHAUST, "drive_status_raw"):
        columns[name][:500] = np.nan
    commands = commands_of(RIG, columns)
    assert (
        np.all(commands["exhaust"][:502, 0] == 1.0)
        and not commands["inlet"][:502, 0].any()
        and not commands["enabled"][:500].any()
    )


@pytest.mark.parametrize(
    ("experiment", "name", "start", "stop", "followed"),
    [
        ("step", "cmd_motor_travel_m", 9000, 9300, False),
        ("step", "cmd_motor_travel_m", 9000, 9003, True),
        ("identification_short", "cmd_motor_speed_m_s", 9000, 9003, False),
        ("identification_short", INLET, 9000, 9300, False),
        ("identification_short", INLET, 9000, 9003, True),
        ("identification_short", EXHAUST, 0, 300, True),
        ("identification_short", "drive_status_raw", 0, 300, True),
        ("identification_short", "drive_status_raw", 9000, 9300, False),
    ],
)
def test_free_run_follows_a_log_of_which_a_few_cycles_are_missing(
    experiment, name, start, stop, followed
):
    """Where a target is missing for long, or leaps from cycle to cycle, the motor is elsewhere ever
    after.
    """
    damaged = written_over(name, np.nan, start, stop)(recording_of("bench", experiment))
    (finding,) = check([damaged], RIG)
    assert (
        HOUSE.told(clean([damaged], [finding])[0]) == followed
        and ("free run not on this log" in finding.says) != followed
    )


def test_a_target_that_is_missing_for_a_few_cycles_goes_on_in_a_straight_line():
    step = recording_of("bench", "step")
    moving = int(np.argmax(np.abs(np.diff(step.columns["cmd_motor_travel_m"]))))
    missing = dict(written_over("cmd_motor_travel_m", np.nan, moving, moving + 3)(step).columns)
    asked, whole = (
        commands_of(RIG, columns)["target_angle_rad"] for columns in (missing, step.columns)
    )
    assert (
        np.allclose(asked, whole, atol=2e-3 * np.ptp(whole))
        and np.diff(asked[moving : moving + 7]).all()
    )


@pytest.mark.parametrize(("share", "severity"), [(0.6, "refuse"), (0.1, "exclude")])
def test_what_a_drive_of_others_is_asked_may_not_be_missing(share, severity):
    subject, recording = subject_of("servo"), with_output("servo", {})
    name = subject.rig.channels["command"]
    holed = {
        **recording.columns,
        name: np.where(
            np.arange(recording.samples) < share * recording.samples,
            np.nan,
            recording.columns[name],
        ),
    }
    (finding,) = check_dead([dataclasses.replace(recording, columns=holed)], subject.rig)
    assert (finding.severity, finding.channel) == (
        severity,
        name,
    ) and "found no valid value on " in finding.says


def test_a_column_that_the_log_lacks_is_said_once():
    less = dataclasses.replace(
        log(), columns={k: v for k, v in log().columns.items() if k != EXHAUST}
    )
    assert [f.kind for f in check([less], RIG) if f.severity == "refuse"] == ["log"]

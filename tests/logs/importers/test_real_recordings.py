"""Recordings of others, with the mappings in config/imports: the numbers that their README files
give.
"""

from pathlib import Path

import numpy as np
import pytest

from epa_rt.gap.hygiene.check import check
from epa_rt.gap.rig.read import read_recording

ROOT = Path(__file__).resolve().parents[3]
DATA, IMPORTS = ROOT.parent / "shared/data", ROOT / "config/imports"


def data(*names: str) -> list[Path]:
    paths = [DATA / name for name in names]
    if not all(path.exists() for path in paths):
        pytest.skip(f"the recording {names[0]} is not beside the checkout (../shared/data)")
    return paths


def test_emps(imported):
    from scipy.io import loadmat

    files = data("emps/DATA_EMPS.mat")
    _, _, log = imported(IMPORTS / "emps.yaml", *files)
    recording, truth = read_recording(log), loadmat(files[0])
    assert recording.samples == 24841 and np.all(np.diff(recording.cycle) == 1)
    assert np.array_equal(recording.columns["carriage_position_m"], truth["qm"].ravel())
    assert np.allclose(
        recording.columns["motor_force_n"], 35.1507 * truth["vir"].ravel(), rtol=1e-4
    )
    laps = [
        recording.columns["ref_carriage_position_m"][s.start : s.stop] for s in recording.spans[:3]
    ]
    assert np.allclose(laps[0], laps[1], atol=1e-12) and np.allclose(laps[1], laps[2], atol=1e-12)
    assert not [f.says for f in check([recording], None)]


def test_emps_with_pulses(imported):
    _, _, log = imported(IMPORTS / "emps_pulses.yaml", *data("emps/DATA_EMPS_PULSES.mat"))
    assert set(np.unique(read_recording(log).columns["cmd_pulse_force_n"])) == {0.0, 5.0}


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [
        ("Aluminium", 7.316, 7.285),
        ("Prusa", 7.645, 7.548),
        ("Formlabs", 7.796, 7.753),
        ("Ultimaker_006", 7.825, 7.772),
        ("Ultimaker_010", 7.531, 7.425),
        ("Ultimaker_015", 7.652, 0.078),
        ("Ultimaker_020", 7.671, 0.035),
    ],
)
def test_chambers(imported, name, first, last):
    _, _, log = imported(
        IMPORTS / "zillen_chamber.yaml", *data(f"zillen_pneumatic/chambers/{name}.csv")
    )
    recording = read_recording(log)
    gauge_bar = (recording.columns["chamber_pressure_pa"] - 101_325.0) / 1e5
    assert gauge_bar[:10].mean() == pytest.approx(first, abs=0.005) and gauge_bar[
        -10:
    ].mean() == pytest.approx(last, abs=0.005)
    assert recording.period_s == pytest.approx(0.1) and 140 < recording.cycle[-1] * 0.1 < 152
    assert {f.kind for f in check([recording], None)} <= {"lost cycles"}


@pytest.mark.parametrize(
    "name", ["friction/O-ring_3bar", "friction/Kidney_1bar", "repeatability/rerun_1_O-ring257_1bar"]
)
def test_strokes_of_a_piston(imported, name):
    files = data(f"zillen_pneumatic/{name}.csv")
    code, said, log = imported(IMPORTS / "zillen_friction.yaml", *files)
    recording = read_recording(log)
    assert "by linear interpolation" in said and recording.period_s == pytest.approx(0.01)
    assert (
        0.02 < np.ptp(recording.columns["piston_position_m"]) < 0.06
        and recording.columns["chamber_pressure_pa"].min() > 101_325.0
    )


def test_servo_joints(imported):
    files = data("sage_so101/chirp_sweep/control.csv", "sage_so101/chirp_sweep/state_motor.csv")
    _, said, log = imported(IMPORTS / "sage_so101.yaml", *files)
    recording = read_recording(log)
    assert "6000 rows were put onto 6018 cycles of 20 ms" in said
    for joint in ("rotation", "pitch", "elbow", "wrist_pitch", "wrist_roll", "jaw"):
        position, command = (
            recording.columns[f"{joint}_position_rad"],
            recording.columns[f"cmd_{joint}_position_rad"],
        )
        assert np.corrcoef(position, command)[0, 1] > 0.2 and np.ptp(command) < 1.0
    assert not [f.says for f in check([recording], None) if f.severity == "refuse"]


def test_a_chamber_with_the_mapping_of_the_piston_is_refused(imported):
    code, said, _ = imported(
        IMPORTS / "zillen_friction.yaml", *data("zillen_pneumatic/chambers/Prusa.csv")
    )
    assert code == 2 and "may be the delimiter" in said

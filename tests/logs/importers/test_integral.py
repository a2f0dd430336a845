"""A speed becomes a place by ``integral: true``, for rigs whose place nobody measured."""

import numpy as np
import pytest

from epa_rt.cli.main import main
from epa_rt.gap.rig.read import read_recording

HZ, ROWS = 500, 2000
RPM = 60 / (2 * np.pi)
MAPPING = """mapping: motor
rig: motor
format: {kind: csv, missing: ["nan"]}
clock: {column: t, unit: s, period: 2 ms}
measured:
  motor_angle_rad: {column: speed, unit: rpm, integral: true}
"""
T_S = np.arange(ROWS) / HZ
ALL, NONE = np.ones(ROWS, bool), np.zeros(ROWS, bool)


def recorded(folder, keep=ALL, lost=NONE):
    path = folder / "motor.csv"
    speed = np.where(lost, np.nan, 3.0 * np.cos(3.0 * T_S) * RPM)
    rows = [f"{t:.3f},{w:.9g}" for t, w in zip(T_S[keep], speed[keep], strict=True)]
    path.write_text("t,speed\n" + "\n".join(rows) + "\n")
    return path


def test_it_is_the_place_from_0_on_and_that_is_said(tmp_path, imported):
    code, said, log = imported(MAPPING, recorded(tmp_path))
    assert code == 0, said
    assert "motor_angle_rad is column speed added up over time, from 0 on" in said
    found = read_recording(log).columns["motor_angle_rad"]
    assert found == pytest.approx(np.sin(3.0 * T_S), abs=1e-5)  # a trapezoid's error, (w h)^2 / 12


def test_lost_rows_and_lost_values_are_crossed_and_stay_lost(tmp_path, imported):
    keep, lost = ALL.copy(), NONE.copy()
    keep[700:705], lost[900:903] = False, True
    code, said, log = imported(MAPPING, recorded(tmp_path, keep, lost))
    assert code == 0, said
    found = read_recording(log).columns["motor_angle_rad"]
    assert len(found) == ROWS - 5
    assert np.array_equal(np.isnan(found), lost[keep])
    there = ~lost[keep]
    assert found[there] == pytest.approx(np.sin(3.0 * T_S[keep][there]), abs=2e-4)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (
            "motor_angle_rad: {column: speed, unit: rad, integral: true}",
            "found the unit 'rad', expected a unit of rad/s, as the speed of motor_angle_rad has",
        ),
        (
            "motor_speed_rad_s: {column: speed, unit: rpm, integral: true}",
            "found 'integral' for motor_speed_rad_s, expected it for a place or an angle",
        ),
    ],
)
def test_what_has_no_speed_or_another_unit_is_refused(line, says, tmp_path, imported):
    wrong = MAPPING.replace(MAPPING.splitlines()[-1].strip(), line)
    code, said, log = imported(wrong, recorded(tmp_path))
    assert code == 2 and not log.exists()
    assert f"map_1.yaml:6: measured.{line.partition(':')[0]}: {says}" in said


def test_a_draft_has_it_where_no_place_is_measured(tmp_path, capsys):
    path, out = recorded(tmp_path), tmp_path / "draft.yaml"
    path.write_text(path.read_text().replace("t,speed", "t,motor_speed_rpm"))
    assert main(["import", "--guess", str(path), "-o", str(out)]) == 0
    text = out.read_text()
    marked = "  # motor_angle_rad: {column: motor_speed_rpm, unit: rpm, integral: true}"
    assert marked in text
    out.write_text(text.replace(marked, marked.replace("# ", "")))
    assert main(["import", str(out), str(path), "--dry"]) == 0
    assert "motor_angle_rad" in capsys.readouterr().out

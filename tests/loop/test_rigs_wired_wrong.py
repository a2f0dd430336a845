"""Rig files that no check of the file can tell from right ones: found with the rig, named, and
before 1.1 times any limit. The files are read in place.
"""

from pathlib import Path

import pytest

from epa_rt.cli.inputs import load_inputs
from epa_rt.config.source import ConfigError
from tests.loop.sensor_scenarios import EXPERIMENT, ROOT, run_with

CASES = ROOT.parent / "shared/cases/rigs_wired_wrong"
FOUND = (
    ("joint_lever_sign_flipped", "knee", "sign of the joint's lever_arm"),
    ("pressures_swapped_between_muscles", "knee", "(exchanged)"),
)
LAW = (
    "valves: {supply: 850 kPa gauge}\n"
    "  law: {braid_length: 207.8 mm, braid_turns: 3.05, rest_length: 120 mm, lock_length: 145 mm,"
    " force: muscle_force_n}\n"
)


def case(name: str, rig: str, folder: Path, law: bool = False):
    path = CASES / f"{name}.yaml"
    if not path.is_file():
        pytest.skip(f"no {path.name} beside this checkout")
    text = path.read_text(encoding="utf-8")
    if law:
        text = text.replace(
            "  pressure_max: 780 kPa gauge\n", f"  pressure_max: 780 kPa gauge\n  {LAW}"
        )
    (folder / "rig.yaml").write_text(text, encoding="utf-8")
    return load_inputs(
        ROOT / f"config/experiments/{EXPERIMENT[rig]}.yaml",
        folder / "rig.yaml",
        ROOT / f"config/plants/{rig}.yaml",
        with_plant=True,
    )


@pytest.mark.parametrize(("name", "rig", "suspect"), FOUND)
def test_a_rig_that_is_wired_wrong_is_found_and_the_suspect_named(name, rig, suspect, tmp_path):
    _, result, truth = run_with(case(name, rig, tmp_path), None, 0)
    assert result.outcome == "tripped" and suspect in result.cause, result.cause
    assert max(truth.largest.values()) < 1.1, truth.largest


def test_exchanged_valves_are_refused_by_what_they_do_without_power(tmp_path):
    with pytest.raises(ConfigError, match="an exhaust of 'muscle' that is shut without power"):
        case("inlet_exhaust_rows_swapped_in_muscles", "bench", tmp_path)


def test_with_the_muscles_law_half_a_travel_is_found_sooner(tmp_path):
    inputs = case("travel_speed_cmd_calibration_half", "bench", tmp_path, law=True)
    _, result, truth = run_with(inputs, None, 0)
    assert result.outcome == "tripped" and "motor_travel_m" in result.cause, result.cause
    assert max(truth.largest.values()) < 1.0, truth.largest

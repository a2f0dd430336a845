"""Every branch of epa_rt/safety is taken by these tests."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# they run the others, or come to no branch that these do not, in most of the time
UNNEEDED = (
    "test_coverage.py",
    "test_mutants.py",
    "test_nothing_forbidden_leaves.py",
    "test_laws_recorded.py",
)
LONG = (
    "test_bus_budget.py::test_losses_below_the_share_go_on_for_ever",
    "test_contradiction.py::test_every_second_wake_up_late_is_silent_in_a_minute",
    "test_contradiction.py::test_perfect_motion_is_silent_however_late_the_loop_wakes",
    "test_index_guard.py::test_whatever_the_count_becomes_travel_goes_on",
    "test_let_down.py::test_after_a_trip_only_safe_stop_or_let_down_outputs_leave",
    "test_let_down.py::test_it_goes_to_the_rest_place_and_stays_there",
    "test_let_down.py::test_without_a_bound_on_following_and_under_a_speed_the_time_bounds_it",
    "test_limits_and_words.py::test_limits_and_slew_cut_and_count_exactly",
    "test_limits_and_words.py::test_only_known_words_and_modes_leave",
    "test_recovery.py::test_only_a_homing_run_knows_the_homing_mode_and_no_other",
    "test_sensors_at_rest.py::test_what_lies_within_its_hint_is_passed_without_a_word",
    "test_sensors_in_motion.py::test_a_sound_muscle_in_motion_is_never_refused",
    "test_thermal.py::test_heat_of_a_held_current_is_the_closed_form",
)


def test_every_branch_of_safety_is_taken(tmp_path):
    environment = os.environ | {"COVERAGE_FILE": str(tmp_path / "coverage")}
    coverage = [sys.executable, "-m", "coverage"]
    ignored = [f"--ignore={ROOT / 'tests/safety' / name}" for name in UNNEEDED]
    run = [
        *coverage,
        "run",
        "--branch",
        f"--source={ROOT / 'epa_rt/safety'}",
        "-m",
        "pytest",
        str(ROOT / "tests/safety"),
        *ignored,
        *(f"--deselect=tests/safety/{name}" for name in LONG),  # as node ids begin
    ]
    tests = subprocess.run(run, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert tests.returncode == 0, tests.stdout[-3000:] + tests.stderr
    assert re.search(r"\b[1-9]\d* deselected", tests.stdout), tests.stdout[-300:]
    report = tmp_path / "coverage.json"
    subprocess.run(
        [*coverage, "json", "-q", "-o", str(report)], cwd=ROOT, env=environment, check=True
    )
    files = json.loads(report.read_text())["files"]
    assert {Path(name).name for name in files} >= {
        "commands.py",
        "envelope.py",
        "let_down.py",
        "stopping.py",
        "thermal.py",
        "trip.py",
    }
    for name, found in files.items():
        assert found["summary"]["percent_covered"] == 100.0, (
            name,
            found["missing_lines"],
            found["missing_branches"],
        )
        assert found["summary"]["num_partial_branches"] == 0

"""The rig file's holding brake, and what bounds the end of a run: read, and refused where wrong."""

from pathlib import Path

import pytest

from epa_rt.config.rig import rig_from
from epa_rt.config.source import ConfigError, parse_yaml

RIGS = Path(__file__).resolve().parents[2] / "config" / "rigs"
INLET = "  - {name: cmd_muscle_inlet_open"


def rig(brake: str = "", row: str = "", name: str = "bench", safety: str = ""):
    text = (RIGS / f"{name}.yaml").read_text(encoding="utf-8")
    if brake:
        places = "  places: {no_load"
        text = text.replace(places, f"  brake: {brake}\n{places}", 1)
    text = text.replace(INLET, f"  - {row}\n{INLET}" if row else INLET, 1)
    text = text.replace("safety:", f"safety:\n  {safety}" if safety else "safety:", 1)
    return rig_from(parse_yaml(text, "rig.yaml"))


def test_a_brake_on_an_output_and_one_of_the_drive_are_read():
    found = rig("{output: cmd_brake_open}", "{name: cmd_brake_open, entry: valves.ch4}").motor.brake
    assert (found.output, found.drive, found.release_delay, found.close_delay) == (
        "cmd_brake_open",
        False,
        0.05,
        0.05,
    )
    found = rig("{drive: true, release_delay: 0.2 s}").motor.brake
    assert (found.output, found.drive, found.release_delay) == (None, True, 0.2)
    assert rig().motor.brake is None


@pytest.mark.parametrize(
    ("brake", "row", "name", "said"),
    [
        ("{release_delay: 1 s}", "", "bench", "neither of 'output' and 'drive: true'"),
        (
            "{output: cmd_brake_open, drive: true}",
            "{name: cmd_brake_open, entry: valves.ch4}",
            "bench",
            "both of 'output' and 'drive: true'",
        ),
        ("{output: cmd_no_such_open}", "", "bench", "cmd_no_such_open"),
        ("{output: cmd_motor_speed_m_s}", "", "bench", "a digital row"),
        (
            "{output: cmd_brake_open}",
            "{name: cmd_brake_open, entry: valves.ch4, inverted: true, safe: 1}",
            "bench",
            "releases the brake",
        ),
        ("{output: cmd_muscle_inlet_open}", "", "bench", "switches something else"),
        ("{output: cmd_drive_enable}", "", "bench_analog", "switches something else"),
    ],
)
def test_a_brake_that_cannot_hold_is_refused_with_its_line(brake, row, name, said):
    with pytest.raises(ConfigError) as refused:
        rig(brake, row, name)
    assert said in str(refused.value)


def test_bounds_of_the_end_have_defaults_and_are_bounded():
    safety = rig().safety
    assert (safety.rest_timeout, safety.stop_overspeed, safety.stop_time, safety.current_off) == (
        10.0,
        1.2,
        2.0,
        0.1,
    )
    assert rig(safety="rest_timeout: 30 s").safety.rest_timeout == 30.0
    for wrong in ("rest_timeout: 0.1 s", "stop_overspeed: 0.9", "stop_time: 0.5"):
        with pytest.raises(ConfigError):
            rig(safety=wrong)

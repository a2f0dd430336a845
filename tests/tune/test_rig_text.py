"""A rig file with other gains: every comment and line stays, only the numbers change."""

import difflib
from pathlib import Path

import pytest

from epa_rt.config.rig import rig_from
from epa_rt.config.source import parse_yaml
from epa_rt.tune.controller import Gains, TuneError, gains_of_joint
from epa_rt.tune.rig_text import text_with

JOINT = Gains(1.91, 34.8, 0.237, 12.2, 22.1, 2.16, 0.273, 0.0123)
RIGS = sorted(Path("config/rigs").glob("*.yaml"))


@pytest.mark.parametrize("path", RIGS, ids=lambda path: path.stem)
def test_only_the_lines_of_the_gains_change(path):
    text = path.read_text("utf-8")
    rig = rig_from(parse_yaml(text, path))
    new = text_with(text, "motor", Gains(40.7))
    if rig.joint is not None:
        new = text_with(new, "joint", JOINT)
    read = rig_from(parse_yaml(new, path))
    assert read.motor.position_gain == 40.7
    if read.joint is not None:
        assert gains_of_joint(read) == JOINT
    changed = [
        line[2:]
        for line in difflib.ndiff(text.splitlines(), new.splitlines())
        if line.startswith("- ")
    ]
    assert all("pid:" in line or "feedforward" in line or "gain" in line for line in changed)
    assert [line for line in text.splitlines() if "#" in line] == [
        line for line in new.splitlines() if "#" in line
    ]


def test_keys_that_the_file_lacks_are_put_behind_the_last_one():
    block = "motor:\n  position: travel_m  # m\njoint:\n  pid:\n    kp: 2  # per travel\n"
    new = text_with(block, "joint", Gains(3.0, 1.0))
    assert "    kp: 3  # per travel\n    ki: 1 1/s\n" in new
    flow = "joint: {pid: {kp: 2}}\n"
    assert "{kp: 3, ki: 1 1/s, kd: 0 s," in text_with(flow, "joint", Gains(3.0, 1.0))
    assert text_with("motor:\n  position: travel_m", "motor", Gains(7.0)).endswith(
        "travel_m\n  position_gain: 7 1/s"
    )


def test_a_file_without_the_section_is_refused():
    with pytest.raises(TuneError, match="without 'joint.pid'"):
        text_with("motor: {position: travel_m}\n", "joint", JOINT)

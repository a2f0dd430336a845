"""A trip whose motor is let down replays byte for byte, the way to the rest place included."""

import pytest

from epa_rt.cli.main import main
from epa_rt.logs.reader import LogReader
from tests.cli.shell import EXPERIMENTS, RIGS


@pytest.mark.parametrize("rig", ["bench", "bench_analog"])
def test_a_let_down_replays(rig, tmp_path, capsys):
    """A muscle has no time to vent within 0.6 s."""
    text = (RIGS / f"{rig}.yaml").read_text()
    for old, new in (
        ("limits: [-40 N, 350 N]", "limits: [-40 N, 30 N]"),
        ("../plants/bench.yaml", str(RIGS.parent / "plants/bench.yaml")),
        ("safety:", "safety:\n  rest_timeout: 0.6 s"),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "weak.yaml").write_text(text)
    log = tmp_path / "down.mcap"
    words = ("--rig", str(tmp_path / "weak.yaml"), "-o", str(log), "--quiet")
    assert main(["run", str(EXPERIMENTS / "identification_short.yaml"), *words]) in (3, 23)
    with LogReader(log) as reader:
        states = reader.columns("/cycle")["state"]
        passed = [reader.layout.states[i] for i in dict.fromkeys(states.tolist())]
    assert passed[-5:] == ["brake", "vent", "let_down", "safe", "done"]
    assert "the motor was let down under power to no_load" in capsys.readouterr().out
    assert main(["replay", str(log)]) == 0
    assert "every output byte identical" in capsys.readouterr().out

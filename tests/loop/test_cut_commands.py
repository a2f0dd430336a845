"""What a controller cuts before the gate can see it is counted and said, beside what the gate
cuts.
"""

import pytest

from epa_rt.cli.inputs import load_inputs
from epa_rt.cli.main import main
from epa_rt.cli.run import closing_text, run_simulated
from epa_rt.loop.supervisor import RUN
from epa_rt.report.measures.health import health_of
from epa_rt.report.run import load_run
from epa_rt.report.sections.health import health
from tests.loop.rigging import ROOT, TINY, run_in_memory, tiny_inputs

SPEED, TORQUE = "cmd_motor_speed_m_s", "cmd_motor_torque_nm"
EAGER = (
    "position_gain: 10 1/s",
    "position_gain: 400 1/s",
)  # asks for more than the drive's 80 mm/s
PUSH = """
experiment: push
loop: motor_torque
seed: 1
phases:
  - {name: push, step: {levels: [100 mNm], rise: 1 ms, dwell: 20 ms, times: 1}}
"""


def inputs_of(folder, experiment, change):
    """The bench with one line of its file changed, beside its plant."""
    text = (ROOT / "config/rigs/bench.yaml").read_text()
    assert change[0] in text
    for name in ("rigs", "plants"):
        (folder / name).mkdir()
    (folder / "plants/bench.yaml").write_bytes((ROOT / "config/plants/bench.yaml").read_bytes())
    (folder / "rigs/bench.yaml").write_text(text.replace(*change))
    (folder / "asked.yaml").write_text(experiment)
    return load_inputs(folder / "asked.yaml", folder / "rigs/bench.yaml", None, with_plant=True)


def test_commands_cut_at_the_limit_are_counted_said_logged_and_shown(tmp_path, capsys):
    inputs = inputs_of(tmp_path, TINY.format(loop="motor_speed", pressure="150 kPa gauge"), EAGER)
    summary, result = run_simulated(inputs, tmp_path / "run.mcap", 1, None, progress=False)
    run = load_run(tmp_path / "run.mcap")
    cut = result.controller_clamped[SPEED]["motor_speed"]
    at_limit = int(((abs(run.signals[SPEED]) == 0.08) & (run.cycle["state"] == RUN)).sum())
    assert at_limit <= cut <= at_limit + 1 and cut > 100, (
        "the cycle that ends it is none of the state run"
    )
    assert SPEED not in result.clamped, "the gate finds nothing left to cut"
    assert (
        f"{SPEED} was clamped to its limits by the controller motor_speed in {cut} cycles"
        in closing_text(summary, result, inputs.rig)
    )
    data = next(event.data for event in run.events if event.kind == "summary")
    assert data["controller_clamped"] == {SPEED: {"motor_speed": cut}}
    shown = next(one for one in health_of(run) if one.row.name == SPEED)
    assert (shown.clamped, shown.controller_clamped) == (0, cut)
    assert f"▲ {cut:,}" in str(health(run).content)
    assert (
        main(["replay", str(tmp_path / "run.mcap")]) == 0
        and "every output byte identical" in capsys.readouterr().out
    )


def test_torque_held_to_its_slew_limit_is_counted(tmp_path):
    out = run_in_memory(inputs_of(tmp_path, PUSH, ("slew: 10 Nm/s", "slew: 5 Nm/s")))
    torques = [0.0, *(sample[8][TORQUE] for sample in out.memory.samples)]
    held = sum(
        abs(now - last) == pytest.approx(0.005)
        for last, now in zip(torques, torques[1:], strict=False)
    )
    counted = out.result.controller_slewed[TORQUE]["motor_torque"]
    assert (
        held - 2 <= counted <= held and counted > 10
    )  # a step that arrives is a whole one, and not held
    assert TORQUE not in out.result.slewed and not out.result.controller_clamped


def test_a_run_within_its_limits_says_nothing_of_them(tmp_path):
    out = run_in_memory(tiny_inputs(tmp_path))
    assert not out.result.controller_clamped and not out.result.controller_slewed


def test_a_log_of_before_has_a_dash_for_what_it_did_not_count(tmp_path):
    inputs = tiny_inputs(tmp_path, pressure="150 kPa gauge")
    run_simulated(inputs, tmp_path / "run.mcap", 1, None, progress=False)
    run = load_run(tmp_path / "run.mcap")
    for event in run.events:
        event.data.pop("controller_clamped", None)
    shown = next(one for one in health_of(run) if one.row.name == SPEED)
    assert shown.controller_clamped is None and shown.controller_slewed == 0 and shown.clamped == 0

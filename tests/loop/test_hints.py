"""An error at rest that is small but beyond noise is said at the end of the run and on its page."""

from dataclasses import replace

from epa_rt.cli.run import closing_text, run_simulated
from epa_rt.models.knobs import write_knob
from epa_rt.report.run import load_run
from epa_rt.report.sections.header import header
from tests.loop.rigging import tiny_inputs


def test_a_pressure_that_is_4_kpa_off_is_a_hint_to_calibrate(tmp_path):
    inputs = tiny_inputs(tmp_path)
    params = inputs.plant.params.copy()
    write_knob(params, "sensors.muscle0_gauge_offset_pa", 4e3)
    inputs = replace(inputs, plant=replace(inputs.plant, params=params))
    summary, result = run_simulated(inputs, tmp_path / "run.mcap", 1, None, progress=False)
    assert result.outcome == "completed"
    said = [line for line in closing_text(summary, result, inputs.rig).splitlines()]
    hints = [line for line in said if line.startswith("hint: muscle_pressure_pa is +")]
    assert len(hints) == 1 and hints[0].endswith("kPa off at rest: calibrate it")
    assert hints[0].removeprefix("hint: ") in str(header(load_run(tmp_path / "run.mcap")))

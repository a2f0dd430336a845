"""Every rig runs at 2 ms, 0.5 ms and 0.25 ms as it does at 1 ms, and tracks no worse for it."""

import math
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from epa_rt.cli.inputs import load_inputs
from tests.loop.rigging import Memory, run_in_memory
from tests.rig_at_period import rig_at_period

MOTOR = """
experiment: any_period
loop: motor_speed
phases:
  - {name: start, move: {to: 2 mm, speed: 20 mm/s}}
  - {name: fill, valves: {all: {set: 300 kPa gauge}}, until: valves_settled, timeout: 30 s}
  - {name: trial, trial: true, valves: {all: hold}, for: 2 s,
     random_speed: {between: [2 mm, 20 mm], speed: 50 mm/s, acceleration: 1 m/s^2}}
  - {name: vent, valves: {all: vent}, until: valves_settled, timeout: 30 s}
"""
JOINT = """
experiment: any_period
loop: joint_angle
phases:
  - {name: no_load, loop: motor_position, move: {to: no_load, speed: 20 mm/s}}
  - {name: fill, loop: motor_position, valves: PRESSURE, until: valves_settled, timeout: 30 s}
  - {name: go_to_mean, move: {to: mean, speed: SPEED}, valves: {all: hold}}
  - {name: rest, for: 1 s}
  - {name: trial, trial: true, valves: {all: hold}, for: 4 s,
     sine: {mean: mean, peak_to_peak: HEIGHT, frequency: 1.5 Hz, fade: 1 s}}
  - {name: vent, loop: motor_position, valves: {all: vent}, until: valves_settled, timeout: 30 s}
"""
KNEE = (
    JOINT.replace("PRESSURE", "{spam: {set: 185 kPa abs}, ppam: {set: 170 kPa abs}}")
    .replace("SPEED", "10 deg/s")
    .replace("HEIGHT", "6 deg")
)
MASS = (
    JOINT.replace("PRESSURE", "{all: {set: 580 kPa gauge}}")
    .replace("SPEED", "10 mm/s")
    .replace("HEIGHT", "8 mm")
)
EXPERIMENTS = {
    "bench": MOTOR,
    "bench_analog": MOTOR,
    "knee": KNEE,
    "knee_geared": KNEE,
    "mass": MASS,
}
# A reference is met two cycles and the drive's lag later: at 2 ms that is up to 2 ms more.
ALLOWED = {2.0: 1.6, 0.5: 1.05, 0.25: 1.05}


class Tracking(Memory):
    """Keeps the square of the error in the trial, and nothing else of the samples."""

    def __init__(self, experiment):
        super().__init__()
        self._phases, self.squares, self.count = experiment.phases, 0.0, 0

    def sample(self, cycle, t_ns, flags, state, phase, *values):
        trial = self._phases[phase] if phase >= 0 else None
        if trial is not None and trial.trial_index is not None:
            measured, reference = values[6], values[7]
            place = trial.coordinate
            self.squares += (reference[place.position_key] - measured[place.measured]) ** 2
            self.count += 1


@cache
def run_at(rig: str, period_ms: float) -> tuple[str, str, float]:
    """How a run ended, why, and the root of its mean squared tracking error (SI)."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "any_period.yaml"
        path.write_text(EXPERIMENTS[rig], encoding="utf-8")
        inputs = load_inputs(path, rig_at_period(rig, period_ms, Path(folder)), None, True)
    memory = Tracking(inputs.experiment)
    result = run_in_memory(inputs, memory=memory).result
    return result.outcome, result.cause, math.sqrt(memory.squares / max(1, memory.count))


@pytest.mark.parametrize(
    ("rig", "period_ms"), [pytest.param(rig, period) for rig in EXPERIMENTS for period in ALLOWED]
)
def test_a_run_completes_and_tracks_at_any_period(rig, period_ms):
    outcome, cause, error = run_at(rig, period_ms)
    assert (outcome, cause) == ("completed", "")
    _, _, usual = run_at(rig, 1.0)
    assert 0.0 < error <= ALLOWED[period_ms] * usual, f"{error:.3g} against {usual:.3g} at 1 ms"

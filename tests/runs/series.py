"""A short identification on the simulated bench, whole and cut, for tests that go on from it."""

from pathlib import Path

from epa_rt.cli.inputs import load_inputs
from epa_rt.cli.run import run_simulated

ROOT = Path(__file__).resolve().parents[2]
RIG = ROOT / "config/rigs/bench.yaml"
SHORT = """
experiment: three
loop: motor_speed
seed: 1
repeat:
  p0: [460 kPa gauge, 550 kPa gauge, 640 kPa gauge]
phases:
  - {name: go_to_no_load, move: {to: no_load, speed: 20 mm/s}}
  - {name: fill, valves: {all: {set: $p0}}, until: valves_settled, timeout: 60 s}
  - name: trial
    trial: true
    random_speed:
      {between: [1 mm, 27 mm], speed: 50 mm/s, acceleration: 1 m/s^2, dwell: [100 ms, 300 ms]}
    for: 5 s
    valves: {all: hold}
  - {name: return, move: {to: no_load, speed: 20 mm/s}}
  - {name: vent, valves: {all: vent}, until: valves_settled, timeout: 60 s}
"""


def experiment_file(folder: Path, text: str = SHORT) -> Path:
    path = folder / "three.yaml"
    path.write_text(text)
    return path


def run(inputs, log: Path, seed: int = 1):
    """One simulated run as fast as it goes; how it ended."""
    return run_simulated(inputs, log, seed, None, progress=False)[1]


def inputs_of(experiment: Path, rig: Path = RIG):
    return load_inputs(experiment, rig, None, with_plant=True)


def cut(whole: Path, log: Path, share: float) -> Path:
    """The log as a power loss leaves it: the first part of its bytes."""
    data = whole.read_bytes()
    log.write_bytes(data[: int(share * len(data))])
    return log

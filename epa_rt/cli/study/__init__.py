"""The paper's studies on a plant: serial actuator, knee, arrangements; grids that go on after an
interruption.

  epa study serial config/studies/serial.yaml --html serial.html --json serial.json
  epa study serial config/studies/serial_mass_rig.yaml -o rule.yaml
  epa study rule rule.yaml --frequency '20 rad/s' -o best.yaml
                                 an experiment for epa run at the best pressure
  epa study serial config/studies/serial.yaml --cluster tcp://HOST:8786
  epa study arrangements config/studies/arrangements.yaml
"""

import argparse

from epa_rt.cli.tasks import add_tasks, run_task

TASKS = ("serial", "rule", "knee", "arrangements")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    add_tasks(verb, "study", TASKS)


main = run_task

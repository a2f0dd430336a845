"""The paper's studies on a plant: serial actuator, knee, arrangements; grids that go on after an interruption.

  epa study serial config/studies/serial.yaml --html serial.html --json serial.json --rule rule.yaml
  epa study rule rule.yaml --frequency '20 rad/s' -o best.yaml     an experiment for epa run at the best pressure
  epa study serial config/studies/serial.yaml --cluster tcp://HOST:8786
"""

import argparse
import importlib.util

TASKS = ("serial", "rule", "knee", "arrangements")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    tasks = verb.add_subparsers(dest="task", metavar="TASK", required=True)
    for task in filter(_is_there, TASKS):
        module = importlib.import_module(f"epa_rt.cli.study_{task}")
        module.add_parser(tasks)
        tasks.choices[task].set_defaults(run=module.run)


def _is_there(task: str) -> bool:
    return importlib.util.find_spec(f"epa_rt.cli.study_{task}") is not None


def main(arguments: argparse.Namespace) -> int:
    return arguments.run(arguments)

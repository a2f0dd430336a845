"""Diagnose the gap between a rig's logs and its simulated plant: where, which effect, how far it shrinks.

  epa gap diagnose --rig config/rigs/bench.yaml out/*.mcap --holdout out/other.mcap --json gap.json --html gap.html
  epa gap localise --rig config/rigs/bench.yaml out/*.mcap        where only
  epa gap patch gap.json --rig config/rigs/bench.yaml -o config/plants/bench_patched.yaml
  epa gap plan gap.json --rig config/rigs/bench.yaml out/*.mcap -o next.yaml       the experiment that would tell
  epa gap catalogue                                               what can be found at all
"""

import argparse
import importlib.util

TASKS = ("diagnose", "localise", "plan", "patch", "catalogue", "blind")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    tasks = verb.add_subparsers(dest="task", metavar="TASK", required=True)
    for task in filter(_is_there, TASKS):
        module = importlib.import_module(f"epa_rt.cli.gap_{task}")
        module.add_parser(tasks)
        tasks.choices[task].set_defaults(run=module.run)


def _is_there(task: str) -> bool:
    return importlib.util.find_spec(f"epa_rt.cli.gap_{task}") is not None


def main(arguments: argparse.Namespace) -> int:
    return arguments.run(arguments)

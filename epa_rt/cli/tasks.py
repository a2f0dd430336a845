"""A verb with tasks (``epa gap diagnose``): one module per task, with ``add_parser(tasks)`` and
``run(arguments)``.
"""

import argparse
import importlib
from collections.abc import Iterable


def add_tasks(verb: argparse.ArgumentParser, group: str, names: Iterable[str]) -> None:
    """Adds the task ``name`` from the module ``epa_rt.cli.<group>.<name>``; its ``run`` is what the
    verb then runs.
    """
    tasks = verb.add_subparsers(dest="task", metavar="TASK", required=True)
    for name in names:
        module = importlib.import_module(f"epa_rt.cli.{group}.{name}")
        module.add_parser(tasks)
        tasks.choices[name].set_defaults(run=module.run)


def run_task(arguments: argparse.Namespace) -> int:
    """Runs the task that was chosen; returns its exit code."""
    return arguments.run(arguments)

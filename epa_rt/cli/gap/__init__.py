"""Diagnose the gap between a rig's logs and its simulated plant: where, which effect, how far it
shrinks.

  epa gap localise --rig config/rigs/bench.yaml out/*.mcap          where only
  epa gap diagnose --rig config/rigs/bench.yaml out/a.mcap out/b.mcap --json gap.json
                                                                    which effect
  epa gap patch gap.json --rig config/rigs/bench.yaml -o bench_patched.yaml
                                                                    the plant file that has it
  epa gap plan gap.json --rig config/rigs/bench.yaml out/a.mcap out/b.mcap -o next.yaml
                                                                    the experiment that would tell
  epa gap catalogue                                                 what can be found at all
"""

import argparse

from epa_rt.cli.tasks import add_tasks, run_task

TASKS = ("diagnose", "localise", "plan", "patch", "catalogue", "blind")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    add_tasks(verb, "gap", TASKS)


main = run_task

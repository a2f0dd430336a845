"""Diagnose the gap between a rig's logs and its simulated plant: where, which effect, how far it
shrinks.

epa gap diagnose --rig config/rigs/bench.yaml out/*.mcap --holdout out/other.mcap --json gap.json
--html gap.html epa gap localise --rig config/rigs/bench.yaml out/*.mcap        where only epa gap
patch gap.json --rig config/rigs/bench.yaml -o config/plants/bench_patched.yaml epa gap plan
gap.json --rig config/rigs/bench.yaml out/*.mcap -o next.yaml       the experiment that would tell
epa gap catalogue                                               what can be found at all
"""

import argparse

from epa_rt.cli.tasks import add_tasks, run_task

TASKS = ("diagnose", "localise", "plan", "patch", "catalogue", "blind")


def add_arguments(verb: argparse.ArgumentParser) -> None:
    add_tasks(verb, "gap", TASKS)


main = run_task

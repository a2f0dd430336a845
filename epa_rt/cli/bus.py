"""Stand in for a rig: an emulated EtherCAT bus with the simulated plant behind it, and faults on demand.

  epa bus run --rig config/rigs/bench.yaml -- python master.py        in a network of its own, without any right
  epa bus serve --rig config/rigs/bench.yaml --interface eth1         on a real interface (needs CAP_NET_RAW)
  epa bus status --control SOCKET

A command under 'run' finds its interface in EPA_BUS_INTERFACE and the control channel in EPA_BUS_CONTROL.
"""

import argparse
import json
import os
from pathlib import Path

from epa_rt.cli.exits import COMPLETED, FAILED, VerbError


def add_arguments(verb: argparse.ArgumentParser) -> None:
    parts = verb.add_subparsers(dest="part", metavar="PART", required=True)
    serve = parts.add_parser("serve", help="emulate a rig's slaves on an interface until stopped")
    _add_serve_arguments(serve)
    serve.add_argument("--interface", required=True, help="network interface; the master is at its other end")
    run = parts.add_parser("run", help="run a command beside an emulated bus, in a network of its own")
    _add_serve_arguments(run)
    run.add_argument("command", nargs=argparse.REMAINDER, metavar="-- COMMAND", help="the master: what to run")
    for name, words in (("status", "states of the slaves and counters"), ("truth", "the plant as it is, in SI"),
                        ("rewind", "a fresh plant at cycle 0"), ("stop", "end the emulator")):
        part = parts.add_parser(name, help=words)
        _add_control(part)


def _add_serve_arguments(part: argparse.ArgumentParser) -> None:
    part.add_argument("--rig", type=Path, required=True, help="rig file (config/rigs/*.yaml)")
    part.add_argument("--plant", type=Path, help="plant file (default: the one the rig names)")
    part.add_argument("--lock-step", action="store_true", help="one plant period per process data frame (default: by the clock)")
    part.add_argument("--seed", type=int, default=1, help="seed of the simulated sensors' noise (default: %(default)s)")
    part.add_argument("--control", type=Path, help="path of the control channel, a Unix socket")
    part.add_argument("--priority", type=int, help="SCHED_FIFO priority, where permitted; one above the master's")


def _add_control(part: argparse.ArgumentParser) -> None:
    part.add_argument("--control", type=Path, default=os.environ.get("EPA_BUS_CONTROL"),
                      help="the emulator's control channel (default: $EPA_BUS_CONTROL)")


def main(arguments: argparse.Namespace) -> int:
    if arguments.part == "serve":
        return _serve(arguments)
    if arguments.part == "run":
        return _run(arguments)
    print(json.dumps(_ask(arguments, arguments.part), indent=2))
    return COMPLETED


def _serve(arguments: argparse.Namespace) -> int:
    from epa_rt.config.rig import load_rig
    from epa_rt.models.plant_file import load_plant
    from sim_backend.bus.emulated_bus import EmulatedBus
    from sim_backend.bus.serve import serve

    rig = load_rig(arguments.rig)
    plant = load_plant(arguments.plant or arguments.rig.parent / rig.plant)
    bus = EmulatedBus(rig, plant, arguments.seed, arguments.lock_step)
    try:
        serve(bus, arguments.interface, arguments.control, arguments.priority,
              lambda sentence: print(f"ready: {rig.name} on {arguments.interface}, {sentence}", flush=True))
    except OSError as error:
        raise VerbError(f"{arguments.interface}: cannot serve ({error.strerror or error})", FAILED) from None
    return COMPLETED


def _run(arguments: argparse.Namespace) -> int:
    import subprocess

    from sim_backend.bus.namespace import command_beside, refusal

    command = arguments.command[1:] if arguments.command[:1] == ["--"] else arguments.command
    if not command:
        raise VerbError("found no command, expected one after '--'")
    reason = refusal()
    if reason is not None:
        raise VerbError(reason, FAILED)
    options = ["--seed", str(arguments.seed)]
    options += ["--lock-step"] if arguments.lock_step else []
    for name in ("plant", "control", "priority"):
        value = getattr(arguments, name)
        options += [f"--{name}", str(value)] if value is not None else []
    return subprocess.run(command_beside(command, arguments.rig, options)).returncode


def _ask(arguments: argparse.Namespace, do: str, **more: object) -> dict:
    from sim_backend.bus.control import ControlClient, ControlError

    if arguments.control is None:
        raise VerbError("found no control channel, expected --control or EPA_BUS_CONTROL")
    try:
        with ControlClient(arguments.control) as client:
            return client.ask(do, **more)
    except ControlError as error:
        raise VerbError(str(error), FAILED) from None

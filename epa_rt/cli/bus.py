"""Stand in for a rig: an emulated EtherCAT bus with the simulated plant behind it, and faults on
demand.

A command under 'run' finds its interface in EPA_BUS_INTERFACE, which the verbs of epa take by
themselves, the control channel in EPA_BUS_CONTROL, and in EPA_BUS_LOCK_STEP whether the bus goes in
lock step.

  epa bus run --rig config/rigs/bench.yaml -- epa scan --rig config/rigs/bench.yaml
                                          in a network of its own, without any right
  epa bus run --rig config/rigs/bench.yaml --lock-step -- epa run \\
      config/experiments/step.yaml --rig config/rigs/bench.yaml --backend ethercat -o out
  epa bus serve --rig config/rigs/bench.yaml --interface eth1
                                          on a real interface (needs CAP_NET_RAW)
  epa bus status --control SOCKET
  epa bus fault frames_lost --cycles 3 --control SOCKET
                                          'epa bus fault --help' lists all kinds
"""

import argparse
import json
import os
from pathlib import Path

from epa_rt.cli.exits import COMPLETED, FAILED, VerbError

_FAULTS = """kinds, with what --where names, the usual --value, and how long by default:

  frames_lost, frames_late (0.002 s), frames_repeated, frames_reordered, frames_damaged, wrong_working_counter (-1)
                                    one frame of process data each, or --cycles N
  cable_pulled                      until cleared
  slave_lost SLAVE                  until cleared, then back in INIT; --alone: what hangs behind it stays reachable
  slave_falls SLAVE (26)            to SAFEOP with this AL status code, once
  sdo_refused SLAVE, sdo_forgotten SLAVE (0x1C12: the object's index)   until cleared
  clock_drift [SLAVE] (50 ppm)      until cleared
  wire_broken ROW (V or mA), sensor_stuck ROW, sensor_noisy ROW (0.5 V), toggle_frozen SLAVE
  sensor_gain ROW (0.8), sensor_offset ROW (SI), pressures_exchanged, hoses_exchanged: until cleared
  valve_stuck_open VALVE, valve_stuck_closed VALVE, leak [MUSCLE] (5 /s), burst [MUSCLE] (50 /s), supply_lost (0 Pa)
  drive_fault (8976), following_error: once; sto, encoder_jump (2000 counts): until cleared
  count_offset (9000 counts), until cleared; drive_supply_lost: 200 cycles"""  # noqa: E501


def add_arguments(verb: argparse.ArgumentParser) -> None:
    parts = verb.add_subparsers(dest="part", metavar="PART", required=True)
    serve = parts.add_parser("serve", help="emulate a rig's slaves on an interface until stopped")
    _add_serve_arguments(serve)
    serve.add_argument(
        "--interface", required=True, help="network interface; the master is at its other end"
    )
    run = parts.add_parser(
        "run", help="run a command beside an emulated bus, in a network of its own"
    )
    _add_serve_arguments(run)
    run.add_argument(
        "command", nargs=argparse.REMAINDER, metavar="-- COMMAND", help="the master: what to run"
    )
    for name, words in (
        ("status", "states of the slaves and counters"),
        ("truth", "the plant as it is, in SI"),
        ("rewind", "a fresh plant at cycle 0"),
        ("faults", "the faults at work and to come"),
        ("clear", "end all faults"),
        ("stop", "end the emulator"),
    ):
        part = parts.add_parser(name, help=words)
        _add_control(part)
    _add_fault(parts)


def _add_serve_arguments(part: argparse.ArgumentParser) -> None:
    part.add_argument("--rig", type=Path, required=True, help="rig file (config/rigs/*.yaml)")
    part.add_argument("--plant", type=Path, help="plant file (default: the one the rig names)")
    part.add_argument(
        "--lock-step",
        action="store_true",
        help="one plant period per process data frame (default: by the clock)",
    )
    part.add_argument(
        "--seed",
        type=int,
        default=1,
        help="seed of the simulated sensors' noise (default: %(default)s)",
    )
    part.add_argument(
        "--unreferenced",
        type=int,
        nargs="?",
        const=0,
        metavar="COUNTS",
        help="a drive that was not homed, its count off by COUNTS (default: homed, 0)",
    )
    part.add_argument("--control", type=Path, help="path of the control channel, a Unix socket")
    part.add_argument(
        "--priority", type=int, help="SCHED_FIFO priority, where permitted; one above the master's"
    )


def _number(text: str) -> float:
    return float(int(text, 16)) if text.lower().startswith("0x") else float(text)


def _add_fault(parts: argparse._SubParsersAction) -> None:
    part = parts.add_parser(
        "fault",
        help="inject a fault, now or later",
        description=_FAULTS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    part.add_argument("kind", help="one of the kinds above")
    part.add_argument(
        "--where", default="", help="row of the rig file, slave, valve or muscle that it hits"
    )
    part.add_argument("--value", type=_number, help="how much, in the unit that the list says")
    part.add_argument("--at-cycle", type=int, help="plant cycle in which it begins (default: now)")
    part.add_argument("--at-s", type=float, help="the same as a time of the plant, in seconds")
    part.add_argument(
        "--cycles", type=int, help="how long, in cycles or frames (default: as the list says)"
    )
    part.add_argument(
        "--leg",
        choices=("out", "back"),
        help="frames_lost: on the way to the slaves, or back from them",
    )
    part.add_argument(
        "--frames",
        choices=("process", "all"),
        help="frame faults: process data only, or every frame",
    )
    part.add_argument(
        "--alone",
        action="store_true",
        default=None,
        help="slave_lost: the slaves behind stay reachable",
    )
    _add_control(part)


def _add_control(part: argparse.ArgumentParser) -> None:
    part.add_argument(
        "--control",
        type=Path,
        default=os.environ.get("EPA_BUS_CONTROL"),
        help="the emulator's control channel (default: $EPA_BUS_CONTROL)",
    )


def main(arguments: argparse.Namespace) -> int:
    if arguments.part == "serve":
        return _serve(arguments)
    if arguments.part == "run":
        return _run(arguments)
    more = {}
    if arguments.part == "fault":
        names = ("kind", "where", "value", "at_cycle", "at_s", "cycles", "leg", "frames", "alone")
        more = {
            name: getattr(arguments, name) for name in names if getattr(arguments, name) is not None
        }
    print(json.dumps(_ask(arguments, arguments.part, **more), indent=2))
    return COMPLETED


def _serve(arguments: argparse.Namespace) -> int:
    from epa_rt.cli.inputs import load_plant_of
    from epa_rt.config.rig import load_rig
    from sim_backend.bus.control import ControlError
    from sim_backend.bus.emulated_bus import EmulatedBus
    from sim_backend.bus.serve import serve

    rig = load_rig(arguments.rig)
    _, plant = load_plant_of(arguments.rig, rig, arguments.plant)
    bus = EmulatedBus(
        rig,
        plant,
        arguments.seed,
        arguments.lock_step,
        referenced=arguments.unreferenced is None,
        count_offset=arguments.unreferenced or 0,
    )
    try:
        serve(
            bus,
            arguments.interface,
            arguments.control,
            arguments.priority,
            lambda sentence: print(
                f"ready: {rig.name} on {arguments.interface}, {sentence}", flush=True
            ),
        )
    except ControlError as error:
        raise VerbError(str(error), FAILED) from None
    except OSError as error:
        raise VerbError(
            f"{arguments.interface}: cannot serve ({error.strerror or error})", FAILED
        ) from None
    return COMPLETED


def _run(arguments: argparse.Namespace) -> int:
    from sim_backend.bus.namespace import command_beside, refusal, run_to_its_end

    command = arguments.command[1:] if arguments.command[:1] == ["--"] else arguments.command
    if not command:
        raise VerbError("found no command, expected one after '--'")
    reason = refusal()
    if reason is not None:
        raise VerbError(reason, FAILED)
    options = ["--seed", str(arguments.seed)]
    options += ["--lock-step"] if arguments.lock_step else []
    for name in ("plant", "control", "priority", "unreferenced"):
        value = getattr(arguments, name)
        options += [f"--{name}", str(value)] if value is not None else []
    return run_to_its_end(command_beside(command, arguments.rig, options))


def _ask(arguments: argparse.Namespace, do: str, **more: object) -> dict:
    from sim_backend.bus.control import ControlClient, ControlError

    if arguments.control is None:
        raise VerbError("found no control channel, expected --control or EPA_BUS_CONTROL")
    try:
        with ControlClient(arguments.control) as client:
            return client.ask(do, **more)
    except ControlError as error:
        raise VerbError(str(error), FAILED) from None

"""kickcat, a master of its own making in C++, beside an emulated bus: what it finds, writes and
reads, as JSON.

python kickcat_run.py RIG ANSWER.json        in the network of the bus
"""

import json
import os
import sys
import time
from pathlib import Path

import kickcat
from kickcat.mailbox.request import MessageStatus

from epa_rt.config.rig import Slave, load_rig
from epa_rt.config.rig_checks import entries_of
from sim_backend.bus.control import ControlClient

_STATE_S, _WATCHDOG_S, _CYCLES, _ATTEMPTS = 5.0, 2.0, 400, 20


def found_bus() -> "kickcat.Bus":
    """A bus with all slaves in PREOP.

    kickcat gives a frame 2 ms by default, too few on a busy machine; and with every broadcast it
    waits that long for its second interface, so that much more makes its bring-up slow and lets
    watchdogs expire. It gives up at the first answer that is late: then all over again.
    """
    for attempt in range(_ATTEMPTS):
        link = kickcat.create_link(os.environ["EPA_BUS_INTERFACE"], "")
        link.set_timeout(0.02)
        bus = kickcat.Bus(link)
        try:
            bus.init(_WATCHDOG_S)
            break
        except RuntimeError:
            if attempt == _ATTEMPTS - 1:
                raise
            time.sleep(0.2)
    link.set_timeout(0.2)  # few broadcasts from here on
    return bus


def write(
    bus: "kickcat.Bus", slave: "kickcat.Slave", index: int, subindex: int, data: bytes
) -> None:
    message = slave.mailbox.write_sdo(index, subindex, False, data, 1.0)
    while message.status() == MessageStatus.RUNNING:
        bus.process_mailboxes()
        time.sleep(2e-4)
    if message.status() != MessageStatus.SUCCESS:
        raise RuntimeError(f"0x{index:04X}:{subindex:02X}: {message.status():#x}")


def read(bus: "kickcat.Bus", slave: "kickcat.Slave", index: int, subindex: int) -> bytes:
    return bus.read_sdo(slave, index, subindex, kickcat.Access.PARTIAL, 64, 1.0)


def map_drive(bus: "kickcat.Bus", slave: "kickcat.Slave", typed: Slave) -> None:
    for outputs, assignment, pdo in ((True, 0x1C12, 0x1600), (False, 0x1C13, 0x1A00)):
        entries = entries_of(typed, outputs)
        write(bus, slave, assignment, 0, b"\0")
        if not entries:
            continue
        write(bus, slave, pdo, 0, b"\0")
        for n, entry in enumerate(entries, 1):
            write(
                bus,
                slave,
                pdo,
                n,
                (entry.index << 16 | entry.subindex << 8 | entry.bits).to_bytes(4, "little"),
            )
        write(bus, slave, pdo, 0, bytes([len(entries)]))
        write(bus, slave, assignment, 1, pdo.to_bytes(2, "little"))
        write(bus, slave, assignment, 0, b"\1")


def to_operational(bus: "kickcat.Bus") -> None:
    bus.request_state(kickcat.State.SAFE_OP)
    bus.wait_for_state(kickcat.State.SAFE_OP, _STATE_S)
    for slave in bus.slaves():
        if slave.output_size:
            slave.set_output_bytes(bytes(slave.output_size))
    bus.process_data()
    bus.request_state(kickcat.State.OPERATIONAL)
    bus.wait_for_state(kickcat.State.OPERATIONAL, _STATE_S, bus.process_data_no_check)


def exchange(bus: "kickcat.Bus", cycles: int) -> int:
    """Exchanges so often with all working counters right; gives how many were not, which a busy
    machine may delay.
    """
    good = bad = 0
    while good < cycles and bad < cycles:
        try:
            bus.process_data()  # raises where a working counter is wrong or a frame is late
            good += 1
        except RuntimeError:
            bad += 1
        time.sleep(5e-4)
    return bad


def main() -> None:
    rig = load_rig(Path(sys.argv[1]))
    bus = found_bus()
    slaves = dict(zip((slave.name for slave in rig.slaves), bus.slaves(), strict=True))
    seen = {
        "addresses": [slave.address for slave in slaves.values()],
        "names": {
            name: read(bus, slaves[name], 0x1008, 0).decode()
            for name in ("analog_in", "analog_out", "drive")
        },
        "identity": [
            int.from_bytes(read(bus, slaves["drive"], 0x1018, n), "little") for n in (1, 2)
        ],
    }
    try:
        read(bus, slaves["analog_in"], 0x5555, 0)
    except RuntimeError as error:
        seen["refused"] = str(error)
    map_drive(bus, slaves["drive"], next(slave for slave in rig.slaves if slave.name == "drive"))
    bus.create_mapping()
    seen["sizes"] = {name: [slave.output_size, slave.input_size] for name, slave in slaves.items()}
    to_operational(bus)
    with ControlClient(Path(os.environ["EPA_BUS_CONTROL"])) as control:
        slaves["valves"].set_output_bytes(b"\1")  # the first channel: the inlet
        slaves["analog_out"].set_output_bytes(
            b"".join(volts.to_bytes(2, "little") for volts in (0x1111, 0x2222, 0x3333, 0x4444))
        )
        seen["bad_cycles"] = exchange(bus, _CYCLES)
        truth, status = control.ask("truth"), control.ask("status")
        seen |= {
            "outputs_there": truth["outputs_raw"],
            "inlet_open": truth["inlet_open"],
            "inputs_there": truth["inputs_raw"],
            "states": [status["slaves"][slave.name]["state"] for slave in rig.slaves],
        }
        seen["inputs"] = {
            name: slave.input_data.hex() for name, slave in slaves.items() if slave.input_size
        }
        for _ in range(1000):  # the master falls silent: the slaves' own watchdogs
            if control.ask("status")["slaves"]["valves"]["watchdog_expired"]:
                break
            time.sleep(0.01)
        seen["after_silence"] = {
            "inlet_open": control.ask("truth")["inlet_open"],
            "watchdogs": sorted(control.ask("status")["counters"]["watchdogs"]),
        }
    # a file and not standard output, on which kickcat speaks as well
    Path(sys.argv[2]).write_text(json.dumps(seen), encoding="utf-8")


if __name__ == "__main__":
    main()

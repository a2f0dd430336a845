"""The two loops that bench_bus.py compares, each a process beside an emulated bus of its own;
results go to an .npz.

``bare`` is pysoem and nothing else: wake up, frame out, frame in. ``epa`` is the whole of it:
driver, experiment, envelope and recorder. Both ask for the same rights and put the same datagrams
on the wire (LRW and FRMW 0x0910).
"""

import os
import struct
import tempfile
import time
from pathlib import Path

import numpy as np
import pysoem

from drivers.backend import EthercatBackend
from epa_rt.cli.inputs import load_inputs
from epa_rt.config.rig import Realtime, Rig, load_rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.logs.layout import FLAG_OVERRUN, FLAG_WORKING_COUNTER_OK
from epa_rt.logs.reader import LogReader
from epa_rt.logs.recorder import Recorder
from epa_rt.loop.assembly import assemble
from epa_rt.loop.requests import NONE, STOP
from epa_rt.loop.run import run
from epa_rt.realtime.process import undisturbed
from sim_backend.bus.control import ControlClient

_TIMEOUT_US, _FIRST_FRAMES = 5000, 200


def bare(
    rig: Rig, interface: str, cycles: int, realtime: Realtime
) -> dict[str, np.ndarray | list[str]]:
    """A pysoem loop as in its examples. Times in ns: wake-ups on the monotonic clock, lateness,
    round trips; counters.
    """
    pysoem.settings.always_release_gil = True
    master = pysoem.Master()
    master.open(interface)
    try:
        _bring_up(master, rig)
        with undisturbed(realtime) as granted:
            measured = _turn(master, cycles, round(rig.period_s * 1e9))
    finally:
        master.state = pysoem.INIT_STATE
        master.write_state()
        master.close()
    return {**measured, "expected": np.array([master.expected_wkc]), "granted": granted}


def _bring_up(master: "pysoem.Master", rig: Rig) -> None:
    if master.config_init() != len(rig.slaves):
        raise SystemExit("the bus is not the rig")
    master.manual_state_change = 1
    _reach(master, pysoem.PREOP_STATE)
    for slave, on_bus in zip(rig.slaves, master.slaves, strict=True):
        if slave.device == "EPOS4":
            _map_drive(on_bus, entries_of(slave, True), 0x1C12, 0x1600)
            _map_drive(on_bus, entries_of(slave, False), 0x1C13, 0x1A00)
    master.config_overlap_map()
    master.config_dc()
    for slave, on_bus in zip(rig.slaves, master.slaves, strict=True):
        if slave.device == "EPOS4":
            on_bus.dc_sync(True, round(rig.period_s * 1e9), 0)
    for state in (pysoem.SAFEOP_STATE, pysoem.OP_STATE):
        master.state = state
        master.write_state()
        _reach(master, state)
        for _ in range(_FIRST_FRAMES):  # a slave that has seen no outputs refuses OP
            _exchange(master)


def _reach(master: "pysoem.Master", state: int) -> None:
    deadline = time.monotonic() + 5.0
    while master.state_check(state, 2000) != state:
        if state == pysoem.OP_STATE:
            _exchange(master)
        if time.monotonic() > deadline:
            master.read_state()
            raise SystemExit(
                f"the bus did not reach state {state}:"
                f" {[(s.name, s.state, hex(s.al_status)) for s in master.slaves]}"
            )


def _exchange(master: "pysoem.Master") -> int:
    master.send_overlap_processdata()
    return master.receive_processdata(_TIMEOUT_US)


def _map_drive(drive: "pysoem.CdefSlave", entries: tuple, assignment: int, pdo: int) -> None:
    drive.sdo_write(assignment, 0, b"\0")
    drive.sdo_write(pdo, 0, b"\0")
    for n, entry in enumerate(entries, 1):
        drive.sdo_write(
            pdo, n, struct.pack("<I", entry.index << 16 | entry.subindex << 8 | entry.bits)
        )
    drive.sdo_write(pdo, 0, bytes([len(entries)]))
    drive.sdo_write(assignment, 1, struct.pack("<H", pdo))
    drive.sdo_write(assignment, 0, b"\1")


def _turn(master: "pysoem.Master", cycles: int, period_ns: int) -> dict[str, np.ndarray]:
    """The loop. Its phase is set once, half a period after SYNC0, where the emulated plant does not
    step.
    """
    woken, late, trips, counters = (np.zeros(cycles, np.int64) for _ in range(4))
    clock, pause = time.monotonic_ns, time.sleep
    quickest_ns, passed_ns, dc_time_ns = period_ns, 0, 0
    for _ in range(_FIRST_FRAMES):
        pause(5e-4)
        sent_ns = clock()
        _exchange(master)
        if clock() - sent_ns < quickest_ns:  # one that waited nowhere tells the time best
            quickest_ns, passed_ns, dc_time_ns = clock() - sent_ns, sent_ns, master.dc_time
    edge_ns = passed_ns + (period_ns // 2 - dc_time_ns) % period_ns
    edge_ns += period_ns * (2 + (clock() - edge_ns) // period_ns)
    for i in range(cycles):
        now_ns = clock()
        if now_ns < edge_ns:
            pause((edge_ns - now_ns) * 1e-9)
            now_ns = clock()
        master.send_overlap_processdata()
        counters[i] = master.receive_processdata(_TIMEOUT_US)
        trips[i] = clock() - now_ns
        woken[i], late[i] = now_ns, now_ns - edge_ns
        edge_ns += period_ns * (1 + max(0, now_ns - edge_ns) // period_ns)
    return {"woken_ns": woken, "lateness_ns": late, "round_trip_ns": trips, "counters": counters}


class Watching:
    """A backend around the driver that keeps each cycle's round trip, and asks for a stop after
    enough cycles.
    """

    def __init__(self, inner: EthercatBackend, cycles: int):
        self.inner, self.period_s, self._cycles = inner, inner.period_s, cycles
        self.trips = np.zeros(cycles + 100_000, np.int64)

    @property
    def events(self):
        return self.inner.events

    @property
    def drive_off(self):
        return self.inner.drive_off

    def open(self) -> None:
        self.inner.open()
        self._bus = self.inner._bus

    def exchange(self, outputs_raw: bytes):
        exchange = self.inner.exchange(outputs_raw)
        self.trips[exchange.cycle] = self._bus.round_trip_ns
        return exchange

    def close(self) -> None:
        self.inner.close()

    def poll(self, cycle: int) -> int:
        return STOP if cycle >= self._cycles else NONE


def epa(
    experiment: Path, rig: Path, interface: str, cycles: int, realtime: Realtime
) -> dict[str, np.ndarray | list[str]]:
    """The real loop. The same times, from its own log; and what the log says of samples and
    overruns.
    """
    inputs = load_inputs(experiment, rig, None, with_plant=False)
    assembly = assemble(inputs.rig, inputs.experiment)
    watching = Watching(EthercatBackend(inputs.rig, interface), cycles)
    with tempfile.TemporaryDirectory() as folder:
        recorder = Recorder(
            Path(folder, "bench.mcap"), assembly.layout, inputs.attachments, {}, lossless=False
        )
        recorder.open()
        with undisturbed(realtime) as granted:
            result = run(
                inputs.rig,
                watching,
                assembly.supervisor,
                assembly.envelope,
                assembly.decoder,
                assembly.encoder,
                recorder,
                watching,
            )
        summary = recorder.close(result.outcome, result.cause)
        with LogReader(summary.path) as log:
            columns = log.columns("/cycle", ["cycle", "t_ns", "flags", "lateness_ns", "busy_ns"])
            whole = not log.missing
    numbers, flags = columns["cycle"].astype(np.int64), columns["flags"]
    missed = (
        np.round(np.diff(columns["t_ns"].astype(np.int64)) / (inputs.rig.period_s * 1e9)).astype(
            np.int64
        )
        - 1
    )
    return {
        "woken_ns": columns["t_ns"].astype(np.int64) + columns["lateness_ns"],
        "lateness_ns": columns["lateness_ns"].astype(np.int64),
        "round_trip_ns": watching.trips[: result.cycles],
        "busy_ns": columns["busy_ns"].astype(np.int64),
        "granted": granted,
        "cycles": np.array([result.cycles]),
        "recorded": np.array([len(numbers)]),
        "duplicated": np.array([len(numbers) - len(np.unique(numbers))]),
        "lost_samples": np.array([result.cycles - len(np.unique(numbers))]),
        "log_whole": np.array([whole]),
        "overruns_counted": np.array([result.overruns]),
        "overruns_flagged": np.array([np.count_nonzero(flags & FLAG_OVERRUN)]),
        "overruns_late": np.array(
            [np.count_nonzero(columns["lateness_ns"] > round(inputs.rig.overrun.late * 1e9))]
        ),
        "edges_missed": np.array([np.clip(missed, 0, None).sum()]),
        "bad_cycles": np.array([np.count_nonzero(flags & FLAG_WORKING_COUNTER_OK == 0)]),
        "outcome": [result.outcome, result.cause],
    }


def main(
    which: str, rig: Path, experiment: Path, cycles: int, core: int, priority: int, out: Path
) -> None:
    """Runs one loop on the interface and control channel of the environment; writes ``out``."""
    os.sched_setaffinity(
        0, range(os.cpu_count() or 1)
    )  # only the loop itself goes to the core of the emulator
    interface, realtime = os.environ["EPA_BUS_INTERFACE"], Realtime(priority=priority, core=core)
    found = (
        bare(load_rig(rig), interface, cycles, realtime)
        if which == "bare"
        else epa(experiment, rig, interface, cycles, realtime)
    )
    with ControlClient(Path(os.environ["EPA_BUS_CONTROL"])) as client:
        counters = client.ask("status")["counters"]
    np.savez(out, process_frames=np.array([counters["process_frames"]]), **found)

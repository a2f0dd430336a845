"""Bring-up, SDOs and ten seconds of cycles between our driver and the emulated bus, judged by
tshark.

Somebody else's dissector finds nothing wrong, and what it reads is what the driver says that it
sent: objects, mappings, every byte of process data in the log, working counters, the reference
clock.
"""

import json
import sys

import pytest

from epa_rt.config.rig import load_rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.logs.layout import FLAG_WORKING_COUNTER_OK
from epa_rt.logs.reader import LogReader
from epa_rt.signals.image import image_of
from sim_backend.bus.namespace import run_beside
from tests.bus.others import dissected
from tests.bus.others.dissected import DOWNLOAD, READS_ONLY, UPLOAD, WRITES
from tests.bus.others.places import ROOT
from tests.bus.own_network import REAL_TIME, STALL_S, repeated

CYCLES, FIRST_STATION = 10_000, 0x1001
STARTUP = (
    "{name: analog_in, device: EL3004, startup: [{object: 0x8000:15, type: u16, value: 1}, {object:"
    " 0x8010:15, type: u16, value: 2}]}"
)
PATIENT = {  # for a busy machine: late cycles, even many of them, do not end the run
    "reaction: 20 ms": "reaction: 100 ms",
    "lost_cycles: 3": "lost_cycles: 100\n  watchdog: 2 s",
    "overrun: {": "master: {frame_timeout: 100 ms}\n"
    "unprotected: {reaction: a machine that is late by itself}\noverrun: {",
    "stale_after: 20": "stale_after: 500",
    "following_error: 4 mm": "following_error: 20 mm",
}
pytestmark = [
    pytest.mark.skipif(
        not dissected.is_there(), reason="there is no tshark: apt-get install tshark"
    ),
    pytest.mark.network,
    REAL_TIME,
]


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """The capture, what the driver told of itself, and the rig."""
    return repeated("capture", lambda: captured(tmp_path_factory.mktemp("wire")), STALL_S)


def captured(folder):
    """One run beside the capture."""
    text = (ROOT / "config/rigs/bench.yaml").read_text()
    for old, new in (
        {"{name: analog_in, device: EL3004}": STARTUP, "../plants": str(ROOT / "config/plants")}
        | PATIENT
    ).items():
        assert old in text
        text = text.replace(old, new)
    rig_file = folder / "rig.yaml"
    rig_file.write_text(text)
    capture = folder / "wire.pcap"
    done = run_beside(
        [
            sys.executable,
            str(ROOT / "scripts/bus_capture.py"),
            "--out",
            str(capture),
            "--",
            sys.executable,
            "-W",
            "error",
            "-m",
            "tests.bus.others.driver_run",
            str(rig_file),
            str(ROOT / "config/experiments/identification_short.yaml"),
            str(CYCLES),
            str(folder),
        ],
        rig_file,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.strip().endswith(" 0 dropped")
    told = json.loads((folder / "told.json").read_text())
    assert told["outcome"] == "stopped", told["cause"]
    return Seen(folder, capture, told, load_rig(rig_file))


class Seen:
    """One recorded run and its capture; each dissection is made once."""

    def __init__(self, folder, capture, told, rig):
        self.capture, self.told, self.rig = capture, told, rig
        self.by_sender = dict(dissected.senders(capture))
        self.master = min(self.by_sender)  # a slave sets the second bit of the first byte
        self.mappings = dissected.mappings(capture, self.master)
        self.frames = dissected.process_data(capture, self.master)
        self.objects = dissected.objects(capture, self.master)
        with LogReader(folder / "run.mcap") as log:
            assert not log.missing
            self.cycles = list(log.iterate_cycles())
        self.in_log = self.frames[told["before"] : told["before"] + len(self.cycles)]


def test_nothing_is_malformed_and_nothing_is_remarked(seen):
    assert dissected.complaints(seen.capture) == []
    assert (
        len(seen.by_sender) == 2 and len(set(seen.by_sender.values())) == 1
    )  # an answer to every frame


def test_each_cycle_is_one_frame_with_one_answer(seen):
    assert len(seen.frames) == seen.told["swaps"] > CYCLES
    assert len(seen.in_log) == len(seen.cycles) == seen.told["cycles"] > CYCLES
    assert all(
        frame.back is not None and len(frame.back) == len(frame.sent) for frame in seen.frames
    )
    assert all(frame.counters[0] == seen.told["working_counter"] == 8 for frame in seen.in_log)


def test_the_mapping_on_the_wire_keeps_slaves_apart(seen):
    for kind in (WRITES, READS_ONLY):
        taken = [
            (sync.start + i, bit)
            for sync in seen.mappings
            if sync.type == kind
            for i in range(sync.length)
            for bit in range(
                sync.first_bit if i == 0 else 0, (sync.last_bit if i == sync.length - 1 else 7) + 1
            )
        ]
        assert len(taken) == len(set(taken))
    bits = {
        slave.name: [
            sum(entry.bits for entry in entries_of(slave, outputs)) for outputs in (True, False)
        ]
        for slave in seen.rig.slaves
    }
    found = {slave.name: [0, 0] for slave in seen.rig.slaves}
    for sync in seen.mappings:
        name = seen.rig.slaves[sync.station - FIRST_STATION].name
        found[name][0 if sync.type == WRITES else 1] += (
            (sync.length - 1) * 8 + sync.last_bit - sync.first_bit + 1
        )
    assert found == bits


def test_every_byte_of_process_data_is_the_logs(seen):
    """Outputs of cycle k leave in the frame of cycle k + 1, the first frame carries safe ones;
    inputs are the same frame's.

    Where the machine stood still (PATIENT outlasts it), an answer comes later than the loop waits:
    the log says so and keeps the inputs before.
    """
    late = []
    sent = [bytes.fromhex(seen.told["safe"]), *(cycle.outputs_raw for cycle in seen.cycles[:-1])]
    for outputs, kind in ((True, WRITES), (False, READS_ONLY)):
        slices = image_of(seen.rig, outputs).slices
        places = [
            (sync, slices[seen.rig.slaves[sync.station - FIRST_STATION].name])
            for sync in seen.mappings
            if sync.type == kind
        ]
        assert sum(length for _, (_, length) in places) == sum(
            length for _, length in slices.values()
        )
        differ = []
        for number, (frame, cycle, raw) in enumerate(
            zip(seen.in_log, seen.cycles, sent, strict=True)
        ):
            image, logged = (frame.sent, raw) if outputs else (frame.back, cycle.inputs_raw)
            if not outputs and not cycle.flags & FLAG_WORKING_COUNTER_OK:
                late.append(number)
                assert number == 0 or logged == seen.cycles[number - 1].inputs_raw
                continue
            differ += [
                (number, sync)
                for sync, (start, length) in places
                if sync.cut(image) != logged[start : start + length]
            ]
        assert not differ, f"{len(differ)} of {len(seen.in_log)} frames, first {differ[0]}"
    assert len(late) < 0.001 * len(seen.cycles)
    assert len({cycle.outputs_raw for cycle in seen.cycles}) > 100  # it did move something


def test_no_output_leaves_before_the_first_cycle(seen):
    outputs = [sync for sync in seen.mappings if sync.type == WRITES]
    assert all(
        not any(sync.cut(frame.sent))
        for frame in seen.frames[: seen.told["before"]]
        for sync in outputs
    )


def test_objects_on_the_wire_are_those_of_rig_and_driver(seen):
    assert all(
        not abort for *_, abort in seen.objects if abort not in ("0x06020000", "0x06090011")
    )  # no such object, no such subindex
    downloads = [
        [index, sub, value] for _, kind, index, sub, value, _ in seen.objects if kind == DOWNLOAD
    ]
    assert downloads == [
        [index, sub, int.from_bytes(bytes.fromhex(data), "little")]
        for index, sub, data in seen.told["writes"]
    ]
    assert [0x8000, 0x15, 1] in downloads and [0x8010, 0x15, 2] in downloads
    drive = next(slave for slave in seen.rig.slaves if slave.device == "EPOS4")
    for pdo, outputs in ((0x1600, True), (0x1A00, False)):
        entries = [
            entry.index << 16 | entry.subindex << 8 | entry.bits
            for entry in entries_of(drive, outputs)
        ]
        assert [value for index, sub, value in downloads if index == pdo and sub] == entries
    uploads = iter(
        [
            [index, sub, value]
            for _, kind, index, sub, value, abort in seen.objects
            if kind == UPLOAD and not abort
        ]
    )
    reads = [
        [index, sub, int.from_bytes(bytes.fromhex(data), "little")]
        for index, sub, data in seen.told["reads"]
        if len(data) <= 8
    ]
    assert reads and all(
        any(row == other for other in uploads) for row in reads
    )  # in this order; SOEM reads some of its own


def test_no_object_is_asked_for_in_the_cycle(seen):
    """From the first frame of process data to the last one with outputs nothing but cycles, AL
    states, full mailboxes (none was) and clock differences passes; the last two rarely.
    """
    numbers = [
        int(row["frame.number"])
        for row in dissected.tshark(seen.capture, ["frame.number"], "ecat.sub1.cmd == 0x0c")
    ]
    inside = f"frame.number > {numbers[0]} && frame.number < {numbers[-1]}"
    assert dissected.tshark(seen.capture, ["frame.number"], f"{inside} && ecat_mailbox") == []
    rows = dissected.tshark(seen.capture, ["ecat.ado"], f"{inside} && !(ecat.sub1.cmd == 0x0c)")
    asked = [int(part, 0) for row in rows for part in row["ecat.ado"].split("|")]
    rare = [register for register in asked if register in (0x080D, 0x092C)]
    assert set(asked) - set(rare) <= {0x0120, 0x0130}
    assert 0 < len(rare) < 0.05 * CYCLES


def test_the_reference_clock_is_dissected_and_goes_on(seen):
    assert all(frame.counters[1] > 0 for frame in seen.frames)
    times = [frame.time_ns for frame in seen.frames]
    assert all(later > earlier for earlier, later in zip(times, times[1:], strict=False))
    master = f"eth.src == {seen.master}"
    period_ns = round(seen.rig.period_s * 1e9)
    cycle_times = [
        int(row["ecat.reg.dc.cyctime0"], 0)
        for row in dissected.tshark(
            seen.capture, ["ecat.reg.dc.cyctime0"], f"ecat.reg.dc.cyctime0 && {master}"
        )
    ]
    assert period_ns in cycle_times and set(cycle_times) <= {0, period_ns}
    activations = [
        int(row["ecat.reg.dc.activation"], 0)
        for row in dissected.tshark(
            seen.capture, ["ecat.reg.dc.activation"], f"ecat.reg.dc.activation && {master}"
        )
    ]
    assert 0x03 in activations and activations[-1] == 0  # SYNC0 on, and off at the end
    assert dissected.tshark(seen.capture, ["frame.number"], f"ecat.reg.dc.systimedelay && {master}")

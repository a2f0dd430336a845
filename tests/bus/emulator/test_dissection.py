"""Eyes that are not ours: tshark dissects bring-up, SDOs and ten thousand cycles; kickcat, another master, reaches OP."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from sim_backend.bus.namespace import refusal, run_beside
from tests.bus.emulator.conftest import RIGS

REFUSED = refusal()
pytestmark = [pytest.mark.skipif(REFUSED is not None, reason=f"no network of one's own here: {REFUSED}"), pytest.mark.xdist_group("bus")]
HERE, BENCH, CYCLES = Path(__file__).parent, RIGS / "bench.yaml", 10_000
OTHER_PYTHON = os.environ.get("EPA_KICKCAT_PYTHON") or (sys.executable if importlib.util.find_spec("kickcat") else None)


def dissect(path, *fields, only=""):
    """Rows of fields, of the frames that a display filter lets through."""
    command = ["tshark", "-r", str(path), "-T", "fields", *(part for field in fields for part in ("-e", field))]
    done = subprocess.run([*command, "-Y", only] if only else command, capture_output=True, text=True, check=True)
    return [line.split("\t") for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    if shutil.which("tshark") is None:
        pytest.skip("there is no tshark here: apt-get install tshark")
    path = tmp_path_factory.mktemp("capture") / "bus.pcap"
    done = run_beside([sys.executable, str(HERE / "soem_master.py"), str(BENCH), "record", str(CYCLES), str(path)], BENCH, ["--lock-step"])
    assert done.returncode == 0, done.stderr
    return path, json.loads(done.stdout)


def test_no_frame_is_malformed(capture):
    path, seen = capture
    assert len(dissect(path, "frame.number")) == seen["captured"] > 2 * CYCLES
    assert dissect(path, "frame.number", only="!ecat") == []
    assert dissect(path, "frame.number", only="_ws.malformed || ecat_mailbox.invalid || ecat_mailbox.coe.invalid") == []


def test_process_data_are_what_was_sent_and_received(capture):
    path, seen = capture
    rows = dissect(path, "eth.src", "ecat.sub1.data", "ecat.sub1.cnt", only="ecat.sub1.cmd == 0x0c && ecat.sub2.cmd == 0x0e")[-2 * CYCLES :]
    sent, back = rows[0::2], rows[1::2]
    assert len(back) == CYCLES and {row[0] for row in sent} != {row[0] for row in back}
    places = {}
    for (outputs, inputs), out, answer in zip(seen["rows"], sent, back):
        data, answered = (row[1].replace(":", "") for row in (out, answer))
        for name, part, where in (("volts", outputs[2:18], data), ("drive", outputs[18:44], data), ("analog", inputs[:32], answered),
                                  ("state", inputs[32:70], answered)):
            assert where.find(part) >= 0 and places.setdefault(name, where.find(part)) == where.find(part)
        assert int(out[2], 0) == 0 and int(answer[2], 0) == seen["expected"]


def test_objects_are_dissected_as_they_were_read(capture):
    path, seen = capture
    assert (seen["name"], seen["abort"]) == ("EPOS4", 0x06020000)
    requests = dissect(path, "ecat_mailbox.coe.sdoidx", "ecat_mailbox.coe.sdosub", only="ecat_mailbox.coe.sdoreq == 1")
    mapping = [(0x1C12, 0), (0x1600, 0), *((0x1600, n + 1) for n in range(5)), (0x1600, 0), (0x1C12, 1), (0x1C12, 0)]
    written = [(int(index, 0), int(sub, 0)) for index, sub in requests]
    start = written.index((0x1600, 1))
    assert [row for row in dict.fromkeys(written[start:]) if row[0] == 0x1600] == [(0x1600, n + 1) for n in range(5)] + [(0x1600, 0)]
    assert set(mapping) <= set(written)
    assert dissect(path, "ecat_mailbox.coe.abortcode", only="ecat_mailbox.coe.abortcode")[-1] == ["0x06020000"]


def test_the_reference_clock_runs_through_the_frames(capture):
    path, _ = capture
    rows = dissect(path, "ecat.sub2.ado", "ecat.reg.dc.systime", "ecat.sub2.cnt", only="ecat.sub2.cmd == 0x0e && ecat.sub2.cnt > 0")
    times = [int(time, 0) for _, time, _ in rows]
    assert {int(row[0], 0) for row in rows} == {0x0910} and {int(row[2], 0) for row in rows} == {2}
    assert len(times) >= CYCLES and all(later > earlier for earlier, later in zip(times, times[1:]))


@pytest.mark.skipif(OTHER_PYTHON is None, reason="no kickcat here: pip install kickcat, or EPA_KICKCAT_PYTHON")
def test_a_master_that_is_not_soem_brings_the_bus_up():
    done = run_beside([OTHER_PYTHON, str(HERE / "kickcat_master.py")], BENCH, ["--lock-step"])
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout.splitlines()[-1])
    assert seen["names"] == {"2": "EL3004", "3": "EL4034", "4": "EPOS4"}
    assert seen["sizes"] == [[0, 0], [0, 1], [16, 0], [0, 8], [6, 6]]
    assert seen["states"] == ["OPERATIONAL"] * 5 and seen["cycles"] == 500
    assert int.from_bytes(bytes.fromhex(seen["analog"])[2:4], "little") > 3000 and bytes.fromhex(seen["drive"])[0] & 0x4F in (0x00, 0x40)

"""A master that is not SOEM in front of the emulated bus: kickcat finds, maps, commands and reads
the rigs.

What it cannot do from Python (distributed clocks, working counters by value, AL status codes) is in
docs/bus-figures.md.
"""

import importlib.util
import json
import os
import sys

import pytest

from epa_rt.config.devices import DEVICES
from epa_rt.config.rig import load_rig
from epa_rt.config.rig_checks import entries_of
from epa_rt.signals.image import image_of
from sim_backend.bus.namespace import run_beside
from tests.bus.others.places import ROOT
from tests.bus.own_network import STALL_S, repeated

PYTHON = os.environ.get("EPA_KICKCAT_PYTHON") or (
    sys.executable if importlib.util.find_spec("kickcat") else None
)
pytestmark = [
    pytest.mark.skipif(
        PYTHON is None, reason="there is no kickcat: pip install kickcat, or EPA_KICKCAT_PYTHON"
    ),
    pytest.mark.network,
    pytest.mark.xdist_group("kickcat"),
]
RIGS = (pytest.param("bench", marks=pytest.mark.slow), "bench_analog", "knee")
VOLTS = bytes.fromhex("1111222233334444")


@pytest.fixture(scope="module", params=RIGS)
def seen(request, tmp_path_factory):
    """The rig, and what kickcat told of it."""
    rig_file = ROOT / f"config/rigs/{request.param}.yaml"
    answer = tmp_path_factory.mktemp("kickcat") / "seen.json"

    def run():
        command = [PYTHON, "-m", "tests.bus.others.kickcat_run", str(rig_file), str(answer)]
        done = run_beside(command, rig_file)
        assert done.returncode == 0, done.stderr
        return json.loads(answer.read_text(encoding="utf-8"))

    return load_rig(rig_file), repeated(f"kickcat on {request.param}", run, STALL_S)


def test_it_finds_every_slave_and_reads_who_they_are(seen):
    rig, told = seen
    assert len(told["addresses"]) == len(set(told["addresses"])) == len(rig.slaves)
    assert told["names"] == {"analog_in": "EL3004", "analog_out": "EL4034", "drive": "EPOS4"}
    assert (
        told["identity"][0] == DEVICES["EPOS4"].vendor
        and told["identity"][1] in DEVICES["EPOS4"].products
    )
    assert "Error while reading SDO" in told["refused"]  # it does not say why


def test_it_maps_as_the_rig_file_says(seen):
    rig, told = seen
    wanted = {
        slave.name: [
            (sum(entry.bits for entry in entries_of(slave, outputs)) + 7) // 8
            for outputs in (True, False)
        ]
        for slave in rig.slaves
    }
    assert told["sizes"] == wanted and told["states"] == ["OP"] * len(rig.slaves)


def test_its_outputs_arrive_and_move_the_plant(seen):
    rig, told = seen
    slices, image = image_of(rig, outputs=True).slices, bytes.fromhex(told["outputs_there"])
    assert told["bad_cycles"] < 40  # of 400 and more; late answers, where the machine is busy
    assert image[slices["valves"][0]] & 0x0F == 1
    start, length = slices["analog_out"]
    assert image[start : start + length] == VOLTS
    assert told["inlet_open"][0] > 0.5


def test_it_reads_what_the_slaves_put_there(seen):
    rig, told = seen
    slices, image = image_of(rig, outputs=False).slices, bytes.fromhex(told["inputs_there"])
    start, _ = slices["drive"]
    word = bytes.fromhex(told["inputs"]["drive"])[:2]
    assert word[0] & 0x4F == 0x40 and word == image[start : start + 2]  # switch on disabled
    pressure = int.from_bytes(
        bytes.fromhex(told["inputs"]["analog_in"])[2:4], "little", signed=True
    )
    assert 3000 < pressure < 20000  # above 1 V: the muscle is being filled


def test_when_it_falls_silent_the_slaves_stop_by_themselves(seen):
    _, told = seen
    assert told["after_silence"]["inlet_open"][0] < 0.5
    assert set(told["after_silence"]["watchdogs"]) >= {"valves", "analog_out"}

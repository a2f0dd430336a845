"""Damaged frames against emulator and driver, in short; the long run is scripts/fuzz_bus.py."""

import json
import random
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_backend.bus.frame import LRW, build, datagrams_of
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.conftest import bus_of
from tests.bus.faults.damage import WAYS, damaged
from tests.bus.faults.fuzzed import fuzz_emulator
from tests.bus.faults.runs import ROOT


@pytest.fixture(scope="module")
def running():
    wire = Wire(bus_of("bench", lock_step=True))
    wire.exchange(b"\x02" + bytes(wire.output_size - 1))
    return wire


def test_the_emulator_throws_away_what_is_broken_and_comes_up_again():
    result = fuzz_emulator(3000, seed=5)
    assert (
        result["frames"],
        result["crashes"],
        result["outputs_changed"],
        result["comes_up_again"],
    ) == (3000, 0, 0, True)
    assert sum(result["counted"].values()) == 3000
    assert {key.split(":")[0] for key in result["counted"]} == set(WAYS)


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(sorted(WAYS)), st.integers(0, 2**32))
def test_a_broken_frame_does_nothing(running, way, seed):
    sent = build([(LRW, 1, running.logical, bytes(running.output_size + running.input_size))])
    raw = WAYS[way](sent, random.Random(seed))
    frame, before, cycle = bytearray(raw), bytes(running.bus.coupling.outputs), running.bus.cycle
    answered = running.bus.receive(frame, running.master.now_ns)
    assert answered == (datagrams_of(raw) is not None) and len(frame) == len(raw)
    if not answered:
        assert (
            bytes(frame) == raw
            and bytes(running.bus.coupling.outputs) == before
            and running.bus.cycle == cycle
        )


@given(st.integers(0, 2**32))
def test_damage_is_a_matter_of_the_seed_alone(seed):
    frame = build([(LRW, 1, 0x10000, bytes(40))])
    assert damaged(frame, random.Random(seed)) == damaged(frame, random.Random(seed))


@pytest.mark.network
def test_the_driver_counts_them_and_sends_what_it_sent():
    done = subprocess.run(
        [sys.executable, "-W", "error", "scripts/fuzz_bus.py", "--frames", "2000", "--seed", "3"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, (done.stdout[-2000:], done.stderr[-2000:])
    driver = json.loads(done.stdout)["driver"]
    assert driver["crashes"] == driver["outputs_changed"] == 0 and driver["frames"] >= 2000
    assert driver["driver"]["good cycles"] > 0 and driver["driver"]["bad cycles"] > 0

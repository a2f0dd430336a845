"""Random and damaged frames: nothing crashes, lengths stay, what is malformed has no effect,
counters keep their rules.
"""

import random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sim_backend.bus.frame import datagrams_of
from tests.bus.emulator.bring_up import Wire
from tests.bus.emulator.conftest import bus_of
from tests.bus.emulator.small_master import LRW, ethernet

SLAVES = 5
LIMIT = {
    0: 0,
    **{c: 1 for c in (1, 2, 4, 5)},
    3: 3,
    6: 3,
    7: SLAVES,
    8: SLAVES,
    9: 3 * SLAVES,
    10: SLAVES,
    11: SLAVES,
    12: 3 * SLAVES,
    13: SLAVES,
    14: SLAVES,
}
datagram = st.tuples(
    st.integers(0, 14),
    st.one_of(
        st.integers(0, 0xFFFFFFFF),
        st.builds(
            lambda a, r: a | r << 16,
            st.sampled_from([0, 0xFFFF, 0xFFFE, *range(0x1001, 0x1006)]),
            st.integers(0, 0x1200),
        ),
        st.integers(0x10000, 0x10040),
    ),
    st.binary(max_size=80),
)


@pytest.fixture(scope="module")
def running():
    return Wire(bus_of("bench", lock_step=True))


@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.lists(datagram, min_size=1, max_size=6))
def test_any_well_formed_frame_comes_back_as_long_as_it_went(running, datagrams):
    raw = bytearray(ethernet(*datagrams))
    sent = bytes(raw)
    running.master.now_ns += 1000
    assert running.bus.receive(raw, running.master.now_ns)
    assert (
        len(raw) == len(sent)
        and raw[:6] == sent[:6]
        and raw[7:16] == sent[7:16]
        and raw[6] == sent[6] | 2
    )
    found = datagrams_of(sent)
    assert [row[0] for row in found] == [command for command, _, _ in datagrams]
    for (command, _index, _, start, length), (_, _, data) in zip(found, datagrams, strict=False):
        counter = int.from_bytes(raw[start + length : start + length + 2], "little")
        assert length == len(data) and counter <= LIMIT[command]
        if counter == 0 and command not in (9, 3, 6):
            assert raw[start : start + length] == sent[start : start + length]


@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.binary(max_size=200))
def test_any_bytes_at_all(running, raw):
    frame = bytearray(raw)
    before = running.bus.counters.malformed
    answered = running.bus.receive(frame, running.master.now_ns)
    assert len(frame) == len(raw)
    assert running.bus.counters.malformed == before + (not answered)


def test_a_hundred_thousand_damaged_frames():
    """Frames of a running bus with bits turned, pieces cut and swapped. Afterwards the bus can be
    brought up again.
    """
    wire = Wire(bus_of("bench", lock_step=True))
    choice = random.Random(1)
    good = [
        ethernet((LRW, wire.logical, bytes(wire.output_size + wire.input_size))),
        ethernet((4, 0x1005 | 0x0120 << 16, bytes(6))),
        ethernet(
            (5, 0x1005 | 0x1000 << 16, bytes.fromhex("0a00000000130020401810010000") + bytes(34))
        ),
        ethernet((5, 0x1003 | 0x0800 << 16, bytes(32))),
        ethernet((7, 0x0130 << 16, bytes(2)), (14, 0x1001 | 0x0910 << 16, bytes(8))),
    ]
    bus, now_ns, answered = wire.bus, wire.master.now_ns, 0
    for _ in range(100_000):
        raw = bytearray(choice.choice(good))
        for _ in range(choice.randrange(1, 5)):
            raw[choice.randrange(12, len(raw))] = choice.randrange(256)
        if choice.random() < 0.1:
            del raw[choice.randrange(len(raw)) :]
        size = len(raw)
        now_ns += 10_000
        answered += bus.receive(raw, now_ns)
        assert len(raw) == size
    assert bus.counters.malformed > 10_000 and answered > 10_000
    for slave in bus.slaves.values():
        slave.power_up()
    fresh = Wire(bus)
    assert fresh.exchange(bytes(fresh.output_size))[1] == fresh.expected_counter


def test_malformed_frames_never_change_an_output(running):
    wire = Wire(bus_of("bench", lock_step=True))
    wire.exchange(b"\x03" + bytes(wire.output_size - 1))
    before, choice = bytes(wire.bus.coupling.outputs), random.Random(2)
    raw_good = ethernet((LRW, wire.logical, b"\xff" * (wire.output_size + wire.input_size)))
    for _ in range(3000):
        raw = bytearray(raw_good[: choice.randrange(0, len(raw_good) - 4)])
        if datagrams_of(raw) is None:
            assert not wire.bus.receive(raw, wire.master.now_ns)
    assert bytes(wire.bus.coupling.outputs) == before

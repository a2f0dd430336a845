"""An emulator that is let run late answers late, and that is all: data, clocks and watchdogs are as
of the frames' arrival.
"""

import socket
import time

import pytest

from sim_backend.bus.arrivals import Arrivals
from tests.bus.emulator.bring_up import Wire

MS = 1_000_000


@pytest.fixture
def paced(make_bus):
    """The bench in OP in real time, and the time now."""
    wire = Wire(make_bus("bench"))
    wire.exchange(bytes(wire.output_size))
    return wire


def arrive(wire, at_ns):
    """One frame of process data that arrived then; its reference time."""
    wire.master.now_ns = at_ns - wire.master.step_ns
    assert wire.exchange(bytes(wire.output_size))[1] == wire.expected_counter
    return wire.bus.slaves["coupler"].clock.system_ns()


def test_frames_that_waited_are_answered_as_of_their_arrival(paced):
    bus, began_ns = paced.bus, paced.master.now_ns
    first_cycle, first_ns = bus.cycle, bus.slaves["coupler"].clock.system_ns()
    for ms in range(1, 51):  # all read at the end of a stop of 50 ms
        passed_ns = arrive(paced, began_ns + ms * MS) - first_ns
        assert abs(passed_ns - ms * MS) <= 1 and abs(bus.cycle - first_cycle - ms) <= 1
    assert bus.counters.watchdogs == {}


def test_watchdogs_are_fed_by_frames_that_waited(paced):
    bus, began_ns = paced.bus, paced.master.now_ns
    for ms in range(60, 400, 60):
        arrive(paced, began_ns + ms * MS)
    assert bus.counters.watchdogs == {}


def test_a_watchdog_expires_in_its_own_cycle_however_late_that_is_noticed(paced):
    bus, began_ns = paced.bus, paced.master.now_ns
    last, seen = bus.cycle, []
    drive, expired = bus.slaves["drive"], bus.slaves["drive"].watchdog_expired
    drive.watchdog_expired = lambda: (seen.append(bus.cycle), expired())
    bus.advance_to(began_ns + 300 * MS)
    assert abs(bus.cycle - last - 300) <= 1 and len(seen) == 1 and 99 <= seen[0] - last <= 102


def test_a_frame_from_before_the_present_is_taken_for_the_present(paced):
    bus, now_ns = paced.bus, paced.master.now_ns + 20 * MS
    bus.advance_to(now_ns)
    cycle = bus.cycle
    arrive(paced, now_ns - 5 * MS)
    assert bus.cycle == cycle and bus.agenda.now_ns == now_ns


def test_steps_that_are_left_for_later_are_not_left_out(paced):
    bus, began_ns, first = paced.bus, paced.master.now_ns, paced.bus.cycle
    bus.advance_to(began_ns + 50 * MS, 10)
    assert bus.cycle - first == 10 and bus.next_due_ns() < began_ns + 50 * MS
    arrive(paced, began_ns + 50 * MS)
    assert abs(bus.cycle - first - 50) <= 1


def test_of_a_long_stop_the_rest_is_left_out(paced):
    bus, began_ns, first = paced.bus, paced.master.now_ns, paced.bus.cycle
    bus.advance_to(began_ns + 5_000 * MS)
    assert bus.cycle - first <= 1
    bus.advance_to(began_ns + 5_010 * MS)
    assert 9 <= bus.cycle - first <= 11


def test_the_kernels_stamp_tells_when_a_packet_came():
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there,
    ):
        here.bind(("127.0.0.1", 0))
        arrivals = Arrivals(here)
        for _ in range(
            20
            # the kernel switches stamps on in a work queue of its own: the first packets may have
            # none
        ):
            before_ns = time.monotonic_ns()
            there.sendto(b"x", here.getsockname())
            time.sleep(0.05)
            assert here.recv(10) == b"x"
            now_ns = time.monotonic_ns()
            came_ns = arrivals.of_last(now_ns)
            assert before_ns - MS <= came_ns <= now_ns
            if came_ns <= now_ns - 40 * MS:
                return
        pytest.fail("found no packet whose stamp is older than its reading, expected one in twenty")


def test_a_clock_that_was_set_is_noticed_and_no_frame_comes_from_the_future():
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there,
    ):
        here.bind(("127.0.0.1", 0))
        arrivals = Arrivals(here)
        for ahead_ns in (-3600_000 * MS, 3600_000 * MS):
            arrivals._ahead_ns += ahead_ns  # as if the clock had been set meanwhile
            before_ns = time.monotonic_ns()
            there.sendto(b"x", here.getsockname())
            here.recv(10)
            now_ns = time.monotonic_ns()
            assert before_ns - MS <= arrivals.of_last(now_ns) <= now_ns

"""Where the loop stood still for longer than the slaves' watchdog, nothing gets back what it lost:
without a bus, then on the emulated one.
"""

import pytest

from drivers.bus import LOST
from drivers.cycle import Cycle
from drivers.wire import WireImage
from epa_rt.backend import BackendError
from epa_rt.config.rig import load_rig
from tests.bus.own_network import REAL_TIME, call

RIG = load_rig("config/rigs/bench.yaml")
WATCHDOG_S = 6.0  # a test machine that stands still for so long is none


class Answers:
    """A bus whose frames come back as told, one after the other; the last answer for ever."""

    interface, sent_ns, round_trip_ns = "eth1", 0, 0

    def __init__(self, *counters):
        self.counters, self.sent = list(counters), []

    def swap(self, outputs_raw):
        self.sent.append(outputs_raw)
        return self.counters.pop(0) if len(self.counters) > 1 else self.counters[0], b""


def cycle_on(bus, paced=True, recovery="stop"):
    changed = {
        "safety": RIG.safety.model_copy(update={"watchdog": WATCHDOG_S}),
        "master": RIG.master.model_copy(update={"recovery": recovery}),
    }
    return Cycle(bus, RIG.model_copy(update=changed), WireImage(RIG), paced, has_clock=False)


def pass_silently(cycle, seconds=WATCHDOG_S + 1.0):
    cycle.heard_ns -= round(seconds * 1e9)


def test_after_a_pause_no_live_frame_goes_out_but_a_safe_one_does():
    bus = Answers(8)
    cycle = cycle_on(bus)
    assert cycle.turn(b"live", live=True)[0]
    pass_silently(cycle)
    with pytest.raises(
        BackendError,
        match=(
            r"^no process data reached the slaves for 70\d\d\.\d ms, longer than their watchdog of"
            r" 6000 ms: they have dropped their outputs$"
        ),
    ):
        cycle.turn(b"live", live=True)
    assert bus.sent == [b"live"]
    assert cycle.turn(cycle.safe)[0] and bus.sent[-1] == cycle.safe


def test_a_pause_that_the_machine_made_is_named():
    cycle = cycle_on(Answers(8))
    assert cycle.turn(b"live", live=True)[0]
    cycle.edges.wait = lambda: (0, 6_500_000_000)
    pass_silently(cycle)
    with pytest.raises(BackendError, match="let the loop stand still for 6500.0 ms of it$"):
        cycle.turn(b"live", live=True)


def test_a_pause_shorter_than_the_watchdog_is_none():
    cycle = cycle_on(Answers(8))
    pass_silently(cycle, 0.1)
    assert cycle.turn(b"live", live=True)[0]


def test_in_lock_step_time_is_the_plants():
    cycle = cycle_on(Answers(8), paced=False)
    pass_silently(cycle)
    assert cycle.turn(b"live", live=True)[0]


@pytest.mark.parametrize(
    ("counter", "recovery", "heard"),
    [
        (8, "stop", True),
        (7, "stop", False),
        (LOST, "stop", False),
        (7, "continue", True),
        (0, "continue", False),
        (LOST, "continue", False),
    ],
)
def test_only_what_reached_the_slaves_counts(counter, recovery, heard):
    """A terminal that is being taken back is missing in the counter, and is not what ends the
    run.
    """
    cycle = cycle_on(Answers(counter), recovery=recovery)
    pass_silently(cycle)
    before = cycle.heard_ns
    cycle.turn(cycle.safe)
    assert (cycle.heard_ns > before) == heard


def test_frames_that_were_lost_for_so_long_are_named():
    cycle = cycle_on(Answers(LOST))
    cycle.turn(b"live", live=True)
    pass_silently(cycle)
    with pytest.raises(
        BackendError,
        match=(
            "they have dropped their outputs; no frame came back from eth1 in 1 cycles in a row:"
            " its cable, its link, or the supply of coupler"
        ),
    ):
        cycle.turn(b"live", live=True)


@pytest.mark.network
@pytest.mark.timeout(900)
@REAL_TIME
def test_a_process_that_was_stopped_gives_nothing_back():
    result = call("tests.bus.driver.silent:stood_still")
    assert result["ok"] and result["dropped"] == [
        "analog_out",
        "drive",
        "valves",
    ]  # else nothing was tested
    assert result["sentence"].startswith("no process data reached the slaves for ")
    assert (
        "longer than their watchdog of 2000 ms: they have dropped their outputs"
        in result["sentence"]
    )
    assert result["frames"][0] == result["frames"][1]  # not one before closing
    assert result["rises"] == 1

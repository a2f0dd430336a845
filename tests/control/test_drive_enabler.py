"""CiA 402 enabler against a drive written from the standard's table, with random faults and delays;
output enabler.
"""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.control.analog_drive import OutputEnabler
from epa_rt.control.cia402 import DriveEnabler, DriveState, decode

STATUS = {
    "not ready": 0x0000,
    "switch on disabled": 0x0040,
    "ready": 0x0021,
    "switched on": 0x0023,
    "operation": 0x0027,
    "quick stop": 0x0007,
    "reaction": 0x000F,
    "fault": 0x0008,
}


class Drive:
    """IEC 61800-7-201 transitions as a table of control-word patterns; anything else keeps the
    state.
    """

    def __init__(self, state="switch on disabled", delay=0):
        self.state, self.last, self.delay = state, 0x0080, delay
        self.pipe = [STATUS[state]] * delay
        self.skipped = []

    def take(self, word):
        rising = word & 0x80 and not self.last & 0x80
        self.last = word
        s = self.state
        if s == "fault":
            self.state = "switch on disabled" if rising else s
        elif s == "reaction":
            self.state = "fault"
        elif s == "not ready" or word & 0x02 == 0:
            self.state = "switch on disabled"
        elif word & 0x04 == 0:
            self.state = {"operation": "quick stop", "quick stop": "quick stop"}.get(
                s, "switch on disabled"
            )
        elif word & 0x01 == 0:
            self.state = s if s == "quick stop" else "ready"
        elif word & 0x08 == 0:
            if s == "switch on disabled":
                self.skipped.append(word)
            self.state = {"ready": "switched on", "operation": "switched on"}.get(s, s)
        else:
            if s in ("switch on disabled", "ready"):
                self.skipped.append(word)
            self.state = {"switched on": "operation"}.get(s, s)

    def status(self, extra=0):
        self.pipe.append(STATUS[self.state] | extra)
        return self.pipe.pop(0)


def walk(enabler, drive, cycles):
    words = []
    for _ in range(cycles):
        words.append(enabler.step(drive.status()))
        drive.take(words[-1])
    return words


@pytest.mark.parametrize("name, bits", STATUS.items())
@pytest.mark.parametrize("extra", [0x0000, 0x1210, 0x0080, 0xFE90])
def test_decodes_every_state_whatever_the_other_bits(name, bits, extra):
    names = [
        "NOT_READY",
        "SWITCH_ON_DISABLED",
        "READY",
        "SWITCHED_ON",
        "OPERATION_ENABLED",
        "QUICK_STOP_ACTIVE",
    ]
    expected = dict(zip(STATUS, [*names, "FAULT_REACTION", "FAULT"], strict=True))[name]
    assert decode(bits | extra) is DriveState[expected]


def test_every_status_word_has_one_state_by_the_masks_of_the_standard():
    masks = {
        "READY": 0x21,
        "SWITCHED_ON": 0x23,
        "OPERATION_ENABLED": 0x27,
        "QUICK_STOP_ACTIVE": 0x07,
    }
    narrow = {"NOT_READY": 0x00, "SWITCH_ON_DISABLED": 0x40, "FAULT_REACTION": 0x0F, "FAULT": 0x08}
    for word in range(0x10000):
        by_mask = [n for n, v in masks.items() if word & 0x6F == v] + [
            n for n, v in narrow.items() if word & 0x4F == v
        ]
        assert len(by_mask) <= 1
        assert decode(word).name == (by_mask or ["UNKNOWN"])[0]


@pytest.mark.parametrize("start", STATUS)
@pytest.mark.parametrize("delay", [0, 1, 3])
def test_walks_up_from_any_state_and_down_again(start, delay):
    drive, enabler = Drive(start, delay), DriveEnabler(timeout_cycles=20)
    assert enabler.step(drive.status()) == 0x0000
    enabler.enable()
    walk(enabler, drive, 60)
    assert (drive.state, enabler.enabled, enabler.targets_live, enabler.cause) == (
        "operation",
        True,
        True,
        "",
    )
    assert not drive.skipped
    enabler.disable(controlled=True)
    assert not enabler.targets_live
    assert [w for w in dict.fromkeys(walk(enabler, drive, 20))] == [0x07, 0x06]
    assert drive.state == "ready"
    enabler.enable()
    walk(enabler, drive, 20)
    assert enabler.enabled
    enabler.disable()
    assert set(walk(enabler, drive, 10)) == {0x0000}
    assert drive.state == "switch on disabled"


def test_one_word_per_transition():
    enabler = DriveEnabler()
    enabler.enable()
    assert [hex(w) for w in walk(enabler, Drive("fault"), 8)] == [
        "0x0",
        "0x80",
        "0x6",
        "0x7",
        "0xf",
        "0xf",
        "0xf",
        "0xf",
    ]


def test_fault_is_left_alone_unless_asked():
    enabler, drive = DriveEnabler(), Drive("fault")
    enabler.enable(reset_fault=False)
    assert set(walk(enabler, drive, 5)) == {0x0000}
    assert enabler.fault and "fault" in enabler.cause


def test_fault_is_reset_once_per_request():
    enabler, drive = DriveEnabler(), Drive("fault")
    enabler.enable()
    words = walk(enabler, drive, 3)
    drive.state = "fault"
    words += walk(enabler, drive, 10)
    assert words.count(0x80) == 1 and "reset once" in enabler.cause
    enabler.enable()
    walk(enabler, drive, 10)
    assert enabler.enabled


@pytest.mark.parametrize(
    "stuck", ["not ready", "switch on disabled", "ready", "switched on", "fault", "reaction"]
)
def test_a_drive_that_does_not_move_is_named(stuck):
    enabler = DriveEnabler(timeout_cycles=10)
    enabler.enable()
    words = [enabler.step(STATUS[stuck]) for _ in range(13)]
    assert f"stuck in {decode(STATUS[stuck]).value}" in enabler.cause
    assert words[-1] == 0x0000 and not enabler.enabled


def test_a_drive_that_goes_in_circles_is_given_up():
    enabler = DriveEnabler(timeout_cycles=10)
    enabler.enable()
    for k in range(100):
        enabler.step(STATUS["ready" if k % 2 else "switch on disabled"])
    assert "cycles after enable" in enabler.cause


def test_a_drive_that_will_not_be_disabled_is_named():
    enabler = DriveEnabler(timeout_cycles=10)
    enabler.enable()
    enabler.step(STATUS["operation"])
    enabler.disable(controlled=True)
    words = [enabler.step(STATUS["operation"]) for _ in range(14)]
    assert words[0] == 0x07 and words[-1] == 0x0000 and "after disable" in enabler.cause


@pytest.mark.parametrize(
    "to, word",
    [
        ("quick stop", 0x02),
        ("fault", 0),
        ("switched on", 0),
        ("switch on disabled", 0),
        ("reaction", 0),
    ],
)
def test_loss_of_operation_is_a_cause_and_ends_the_request(to, word):
    enabler, drive = DriveEnabler(), Drive()
    enabler.enable()
    walk(enabler, drive, 6)
    assert enabler.step(STATUS[to]) == word
    assert decode(STATUS[to]).value in enabler.lost and enabler.cause == enabler.lost
    assert not enabler.targets_live and enabler.quick_stop_active == (to == "quick stop")
    assert enabler.step(STATUS["switch on disabled"]) == 0x0000
    assert enabler.step(STATUS["operation"]) == 0x0000


@settings(max_examples=300)
@given(
    st.lists(
        st.sampled_from(
            ["run"] * 12 + ["enable", "enable kept", "disable", "controlled", *STATUS, "noise"]
        ),
        max_size=120,
    ),
    st.integers(0, 3),
    st.integers(0, 0xFFFF),
)
def test_no_sequence_skips_a_transition_or_drives_a_faulty_drive(acts, delay, noise):
    drive, enabler = Drive("not ready", delay), DriveEnabler(timeout_cycles=15)
    resets = asked = 0
    previous = 0
    for act in acts:
        if act.startswith("enable"):
            enabler.enable(reset_fault=act == "enable")
            asked += act == "enable"
        elif act in ("disable", "controlled"):
            enabler.disable(controlled=act == "controlled")
        elif act in STATUS:
            drive.state = act
        status = noise if act == "noise" else drive.status()
        word = enabler.step(status)
        state = decode(status)
        assert word in (0x00, 0x02, 0x06, 0x07, 0x0F, 0x80)
        if word == 0x0F:
            assert state in (DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
        if word == 0x07:
            assert state in (DriveState.READY, DriveState.OPERATION_ENABLED)
        if word == 0x80:
            assert state is DriveState.FAULT
        assert enabler.targets_live <= (state is DriveState.OPERATION_ENABLED and word == 0x0F)
        assert enabler.fault == (state in (DriveState.FAULT, DriveState.FAULT_REACTION))
        resets += bool(word & 0x80 and not previous & 0x80)
        previous = word
        drive.take(word)
        assert not (delay == 0 and drive.skipped and act != "noise") or act in STATUS
        drive.skipped.clear()
    assert resets <= asked


@pytest.mark.parametrize("make", [lambda: DriveEnabler(0), lambda: OutputEnabler(-1)])
def test_impossible_times_are_refused(make):
    with pytest.raises(ValueError, match="cycles"):
        make()


def test_output_enabler_waits_then_is_live_and_stops():
    enabler = OutputEnabler(delay_cycles=3)
    assert enabler.step() == 0
    enabler.enable()
    seen = [(enabler.step(), enabler.targets_live) for _ in range(6)]
    assert seen == [(1, False)] * 3 + [(1, True)] * 3
    enabler.disable(controlled=True)
    assert not enabler.targets_live
    assert [enabler.step() for _ in range(6)] == [1, 1, 1, 0, 0, 0]
    enabler.enable()
    enabler.step()
    enabler.disable()
    assert enabler.step() == 0


def test_output_enabler_names_a_ready_input_that_never_rises_or_falls():
    enabler = OutputEnabler(delay_cycles=2)
    enabler.enable()
    assert [enabler.step(0) for _ in range(4)] == [1, 1, 0, 0]
    assert "not risen" in enabler.cause and enabler.fault
    enabler.enable(reset_fault=False)
    assert enabler.step(1) == 0 and "fault" in enabler.cause
    enabler.enable()
    assert [enabler.step(1) for _ in range(3)] == [1, 1, 1] and enabler.enabled
    assert enabler.step(0) == 0
    assert "fell" in enabler.lost and not enabler.targets_live

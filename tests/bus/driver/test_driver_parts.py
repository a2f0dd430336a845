"""The driver's parts that need no bus: words, layouts, objects, settings."""

import subprocess
import sys

import pytest

from drivers import nic
from drivers.backend import EthercatBackend, slow_to_notice
from drivers.epos4 import interpolation_time
from drivers.host import cores_of, host_findings
from drivers.interface import Interface, candidates
from drivers.mapping import analog_in_pdos, mapped_object
from drivers.wire import WireImage
from drivers.words import abort_words, al_status_words, state_words
from epa_rt.backend import BackendError
from epa_rt.config.devices import EPOS4_INPUTS, EPOS4_OUTPUTS
from epa_rt.config.rig import Slave, load_rig
from epa_rt.safety.bus_budget import frame_timeout_s

RIGS = ("bench", "bench_analog", "mass", "knee")


def rig_named(name: str):
    return load_rig(f"config/rigs/{name}.yaml")


@pytest.mark.parametrize(
    ("name", "counter"), [("bench", 8), ("bench_analog", 6), ("mass", 8), ("knee", 8)]
)
def test_working_counter_from_the_rig_file(name, counter):
    assert WireImage(rig_named(name)).working_counter == counter


@pytest.mark.parametrize("name", RIGS)
def test_every_byte_of_the_image_belongs_to_one_slave(name):
    wire = WireImage(rig_named(name))
    assert [
        byte for share in wire.shares for byte in range(share.out_start, share.out_end)
    ] == list(range(wire.output_size))
    assert sum(share.in_length for share in wire.shares) == wire.input_size


def test_a_length_that_differs_is_named():
    wire = WireImage(rig_named("bench"))
    right = [(share.out_end - share.out_start, share.in_length) for share in wire.shares]
    wire.check(right, 8)
    with pytest.raises(
        BackendError,
        match=r"found 12 bytes of outputs .* of drive \(slave 5, EPOS4\), expected 13 and 19",
    ):
        wire.check([*right[:4], (12, 19)], 8)
    with pytest.raises(BackendError, match="working counter is 7, expected 8"):
        wire.check(right, 7)


def test_mapping_objects_of_the_drive():
    assert [f"{mapped_object(e):08X}" for e in EPOS4_OUTPUTS] == [
        "60400010",
        "60600008",
        "607A0020",
        "60FF0020",
        "60710010",
    ]
    assert f"{mapped_object(EPOS4_INPUTS[5]):08X}" == "30D10220"


@pytest.mark.parametrize(
    ("inputs", "pdos"),
    [
        (None, [0x1A00, 0x1A02, 0x1A04, 0x1A06]),
        (("ch1", "ch3"), [0x1A01, 0x1A05]),
        (("ch2_status", "ch2", "ch4"), [0x1A02, 0x1A07]),
    ],
)
def test_analog_inputs_with_and_without_status(inputs, pdos):
    assert analog_in_pdos(Slave(name="analog_in", device="EL3004", inputs=inputs)) == pdos


def test_a_status_without_its_value_is_refused():
    with pytest.raises(BackendError, match="'ch1_status' without 'ch1' behind it"):
        analog_in_pdos(Slave(name="analog_in", device="EL3004", inputs=("ch1_status", "ch2")))


@pytest.mark.parametrize(
    ("period_s", "value"), [(1e-3, (1, -3)), (2e-3, (2, -3)), (5e-4, (5, -4)), (1.25e-4, (125, -6))]
)
def test_interpolation_time(period_s, value):
    assert interpolation_time(period_s) == value


def test_a_period_that_the_drive_cannot_hold():
    with pytest.raises(BackendError, match="0x60C2"):
        interpolation_time(0.000_333_33)


def test_words():
    assert state_words(0x14) == "SAFEOP with error"
    assert state_words(0) == "no answer"
    assert al_status_words(0x001B).startswith("0x001B sync manager watchdog")
    assert "not in the table" in al_status_words(0x7777)
    assert abort_words(0x06010002) == "0x06010002 attempt to write a read-only object"
    assert "not in the table" in abort_words(1)


def test_a_frame_is_lost_in_time_for_the_reaction():
    rig = rig_named("bench")
    assert frame_timeout_s(rig) * rig.safety.lost_cycles < rig.safety.reaction
    own = rig.model_copy(update={"master": rig.master.model_copy(update={"frame_timeout": 0.001})})
    assert frame_timeout_s(own) == 0.001
    assert slow_to_notice(rig) == slow_to_notice(own) == []
    slow = rig.model_copy(
        update={
            "master": rig.master.model_copy(update={"frame_timeout": 0.1, "states_every": 0.05})
        }
    )
    assert slow_to_notice(slow) == [
        (
            "3 lost frames are noticed after 300 ms (frame_timeout), later than the reaction time"
            " of 20 ms"
        ),
        (
            "two of three cycles lost are noticed after 476 ms (lost_time, lost_share), later than"
            " the reaction time of 20 ms"
        ),
        (
            "a slave that left OP is noticed after up to 50 ms (states_every), later than the"
            " reaction time of 20 ms"
        ),
    ]
    for change in ({"lost_time": 0.013}, {"lost_share": 0.3}, {"lost_share": 0.7}):
        lax = rig.model_copy(update={"safety": rig.safety.model_copy(update=change)})
        assert ["two of three" in note for note in slow_to_notice(lax)] == [True]


def test_a_closed_backend_exchanges_nothing_and_closes_twice():
    backend = EthercatBackend(rig_named("bench"), "no_such_interface")
    backend.close()
    with pytest.raises(BackendError, match="closed backend"):
        backend.exchange(bytes(22))
    with pytest.raises(BackendError, match="no network interface 'no_such_interface'"):
        backend.open()
    backend.close()
    backend.close()


def test_core_lists():
    assert cores_of("0,2-3") == {0, 2, 3}
    assert cores_of("") == set()


def test_the_host_is_looked_at_without_an_error():
    findings = host_findings(80, None)
    assert len({f.name for f in findings}) == len(findings)
    assert all(f.found and "\n" not in f.found for f in findings)
    assert all(f.command for f in findings if f.status == "could be better")


def test_doctor_as_the_command_line_shows_it():
    done = subprocess.run(
        [sys.executable, "-m", "epa_rt", "doctor"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode in (0, 1) and not done.stderr
    assert "raw socket" in done.stdout
    done = subprocess.run(
        [sys.executable, "-m", "epa_rt", "doctor", "--interface", "no_such_interface"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 2 and "no network interface 'no_such_interface'" in done.stderr


def test_scan_of_an_interface_that_is_not_there():
    done = subprocess.run(
        [sys.executable, "-m", "epa_rt", "scan", "--interface", "no_such_interface"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1


def test_a_card_that_holds_frames_back_is_told_with_the_command(monkeypatch):
    answers = {
        "-k": "generic-receive-offload: on\nlarge-receive-offload: off [fixed]\n",
        "-i": "driver: igb\n",
        "-c": "Adaptive RX: on  TX: off\nrx-usecs: 50\nrx-frames: 0\ntx-usecs: 3\n",
    }
    monkeypatch.setattr("drivers.nic._ethtool", lambda option, name: answers[option])
    card = Interface("eth9", True, False, True, True, False)
    assert nic._driver(card).found == "igb"
    offloads, coalescing = nic._offloads(card), nic._coalescing(card)
    assert (offloads.status, offloads.command) == (
        "could be better",
        "sudo ethtool -K eth9 gro off",
    )
    assert (
        coalescing.found == "rx-usecs 50, rx-frames 0, tx-usecs 3"
        and "rx-usecs 0" in coalescing.command
    )


def test_the_only_wired_interface_is_the_candidate():
    lan, wlan, routed, down = (
        Interface("eth1", True, False, True, True, False),
        Interface("wlan0", True, True, True, True, False),
        Interface("eth0", True, False, True, True, True),
        Interface("eth2", True, False, False, False, False),
    )
    assert candidates([lan, wlan, routed, down]) == [lan]
    assert candidates([wlan, routed, down]) == [down]
    assert candidates([wlan, routed]) == []

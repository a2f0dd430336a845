"""A channel whose counts mean something else than the table says is found before anything moves;
without a bus, then on the emulated one.
"""

import pytest

from drivers.channels import channels_of, check_channels
from epa_rt.backend import BackendError
from epa_rt.config.rig import load_rig
from tests.bus.driver.test_alone import Objects
from tests.bus.driver.test_driver_bus import bus_case

RIG = load_rig("config/rigs/bench_analog.yaml")
IN, OUT = (
    next(slave for slave in RIG.slaves if slave.name == name)
    for name in ("analog_in", "analog_out")
)


class Counted(Objects):
    def __init__(self, numbers):
        super().__init__(numbers)
        self.asked = []

    def number_if_there(self, index, subindex=0):
        self.asked.append((index, subindex))
        return super().number_if_there(index, subindex)


@pytest.mark.parametrize(
    ("slave", "place", "number", "words"),
    [
        (IN, (0x8000, 0x01), 1, "found 0x8000:01 = 1 in slave, the user scale of channel 1"),
        (IN, (0x8010, 0x02), 2, "found 0x8010:02 = 2 in slave, the presentation of channel 2"),
        (IN, (0x8020, 0x05), 1, "found 0x8020:05 = 1 in slave, the Siemens bits of channel 3"),
        (OUT, (0x8000, 0x01), 1, "found 0x8000:01 = 1 in slave, the user scale of channel 1"),
        (OUT, (0x8000, 0x02), 3, "found 0x8000:02 = 3 in slave, the presentation of channel 1"),
    ],
)
def test_a_setting_that_changes_counts_is_refused_with_the_line_that_mends_it(
    slave, place, number, words
):
    with pytest.raises(BackendError) as found:
        check_channels(Objects({place: number}), slave, RIG)
    assert words in str(found.value) and "\n" not in str(found.value)
    assert (
        f"expected 0: write it at start by 'startup: [{{object: 0x{place[0]:04X}:{place[1]:02X},"
        " type: u8, value: 0}]'" in str(found.value)
    )


@pytest.mark.parametrize(
    ("slave", "numbers", "questions"),
    [
        (IN, {}, 9),
        (OUT, {}, 2),
        (IN, {(0x8030, 0x01): 1}, 9),
        (OUT, {(0x8000, 0x05): 1, (0x8010, 0x02): 1}, 2),
        (IN, {(0x8000, 0x01): 0, (0x8000, 0x02): 0}, 9),
    ],
)
def test_what_is_missing_or_stands_for_no_row_is_passed_over(slave, numbers, questions):
    mailbox = Counted(numbers)
    check_channels(mailbox, slave, RIG)
    assert len(mailbox.asked) == questions


@pytest.mark.parametrize("name", ["bench", "bench_analog", "knee", "mass"])
def test_every_row_on_a_terminal_has_its_channel(name):
    rig = load_rig(f"config/rigs/{name}.yaml")
    for slave in rig.slaves:
        if slave.device in ("EL3004", "EL4034"):
            assert set(channels_of(rig, slave)) <= {1, 2, 3, 4}


@pytest.mark.network
@pytest.mark.timeout(900)
def test_on_the_bus_it_is_named_and_gets_no_output():
    result = bus_case(
        "refused", change="object", slave="analog_in", index=0x8000, subindex=2, value=1, size=1
    )
    assert (
        "found 0x8000:02 = 1 in analog_in (slave 3, EL3004), the presentation of channel 1"
        in result["sentence"]
    )
    assert result["process_frames"] == 0 and not any(bytes.fromhex(result["outputs"]))

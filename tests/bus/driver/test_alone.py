"""An analog output that would go on without its master is found before anything moves; rules
without a bus, then on the emulated one. The drive: test_reactions.py.
"""

import pytest

from drivers.alone import check_alone
from epa_rt.backend import BackendError
from epa_rt.config.rig import Slave
from tests.bus.driver.test_driver_bus import bus_case

DRIVE, ANALOG = Slave(name="drive", device="EPOS4"), Slave(name="analog_out", device="EL4034")
SOUND = {
    (0x8000 + 0x10 * n, sub): value
    for n in range(4)
    for sub, value in ((0x05, 0), (0x13, 0), (0x14, 0xFFFF))
}


class Objects:
    """What a slave answers: place to unsigned number."""

    label = "slave"

    def __init__(self, numbers: dict):
        self.numbers = numbers

    def number_if_there(self, index: int, subindex: int = 0) -> int | None:
        return self.numbers.get((index, subindex))

    def number(self, index: int, subindex: int = 0) -> int:
        return self.numbers[index, subindex]


@pytest.mark.parametrize(
    ("slave", "numbers", "words"),
    [
        (
            ANALOG,
            {place: number for place, number in SOUND.items() if place != (0x8010, 0x13)}
            | {(0x8010, 0x05): 2},
            "found 0x8010:05 = 2 in slave, channel 2 holds its voltage",
        ),
        (
            ANALOG,
            SOUND | {(0x8020, 0x05): 2},
            "found 0x8020:05 = 2 in slave, channel 3 holds its voltage",
        ),
        (
            ANALOG,
            SOUND | {(0x8000, 0x13): 0xFF38},
            "found 0x8000:13 = -200 in slave, where channel 1 goes",
        ),
        (
            ANALOG,
            SOUND | {(0x8030, 0x05): 1, (0x8030, 0x14): 30},
            "found 0x8030:14 = 30 digits/ms in slave",
        ),
    ],
)
def test_what_would_not_be_safe_is_refused_with_the_line_that_mends_it(slave, numbers, words):
    with pytest.raises(
        BackendError,
        match=(
            r"write it at start by 'startup: \[\{object: 0x80\d0:\d\d,"
            r" type: (u8|i16), value: 0\}\]'"
        ),
    ) as found:
        check_alone(Objects(numbers), slave)
    assert words in str(found.value) and "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("slave", "numbers"),
    [(ANALOG, SOUND), (ANALOG, SOUND | {(0x8030, 0x05): 1}), (DRIVE, {(0x8000, 0x05): 2})],
)
def test_what_ends_without_power_passes(slave, numbers):
    assert check_alone(Objects(numbers), slave) == []


@pytest.mark.parametrize(("slave", "numbers", "count"), [(DRIVE, {}, 0), (ANALOG, {}, 4)])
def test_what_is_not_told_is_a_note(slave, numbers, count):
    notes = check_alone(Objects(numbers), slave)
    assert len(notes) == count and all("not tell" in note for note in notes)


@pytest.mark.network
@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    ("slave", "index", "subindex", "value", "size", "words"),
    [
        (
            "analog_out",
            0x8010,
            5,
            2,
            1,
            "found 0x8010:05 = 2 in analog_out (slave 4, EL4034), channel 2 holds",
        )
    ],
)
def test_on_the_bus_it_is_named_and_gets_no_output(slave, index, subindex, value, size, words):
    result = bus_case(
        "refused",
        change="object",
        slave=slave,
        index=index,
        subindex=subindex,
        value=value,
        size=size,
        bare=True,
    )
    assert words in result["sentence"]
    assert result["process_frames"] == 0 and not any(bytes.fromhex(result["outputs"]))

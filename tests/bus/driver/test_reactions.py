"""What the drive does by itself at a stop is written and read back, or refused before anything
moves; rules without a bus, then on the emulated one.
"""

import pytest

from drivers.filters import lag_s, set_filter
from drivers.reactions import set_homing, set_reactions, set_window
from epa_rt.backend import BackendError
from epa_rt.config.rig import Rig, Slave, StartupSdo, Zero, load_rig
from epa_rt.config.rig_homing import HomingOptions
from epa_rt.config.source import ConfigError, parse_yaml, validate
from epa_rt.signals.drive_options import drive_options
from tests.bus.driver.test_driver_bus import bus_case

RIG = load_rig("config/rigs/bench.yaml")
DRIVE = next(slave for slave in RIG.slaves if slave.device == "EPOS4")
ANALOG_IN = next(slave for slave in RIG.slaves if slave.device == "EL3004")
OPTIONS = drive_options(RIG)
WRITTEN = {
    0x6007: OPTIONS.lost_master,
    0x605A: OPTIONS.quick_stop,
    0x605B: OPTIONS.shutdown,
    0x605C: OPTIONS.disable,
    0x605E: OPTIONS.fault,
    0x6084: OPTIONS.deceleration_rpm_s,
    0x6085: OPTIONS.quick_stop_rpm_s,
}


class Stored:
    """A slave that keeps what is written into the objects that it has."""

    label = "slave"

    def __init__(self, *places: tuple[int, int]):
        self.numbers: dict[tuple[int, int], int] = dict.fromkeys(places, 0)

    def number_if_there(self, index: int, subindex: int = 0) -> int | None:
        return self.numbers.get((index, subindex))

    def set_if_there(self, index: int, subindex: int, data: bytes) -> bool:
        if (index, subindex) not in self.numbers:
            return False
        self.numbers[index, subindex] = int.from_bytes(data, "little")
        return True


def given(slave: Slave, place: str, kind: str, value: int) -> Slave:
    sdo = StartupSdo(object=place, type=kind, value=value)
    return slave.model_copy(update={"startup": (sdo,)})


def test_every_reaction_is_written_and_that_it_holds_is_said_once():
    drive = Stored(*((index, 0) for index in WRITTEN))
    notes = set_reactions(drive, DRIVE, RIG)
    assert {index: drive.numbers[index, 0] for index in WRITTEN} == WRITTEN
    assert len(notes) == 1 and "holds under power, until the next master" in notes[0]


@pytest.mark.parametrize("missing", sorted(WRITTEN))
def test_what_the_drive_does_not_have_is_a_note(missing):
    drive = Stored(*((index, 0) for index in WRITTEN if index != missing))
    notes = set_reactions(drive, DRIVE, RIG)
    assert len(notes) == 1 and f"no 0x{missing:04X})" in notes[0]


@pytest.mark.parametrize(
    ("index", "kind", "value"),
    [
        *((0x6007, "i16", value) for value in (-1, 0, 4)),
        *((0x605A, "i16", value) for value in (-1, 0, 1, 2, 3, 4)),
        (0x605B, "i16", 0),
        (0x605C, "i16", 0),
        (0x605E, "i16", 0),
        (0x6084, "u32", OPTIONS.deceleration_rpm_s - 1),
        (0x6085, "u32", OPTIONS.quick_stop_rpm_s - 1),
    ],
)
def test_a_start_up_object_that_lets_the_motor_fly_is_refused_where_the_drive_has_it(
    index, kind, value
):
    drive, slave = (
        Stored(*((index, 0) for index in WRITTEN)),
        given(DRIVE, f"0x{index:04X}:00", kind, value),
    )
    with pytest.raises(BackendError) as found:
        set_reactions(drive, slave, RIG)
    text = str(found.value)
    assert text.startswith(f"found 0x{index:04X} = {value} in the rig file's startup of slave")
    assert f"expected {WRITTEN[index]}: write it at start by" in text and "\n" not in text
    del drive.numbers[index, 0]
    set_reactions(drive, slave, RIG)


@pytest.mark.parametrize(
    ("index", "kind", "value"),
    [
        (0x6007, "i16", 3),
        (0x6007, "i16", 2),
        (0x6007, "i16", 1),
        (0x605A, "i16", 5),
        (0x605E, "i16", 1),
        (0x6085, "u32", OPTIONS.quick_stop_rpm_s + 1),
    ],
)
def test_a_start_up_object_that_brakes_is_left_as_it_is(index, kind, value):
    drive = Stored(*((other, 0) for other in WRITTEN))
    drive.numbers[index, 0] = value  # written before, with the other start-up objects
    set_reactions(drive, given(DRIVE, f"0x{index:04X}:00", kind, value), RIG)
    assert drive.numbers[index, 0] == value


HOMING = ((0x6098, 0), (0x6099, 1), (0x6099, 2), (0x609A, 0), (0x30B0, 0), (0x30B1, 0))
MOVING = HomingOptions(method=34, home_counts=12720, speed_rpm=72, acceleration_rpm_s=720)


def test_a_homing_that_moves_is_set_with_its_speeds_or_refused():
    drive = Stored(*HOMING)
    drive.numbers[0x30B1, 0] = 5000  # a move behind the pulse, of somebody else
    notes = set_homing(drive, RIG, MOVING)
    assert drive.numbers == dict(zip(HOMING, (34, 72, 72, 720, 12720, 0), strict=True))
    assert "method 34 at 72 rpm and 720 rpm/s" in notes[0]
    for missing in HOMING:
        drive = Stored(*(place for place in HOMING if place != missing))
        with pytest.raises(BackendError, match=f"has no 0x{missing[0]:04X}"):
            set_homing(drive, RIG, MOVING)


def test_the_drives_window_is_twice_the_rigs_following_error():
    drive = Stored((0x6065, 0))
    assert set_window(drive, DRIVE, RIG) == []
    counts = 4e-3 * 77824 / 0.06283185307
    assert drive.numbers[0x6065, 0] == round(2.0 * counts)
    assert "does not tell" in set_window(Stored(), DRIVE, RIG)[0]
    narrow = given(DRIVE, "0x6065:00", "u32", 2000)
    assert "faults by itself at 2000 counts" in set_window(drive, narrow, RIG)[0]
    assert set_window(drive, given(DRIVE, "0x6065:00", "u32", 5000), RIG) == []
    free = RIG.motor.model_copy(update={"following_error": None})
    drive.numbers[0x6065, 0] = 7
    assert set_window(drive, DRIVE, RIG.model_copy(update={"motor": free})) == []
    assert drive.numbers[0x6065, 0] == 7


def test_the_zero_of_the_rig_file_becomes_homing_objects():
    zero = Zero.model_validate({"method": "here", "at": "-3 mm"})
    rig = RIG.model_copy(update={"motor": RIG.motor.model_copy(update={"zero": zero})})
    drive = Stored((0x6098, 0), (0x30B0, 0))
    assert set_homing(drive, rig) == []
    home = round(-3e-3 * 77824 / 0.06283185307)
    assert drive.numbers == {(0x6098, 0): 37, (0x30B0, 0): (1 << 32) + home}
    assert "has no 0x6098, 0x30B0" in set_homing(Stored(), rig)[0]


@pytest.mark.parametrize(
    ("chosen", "enabled", "choice", "words"),
    [
        ("off", 0, 7, "filter off"),
        ("50 Hz", 1, 0, "on (50 Hz): its values lag by 10.0 ms"),
        ("IIR 1", 1, 2, "on (IIR 1): its values lag by 0.4 ms"),
        ("IIR 8", 1, 9, "on (IIR 8): its values lag by 53.1 ms"),
    ],
)
def test_the_filter_is_set_and_its_lag_said(chosen, enabled, choice, words):
    terminal = Stored((0x8000, 0x06), (0x8000, 0x15))
    terminal.numbers[0x8000, 0x15] = 7
    notes = set_filter(terminal, ANALOG_IN.model_copy(update={"filter": chosen}))
    assert terminal.numbers == {(0x8000, 0x06): enabled, (0x8000, 0x15): choice}
    assert len(notes) == 1 and words in notes[0]


def test_a_filter_that_startup_sets_stays_and_its_lag_is_said_too():
    terminal = Stored((0x8000, 0x06), (0x8000, 0x15))
    terminal.numbers[0x8000, 0x06] = 1
    notes = set_filter(terminal, given(ANALOG_IN, "0x8000:06", "u8", 1))
    assert terminal.numbers[0x8000, 0x06] == 1 and "on (50 Hz)" in notes[0]
    terminal.numbers[0x8000, 0x15] = 12
    assert "lag is not known" in set_filter(terminal, given(ANALOG_IN, "0x8000:06", "u8", 1))[0]
    assert "does not tell its filter" in set_filter(Stored(), ANALOG_IN)[0]
    assert "does not tell" in set_filter(Stored(), given(ANALOG_IN, "0x8000:06", "u8", 1))[0]
    assert set_filter(Stored(), DRIVE) == []
    assert lag_s(None) == 0.0


def slave_of(text: str) -> Slave:
    return validate(parse_yaml(text, "slave.yaml"), Slave, {})


def test_a_filter_is_written_as_yaml_reads_it_and_only_at_an_analog_input():
    assert slave_of("{name: a, device: EL3004, filter: off}").filter == "off"
    assert slave_of("{name: a, device: EL3004, filter: IIR 3}").filter == "IIR 3"
    for text in (
        "{name: a, device: EL3004, filter: 55 Hz}",
        "{name: a, device: EPOS4, filter: 50 Hz}",
    ):
        with pytest.raises(ConfigError):
            slave_of(text)


@pytest.mark.parametrize("name", ["bench", "bench_analog", "knee", "knee_geared", "mass"])
def test_no_rig_file_sets_a_reaction_itself(name):
    rig: Rig = load_rig(f"config/rigs/{name}.yaml")
    assert not {sdo.place[0] for slave in rig.slaves for sdo in slave.startup} & WRITTEN.keys()


@pytest.mark.network
@pytest.mark.timeout(900)
def test_on_the_bus_they_stand_in_the_slaves_before_the_first_output():
    result = bus_case("reactions_written", zero_at="2 mm")
    assert result["drive"] == {f"0x{index:04X}": value for index, value in WRITTEN.items()} | {
        "0x6065": 9909
    }
    assert result["filter"] == 0
    assert sum("holds under power" in text for text in result["events"]) == 1
    assert sum("filter off" in text for text in result["events"]) == 1


@pytest.mark.network
@pytest.mark.timeout(900)
def test_on_the_bus_voltage_off_in_startup_gets_no_output():
    result = bus_case("refused", change="startup", slave="drive", index=0x6007, value=0)
    assert (
        "found 0x6007 = 0 in the rig file's startup of drive (slave 5, EPOS4)"
        in (result["sentence"])
    )
    assert result["process_frames"] == 0 and not any(bytes.fromhex(result["outputs"]))

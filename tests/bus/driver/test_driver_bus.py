"""The driver in front of the emulated bus: what reaches OP, what is refused and how it is said,
what ends a run.
"""

import pytest

from tests.bus.own_network import REAL_TIME, call

OP, INIT = 8, 1

pytestmark = [pytest.mark.network, pytest.mark.timeout(900)]


def bus_case(name: str, **arguments: object) -> dict:
    """A case of cases.py, where it has a bus."""
    return call(f"tests.bus.driver.cases:{name}", **arguments)


SAID = "drive (slave 5, EPOS4)"
DRIVE_TELLS = (
    f"{SAID}: emergency 0x8180 EtherCAT communication error, error register 0x01 (generic)"
)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"change": "nothing"}, "found no slave on ve0, expected 5"),
        (
            {"change": "missing", "slave": "analog_in"},
            "expected analog_in (slave 3, EL3004): it is missing",
        ),
        ({"change": "missing", "slave": "drive"}, "expected drive (slave 5, EPOS4): it is missing"),
        (
            {"change": "swapped"},
            "found EL4034 as slave 3, expected analog_in (slave 3, EL3004): slaves are swapped",
        ),
        ({"change": "extra"}, "found EL2124 as slave 3, expected none there: it is extra"),
        (
            {"change": "revision", "slave": "analog_in", "value": 0x00170000},
            "found revision 0x00170000, expected 0x00100000 to 0x00160000 at analog_in",
        ),
    ],
)
def test_another_bus_is_named_and_gets_no_output(change, words):
    result = bus_case("refused", **change)
    assert words in result["sentence"] and "\n" not in result["sentence"]
    assert result["process_frames"] == 0 and not any(bytes.fromhex(result["outputs"]))


@pytest.mark.parametrize(
    ("change", "index", "subindex", "value", "size", "words"),
    [
        (
            "read_only",
            0x60C2,
            1,
            0,
            1,
            (
                f"object 0x60C2:01 of {SAID} could not be set to 0x01: 0x06010002 attempt to write"
                " a read-only object"
            ),
        ),
        (
            "read_only",
            0x1600,
            0,
            0,
            1,
            f"object 0x1600:00 of {SAID} could not be set to 0x00: 0x06010002",
        ),
        ("object", 0x60A9, 0, 0xFDB44700, 4, f"found the speed unit 0xFDB44700 (0x60A9) in {SAID}"),
        (
            "object",
            0x6076,
            0,
            200_000,
            4,
            f"found a rated torque of 200 mNm (0x6076) in {SAID}, expected the rig file's 170 mNm",
        ),
        ("object", 0x6076, 0, 0, 4, "its motor data have not been set"),
        ("object", 0x3001, 1, 5_000, 4, "found the nominal current 5 A (0x3001:01)"),
        ("object", 0x3001, 2, 20_000, 4, "found the output current limit 20 A (0x3001:02)"),
        (
            "object",
            0x3000,
            5,
            8192,
            4,
            (
                f"found 8192 encoder counts per turn (0x3000:05) in {SAID}, expected the rig file's"
                " 4096"
            ),
        ),
    ],
)
def test_a_drive_that_differs_is_named_and_gets_no_output(
    change, index, subindex, value, size, words
):
    result = bus_case(
        "refused",
        change=change,
        slave="drive",
        index=index,
        subindex=subindex,
        value=value,
        size=size,
    )
    assert words in result["sentence"] and "\n" not in result["sentence"]
    assert result["process_frames"] == 0 and not any(bytes.fromhex(result["outputs"]))


@pytest.mark.parametrize(
    ("slave", "index", "subindex", "value", "words"),
    [
        (
            "analog_out",
            0x1600,
            1,
            0x70101020,
            (
                "found 0x70101020 in 0x1600 of analog_out (slave 4, EL4034), expected one value of"
                " 16 bits"
            ),
        ),
        (
            "analog_in",
            0x1A00,
            6,
            0x00000006,
            (
                "found the toggle bit of analog_in (slave 3, EL3004) at bit 14 of channel 1's"
                " status, expected bit 15"
            ),
        ),
        (
            "analog_in",
            0x1A02,
            9,
            0x60110110,
            "found no entry 0x60101110 in 0x1A02 of analog_in (slave 3, EL3004)",
        ),
    ],
)
def test_a_wrong_mapping_is_named_and_gets_no_output(slave, index, subindex, value, words):
    result = bus_case(
        "refused", change="object", slave=slave, index=index, subindex=subindex, value=value
    )
    assert words in result["sentence"]
    assert result["process_frames"] == 0


def test_a_start_up_object_arrives():
    assert bus_case("start_up_object", value=3) == {"sentence": "", "there": 3}


def test_a_start_up_object_that_is_refused_is_named():
    result = bus_case("start_up_object", value=77)
    assert (
        result["sentence"]
        == "object 0x8000:15 of analog_in (slave 3, EL3004) could not be set to 0x004D: 0x06090031"
        " value too large"
    )


def test_watchdogs_cycle_time_and_sync0_stand_in_the_slaves():
    result = bus_case("registers", watchdog_s=0.05)
    assert result["divider"] == [2498] * 3 and result["watchdog"] == [500] * 3
    assert (
        result["triggers"] == [0x44, 0x64, 0x64] and result["active"] == [1] * 3
    )  # an EL4034's SII has 0x24
    assert (
        result["interpolation"] == [1, 0xFD]
        and result["sync"] == 3
        and result["sync0_ns"] == 1_000_000
    )
    assert result["sync_after"] == 0


def test_two_digital_terminals_side_by_side_keep_their_bits_apart():
    result = bus_case("two_alike")
    assert result["wrong"] == []
    assert result["expected"] == result["actual"] == 10


def test_images_of_the_wrong_size_are_refused():
    result = bus_case("wrong_images")
    assert result["fine"] and len(result["sentences"]) == 3
    assert "found 0 bytes" in result["sentences"][0] and "closed backend" in result["sentences"][2]


@pytest.mark.parametrize(
    ("rig", "experiment", "cycles"),
    [
        pytest.param("bench", "identification", 61_000, marks=pytest.mark.slow),
        ("bench", "identification_short", 15_000),
        ("bench_analog", "identification_short", 15_000),
        ("mass", "mass_sine", 15_000),
        ("knee", "knee_chirp_short", 15_000),
    ],
)
def test_lock_step_gives_the_simulations_image_byte_for_byte(rig, experiment, cycles):
    result = bus_case("lock_step", rig=rig, experiment=experiment, cycles=cycles)
    assert result["differs"] is None and result["cycles"][0] == result["cycles"][1] >= cycles
    assert result["outcomes"][0] == result["outcomes"][1] and result["confirmed"]


@pytest.mark.parametrize(
    ("rig", "experiment", "period_ms", "cycles"),
    [
        ("bench", "identification_short", 2.0, 4000),
        ("bench_analog", "identification_short", 0.5, 8000),
        ("knee", "knee_chirp_short", 0.25, 8000),
    ],
)
def test_lock_step_gives_the_simulations_image_at_any_period(rig, experiment, period_ms, cycles):
    result = bus_case(
        "lock_step", rig=rig, experiment=experiment, cycles=cycles, period_ms=period_ms
    )
    assert result["differs"] is None and result["cycles"][0] == result["cycles"][1] >= cycles
    assert result["outcomes"] == ["stopped", "stopped"] and result["confirmed"], result["cause"]


@REAL_TIME
@pytest.mark.parametrize(
    ("rig", "loop"),
    [
        ("bench", "motor_position"),
        ("knee", "motor_speed"),
        pytest.param("bench", "motor_speed", marks=pytest.mark.slow),
        pytest.param("bench_analog", "motor_speed", marks=pytest.mark.slow),
        pytest.param("mass", "motor_speed", marks=pytest.mark.slow),
    ],
)
def test_reaches_op_twice_and_runs_an_experiment_in_real_time(rig, loop):
    result = bus_case("runs", rig=rig, loop=loop)
    opened = result["opened"]
    assert set(opened["states"].values()) == {OP} and opened["drive_off"] is not False
    assert opened["expected"] == opened["actual"] and opened["ok"] == opened["of"]
    assert any(text.startswith("locked to the reference clock") for text in opened["events"])
    assert (result["outcome"], result["cause"]) == ("completed", "")
    assert result["confirmed"] and result["drive_off"]
    assert not any(bytes.fromhex(result["outputs_after"])) and set(
        result["states_after"].values()
    ) == {INIT}
    if result["jump"] is not None:
        assert abs(result["jump"]) <= 2  # the motor stands; its encoder may flicker


def test_a_terminal_that_falls_to_safeop_is_named():
    result = bus_case("troubled", trouble="fall", slave="analog_in")
    assert result["outcome"] == "failed"
    assert (
        result["cause"] == "analog_in (slave 3, EL3004) left OP: it is in SAFEOP with error "
        "(0x001B sync manager watchdog: process data stayed away)"
    )
    assert (
        result["cycles"] <= 1511
        and result["drive_off"]
        and not any(bytes.fromhex(result["outputs_after"]))
    )


@pytest.mark.parametrize("real_time", [False, pytest.param(True, marks=REAL_TIME)])
def test_a_terminal_that_falls_is_taken_back_where_the_rig_says_so(real_time):
    result = bus_case(
        "troubled", trouble="fall", slave="analog_in", recovery="continue", real_time=real_time
    )
    assert (result["outcome"], result["cause"]) == ("completed", "")
    told = [text for kind, text in result["events"] if kind == "recovery"]
    assert len(told) == 2 and told[-1] == "analog_in (slave 3, EL3004) is in OP again"


@pytest.mark.parametrize("slave", ["valves", "analog_out"])
def test_a_terminal_whose_supply_came_back_is_taken_back(slave):
    result = bus_case(
        "troubled", trouble="power_cycle", slave=slave, recovery="continue", lost_cycles=1000
    )
    assert (result["outcome"], result["cause"]) == ("completed", "")
    assert result["bad"] and result["events"][-1][1].endswith("is in OP again")
    assert result["triggers"] == [0x44, 0x64, 0x64]


def test_a_slave_that_disappears_is_named():
    result = bus_case("troubled", trouble="unplug", slave="valves")
    assert result["outcome"] == "failed" and result["cause"].startswith(
        "valves (slave 2, EL2124) does not answer any more: its supply, or "
    )
    assert result["cycles"] <= 1504
    assert result["drive_off"] is True  # the drive still answers, and was asked


@pytest.mark.parametrize("trouble", ["fall", "power_cycle"])
def test_a_drive_is_never_taken_back_within_a_run_but_starts_anew(trouble):
    result = bus_case(
        "troubled",
        trouble=trouble,
        slave="drive",
        recovery="continue",
        lost_cycles=1000,
        code=0x002C,
    )
    assert (
        result["outcome"] == "failed" and "drive (slave 5, EPOS4) " in result["cause"]
    )  # behind what its status word told
    assert result["cause"].endswith(
        "a drive is not taken back within a run, it has to be enabled from scratch"
    )
    if trouble == "power_cycle":
        assert result["again"] == "stopped"
    else:
        assert ["emergency", DRIVE_TELLS] in result["events"]


@pytest.mark.parametrize("slave", ["valves", "analog_out"])
def test_a_terminal_that_enables_or_steers_a_wired_drive_is_never_taken_back(slave):
    result = bus_case(
        "troubled", trouble="fall", slave=slave, recovery="continue", rig="bench_analog"
    )
    assert result["outcome"] == "failed" and result["cause"].endswith(
        "a drive, whose enable or target comes from there, is not taken back within a run, it has"
        " to be enabled from scratch"
    )
    assert not any(bytes.fromhex(result["outputs_after"])) and not result["enabled_after"]


def test_one_lost_frame_is_one_bad_cycle():
    result = bus_case("troubled", trouble="lose", code=1)
    assert result["outcome"] == "completed" and 1506 in result["bad"]


def test_frames_that_stay_away_end_the_run():
    result = bus_case("troubled", trouble="lose", code=1_000_000)
    assert result["outcome"] == "failed" and result["drive_off"] is None
    assert (
        result["cause"]
        == "no frame came back from ve0 in 3 cycles in a row: its cable, its link, or the supply of"
        " coupler"
    )


@REAL_TIME
@pytest.mark.parametrize("drift_ppm", [50.0, -50.0])
def test_follows_a_drifting_reference_clock_from_500_us_off(drift_ppm):
    result = bus_case("follows", drift_ppm=drift_ppm, off_ns=500_000, cycles=3000)
    true = result["true"]
    assert max(map(abs, true[:10])) > 300_000 and result["locked"]
    # the frame is what is locked; its edge stands a constant way before it
    mean = sum(true[1500:]) / len(true[1500:])
    assert abs(mean) < 200_000
    assert (sum((t - mean) ** 2 for t in true[1500:]) / len(true[1500:])) ** 0.5 < 20_000


def test_scan_of_the_rigs_own_bus():
    result = bus_case("scanned", change="")
    assert (
        result["code"] == 0
        and "the bus is as the rig bench says" in result["out"]
        and not result["err"]
    )
    assert result["process_frames"] == 0 and set(result["states"].values()) == {INIT}


def test_scan_of_a_bus_with_a_slave_missing():
    result = bus_case("scanned", change="missing")
    assert result["code"] == 1
    assert (
        "differs: found no EL3004 behind valves, expected analog_in (slave 3, EL3004): it is"
        " missing" in result["out"]
    )


def test_two_of_three_frames_lost_trip_within_the_reaction_time():
    """Until it has tripped, for each is waited for. For good, with a wrong working counter instead:
    tests/bus/faults/test_moments.py.
    """
    result = bus_case("troubled", trouble="lose_two_of_three", at=1500, code=60, lost_s=0.02)
    assert result["outcome"] == "tripped" and "more than 10 % of the time" in result["cause"]
    before = [cycle for cycle in result["bad"] if cycle <= result["tripped_at"]]
    assert before[0] > 1500 and before[-1] - before[0] <= 20 and len(before) < 15

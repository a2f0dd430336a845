"""Each trip, its cause, its signal, its sentence, its cycle."""

import math

import pytest
from safety_bench import NAMES, Bench, edited, rig

from epa_rt.loop.referenced import position_scaling
from epa_rt.safety.trip import Trip

CAUSES = {
    "_pa": "over-pressure",
    "_nm": "over-torque",
    "_n": "over-force",
    "_rad_s": "over-speed",
    "_m_s": "over-speed",
    "_rad": "over-travel",
    "_m": "over-travel",
    "_a": "over-current",
}
WATCHED = [(name, row.name) for name in NAMES for row in rig(name).inputs if row.limits]


def cause_of(name: str) -> str:
    return next(cause for suffix, cause in CAUSES.items() if name.endswith(suffix))


@pytest.mark.parametrize(("name", "row_name"), WATCHED)
def test_each_limit_trips_on_either_side_and_not_at_its_end(name, row_name):
    low, high = rig(name).row(row_name).limits
    if row_name == rig(name).motor.position:  # a whole count, the nearest to the limit
        half = 0.5 * abs(position_scaling(rig(name)).slope)
        assert 0.0 < half < 5e-6
        low, high = low - half, high + half
    for value, trips in (
        (low, False),
        (high, False),
        (math.nextafter(low, -math.inf), True),
        (math.nextafter(high, math.inf), True),
    ):
        bench = Bench(name)
        bench.check(
            {row_name: min(max(value, low), high)}
        )  # already there: a motor that jumps is another trip
        out = bench.check({row_name: value})
        assert (bench.trip is not None) == trips
        if trips:
            assert out == bench.safe
            assert bench.trip[:2] == (cause_of(row_name), row_name) and bench.trip.cycle == 1


def test_the_sentence_of_a_limit_has_value_unit_and_limits():
    bench = Bench()
    bench.check({"muscle_force_n": 360.25})
    assert str(bench.trip) == "over-force: muscle_force_n = 360.25 N, outside -40 to 350 N"
    bench = Bench(
        edited(
            "bench",
            (
                "  - {name: drive_status_raw,",
                (
                    "  - {name: spare_v, entry: analog_in.ch3, limits: [-4 V, 4 V]}\n  - {name:"
                    " drive_status_raw,"
                ),
            ),
        )
    )
    bench.check({"spare_v": -4.5})
    assert str(bench.trip) == "out of limits: spare_v = -4.5 V, outside -4 to 4 V"
    bench = Bench(
        edited(
            "bench",
            (
                "  - {name: drive_status_raw,",
                (
                    "  - {name: spare_ratio, entry: analog_in.ch3, limits: [-1, 1]}\n  - {name:"
                    " drive_status_raw,"
                ),
            ),
        )
    )
    bench.check({"spare_ratio": 2.0})
    assert str(bench.trip) == "out of limits: spare_ratio = 2, outside -1 to 1"


def test_torque_and_turning_speed_have_words_of_their_own():
    spare = (
        "  - {name: drive_status_raw,",
        (
            "  - {name: spare_rad_s, entry: analog_in.ch3, limits: [-1 rad/s, 1 rad/s],"
            " calibration: {native: [0 V, 1 V], value: [0 rad/s, 1 rad/s]}}\n  - {name:"
            " drive_status_raw,"
        ),
    )
    torque = (
        "value: [0 mNm, 170 mNm]}\n  - name: motor_current_a",
        "value: [0 mNm, 170 mNm]}\n    limits: [-100 mNm, 100 mNm]\n  - name: motor_current_a",
    )
    for row, value, said in (
        (
            "spare_rad_s",
            2.0,
            "over-speed: spare_rad_s = 114.592 deg/s, outside -57.2958 to 57.2958 deg/s",
        ),
        (
            "motor_torque_nm",
            0.15,
            "over-torque: motor_torque_nm = 0.15 N*m, outside -0.1 to 0.1 N*m",
        ),
    ):
        bench = Bench(edited("bench", spare, torque))
        bench.check({row: value})
        assert str(bench.trip) == said


def test_nan_of_a_row_without_limits_trips_too():
    assert rig("bench").row("motor_torque_nm").limits is None
    bench = Bench()
    bench.check({"motor_torque_nm": 1e30})
    assert bench.trip is None
    bench.check({"motor_torque_nm": math.nan})
    assert bench.trip == Trip("NaN", "motor_torque_nm", "motor_torque_nm is not a number", 1)


@pytest.mark.parametrize(
    ("mask", "row"), [(0b1, 0), (0b10, 1), (0b110, 1), (1 << 8, 8), (0b1000_0100, 2)]
)
def test_invalid_and_stale_name_the_first_row(mask, row):
    name = rig("bench").inputs[row].name
    bench = Bench()
    bench.check(invalid=mask)
    assert bench.trip == Trip("invalid sensor", name, f"{name} says row {row}", 0)
    bench = Bench()
    bench.check(stale=mask)
    assert bench.trip == Trip("stale", name, f"{name} has not been renewed", 0)
    bench = Bench()
    bench.check(stale=1, invalid=2)
    assert bench.trip.cause == "invalid sensor"  # the worse of the two


def test_a_wrong_working_counter_trips_after_so_many_in_a_row():
    bench = Bench()
    for ok in (False, False, True, False, False):
        assert bench.check(bus_ok=ok) == bench.gate.outputs and bench.trip is None
    assert bench.check(bus_ok=False) == bench.safe
    assert bench.trip == Trip(
        "lost working counter", "", "the working counter was wrong in 3 cycles in a row", 5
    )


def test_one_lost_cycle_allowed_is_one():
    bench = Bench(edited("bench", ("lost_cycles: 3", "lost_cycles: 1")))
    bench.check(bus_ok=False)
    assert bench.trip.text == "the working counter was wrong in 1 cycles in a row"


def test_the_first_of_several_causes_is_kept():
    bench = Bench(edited("bench", ("lost_cycles: 3", "lost_cycles: 1")))
    bench.check(
        {"muscle_force_n": 999.0}, {"cmd_drive_control_raw": 99}, bus_ok=False, invalid=1, stale=1
    )
    assert bench.trip.cause == "lost working counter"
    bench.check(invalid=1)
    assert bench.trip.cause == "lost working counter" and bench.trip.cycle == 0


def test_a_trip_from_above_latches_with_its_cycle():
    bench = Bench()
    bench.envelope.trip("recorder", "", "the disk is full", 41)
    assert bench.check() == bench.safe and bench.trip == Trip(
        "recorder", "", "the disk is full", 41
    )
    assert str(bench.trip) == "recorder: the disk is full"


def test_status_words_have_no_limits():
    bench = Bench()
    bench.check({"drive_status_raw": 0xFFFF, "drive_error_raw": 0x8611})
    assert bench.trip is None


def test_a_motor_that_jumps_or_cannot_be_believed_has_lost_its_place():
    position = 1 << [row.name for row in rig("bench").inputs].index("motor_travel_m")
    for case, is_lost in (
        ({"measured": {"motor_travel_m": 0.02}}, True),
        ({"invalid": position}, True),
        ({"stale": position}, True),
        ({"measured": {"muscle_force_n": 400.0}}, False),
        ({"invalid": 2 if position != 2 else 1}, False),
    ):
        bench = Bench()
        bench.check()
        assert not bench.envelope.position_lost
        bench.check(**case)
        assert bench.trip is not None and bench.envelope.position_lost is is_lost
    bench.check({"motor_travel_m": 0.02})  # at rest after another trip
    assert bench.envelope.position_lost
    bench.check()
    assert bench.envelope.position_lost

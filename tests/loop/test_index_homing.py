"""The drive seeks its index pulse by itself, and whatever happens ends at rest: judged by the rig.

Travel, speed, force and power are the plant's own, not what the sensors say.
"""

import math

import pytest

from epa_rt.backend import BackendError, Exchange
from epa_rt.config.rig import Zero
from epa_rt.config.rig_homing import homing_by_index, index_way
from epa_rt.loop.by_hand import assemble_index
from epa_rt.loop.rest import REST_SHARE
from epa_rt.loop.run import RunResult, run
from epa_rt.safety.index_guard import IndexGuard
from sim_backend.backend import SimBackend
from sim_backend.drive_machine import ATTAINED, HOMING_MODE, RETURNING, SEEKING
from sim_backend.drive_motion import INDEX_PHASE_TURNS
from tests.faults.moments import row_of
from tests.loop.one_rig import OneRig
from tests.loop.rigging import Between, Memory, Quiet

INDEX = Zero(
    method="index",
    at="10.27 mm",
    direction="decreasing",
    speed="4 mm/s",
    current="1 A",
    force="20 N",
)
START_HOMING, SPEED_MODE = 0x1F, 9
MOVING = 600  # a cycle in which the drive seeks at full speed, half way to its pulse
STOPPING_M = 0.0001  # 10 ms at 4 mm/s, and the ramp


class IndexRig(OneRig):
    """A rig that homes on its index; what the plant went through is kept, cycle by cycle."""

    def __init__(self, folder, name: str = "bench", **zero):
        super().__init__(folder, name, "motor_speed" if name == "bench" else "motor_position")
        motor = self.rig.motor.model_copy(update={"zero": INDEX.model_copy(update=zero)})
        self.rig = self.rig.model_copy(update={"motor": motor})
        self.way = index_way(self.rig)
        self.start_m = self.travel_m
        self.travels: list[float] = []
        self.speeds: list[float] = []
        self.powered: list[bool] = []
        self._inner, self.model.cycle = self.model.cycle, self._traced

    def _traced(self, outputs_raw: bytes) -> bytes:
        before = self.travel_m
        inputs = self._inner(outputs_raw)
        self.travels.append(self.travel_m - self.start_m)
        self.speeds.append((self.travel_m - before) / self.rig.period_s)
        self.powered.append(bool(self.model.command["enabled"][0] > 0.5))
        return inputs

    def answer(self, changed) -> None:
        """``changed(inputs, cycle)`` is what the master gets in place of the drive's inputs."""
        inner = self.model.cycle

        def cycle(outputs_raw: bytes) -> bytes:
            inputs = bytearray(inner(outputs_raw))
            changed(inputs, len(self.travels))
            return bytes(inputs)

        self.model.cycle = cycle

    @property
    def furthest_m(self) -> float:
        return max(map(abs, self.travels))

    @property
    def fastest_m_s(self) -> float:
        return max(map(abs, self.speeds))

    @property
    def machine(self):
        return self.model.machine[0]

    def ended_at_rest(self, result: RunResult) -> bool:
        """By the plant: the motor stands, without power, vented, the drive not homing and out of
        its homing mode.
        """
        pressure = row_of(self.model, 1).pressure_pa[0] - self.rig.atmosphere_pa
        return bool(
            abs(self.speeds[-1]) < 1e-4
            and not self.powered[-1]
            and pressure < 8e3
            and self.machine["homing"] not in (SEEKING, RETURNING)
            and self.machine["mode"] == SPEED_MODE
            and result.end.off
            and result.end.at_rest
            and result.end.vented
        )


def words(one: OneRig) -> set[int]:
    return {int(sample[8]["cmd_drive_control_raw"]) for sample in one.memory.samples}


def was_moving(one: IndexRig, cycle: int = MOVING) -> bool:
    return one.powered[cycle] and abs(one.speeds[cycle]) > 0.8 * one.way.speed


@pytest.mark.parametrize(("direction", "way"), [("increasing", 1.0), ("decreasing", -1.0)])
def test_the_zero_is_set_at_the_index_pulse(tmp_path, direction, way):
    one = IndexRig(tmp_path, direction=direction)
    one.model.lose_drive_supply()
    result, found = one.seek_index()
    assert result.outcome == "completed", result.cause
    assert not found.was_referenced and one.machine["is_referenced"]
    assert one.measured("motor_travel_m")[-1] == pytest.approx(10.27e-3, abs=1e-5)
    turns = one.model.sensors["motor_angle_rad"][0] / (2.0 * math.pi)
    assert math.remainder(turns - INDEX_PHASE_TURNS, 1.0) == pytest.approx(0.0, abs=3e-3)
    moved = way * one.travels[-1]
    assert 0.0 < moved < one.way.turn and one.furthest_m < moved + one.way.landing
    assert one.fastest_m_s < 1.1 * one.way.speed
    assert found.after - found.before == pytest.approx(10.27e-3 - one.travels[-1], abs=2e-5)
    assert one.ended_at_rest(result)
    modes = {sample[8]["cmd_drive_mode_raw"] for sample in one.memory.samples}
    assert START_HOMING in words(one) and modes <= {0, HOMING_MODE}


def test_a_rig_that_had_a_zero_is_homed_to_the_same_pulse_without_a_jump(tmp_path):
    one = IndexRig(tmp_path, at=-2.3149e-3)  # where its pulse is by the count that it has
    result, found = one.seek_index()
    assert result.outcome == "completed", result.cause
    assert found.was_referenced and found.after == pytest.approx(found.before, abs=5e-5)
    assert one.ended_at_rest(result)


def test_an_index_that_never_comes_ends_within_a_motor_turn_and_a_margin(tmp_path):
    one = IndexRig(tmp_path)
    one.model._drive["has_index"] = 0
    result, _ = one.seek_index()
    assert result.outcome == "tripped" and "no index pulse within 3.98" in result.cause
    assert result.category.startswith("stop category 1")
    assert one.way.most <= one.furthest_m < one.way.most + STOPPING_M
    assert one.fastest_m_s < 1.1 * one.way.speed
    assert one.ended_at_rest(result) and not one.machine["is_referenced"]


def test_a_distance_in_the_rig_file_ends_it_sooner(tmp_path):
    one = IndexRig(tmp_path, distance_max=1e-3)
    result, _ = one.seek_index()
    assert result.outcome == "tripped" and "no index pulse within 1 mm" in result.cause
    assert one.furthest_m < 1e-3 + STOPPING_M and one.ended_at_rest(result)


@pytest.mark.parametrize(
    ("requests", "outcome"), [(Quiet(MOVING), "stopped"), (Quiet(MOVING, MOVING + 5), "tripped")]
)
def test_the_operator_stops_it_under_way(tmp_path, requests, outcome):
    one = IndexRig(tmp_path)
    result, _ = one.seek_index(requests)
    assert result.outcome == outcome, result.cause
    assert was_moving(one)
    assert abs(one.travels[-1] - one.travels[MOVING]) < 2.0 * STOPPING_M
    assert one.ended_at_rest(result) and not one.machine["is_referenced"]


def test_a_stop_while_the_muscles_vent_starts_nothing(tmp_path):
    one = IndexRig(tmp_path)
    result, _ = one.seek_index(Quiet(200))
    assert result.outcome == "stopped" and START_HOMING not in words(one)
    assert one.furthest_m < 1e-5 and one.ended_at_rest(result)


@pytest.mark.parametrize(("kind", "code"), [("drive_fault", 0x8611), ("drive_fault", 0x2310)])
def test_a_fault_of_the_drive_under_way(tmp_path, kind, code):
    one = IndexRig(tmp_path)
    one.break_it(kind, at_cycle=MOVING, value=code)
    result, _ = one.seek_index()
    assert result.outcome == "tripped" and result.trip.cause == "drive"
    assert was_moving(one, MOVING - 1)
    assert abs(one.travels[-1] - one.travels[MOVING]) < 2.0 * STOPPING_M
    assert one.ended_at_rest(result)


def test_a_bus_that_is_lost_under_way_leaves_a_drive_that_brakes_and_holds(tmp_path):
    one = IndexRig(tmp_path)
    assembly, _ = assemble_index(one.rig)

    def cut(exchange: Exchange, model) -> Exchange:
        if len(one.travels) >= MOVING:
            raise BackendError("found no frame, expected one")
        return exchange

    inner = SimBackend(one.rig, one.inputs.plant, model=one.model, homing=assembly.homing)
    inner.close = lambda: None  # nothing reaches the drive any more
    a = assembly
    result = run(
        one.rig, Between(inner, cut), a.supervisor, a.envelope, a.decoder, a.encoder,
        Memory(), Quiet(),
    )  # fmt: skip
    assert result.outcome == "failed" and was_moving(one, MOVING - 1)
    sent = bytes(one.model._outputs)
    one.machine["is_alone"] = 1
    for _ in range(100):  # until the watchdog: the drive goes on with what it was told
        one.model.cycle(sent)
    one.model.lose_drive_master()
    for _ in range(400):
        one.model.cycle(sent)
    assert abs(one.travels[-1] - one.travels[MOVING - 1]) < 0.1 * one.way.speed + STOPPING_M
    assert abs(one.speeds[-1]) < 1e-4 and one.powered[-1]  # it holds, and does not home
    assert one.machine["homing"] not in (SEEKING, RETURNING)


def test_something_in_the_way_is_found_by_the_current(tmp_path):
    one = IndexRig(tmp_path, direction="increasing")
    one.stop_at(0.5e-3 * 19 / 0.010)
    result, _ = one.seek_index()
    assert result.trip.cause == "over-current" and "something is in the way" in result.cause
    assert one.furthest_m < 0.51e-3 and max(map(abs, one.measured("motor_current_a"))) < 2.0
    assert one.ended_at_rest(result)


def test_a_strap_that_takes_up_its_load_is_found_by_the_force(tmp_path):
    """13 kg hang on the mass rig's muscle: what is let go at the end is little."""
    one = IndexRig(tmp_path, "mass", direction="increasing", at=-28e-3, current=9.0)
    one.model._drive["has_index"] = 0
    result, _ = one.seek_index()
    assert result.trip.cause == "over-force" and "more than 20 N" in result.cause, result.cause
    assert max(one.measured("muscle_force_n")) < 25.0 and one.furthest_m < 2.7e-3
    assert one.fastest_m_s < 0.05 and min(one.travels) > -1e-3
    assert result.end.at_rest and result.end.off and not one.powered[-1]
    at_rest = REST_SHARE * one.rig.motor.speed_max  # by which this fast rig tells that it stands
    assert one.machine["mode"] == SPEED_MODE and abs(one.speeds[-1]) < at_rest


def test_a_drive_that_homes_too_fast_is_stopped(tmp_path):
    one = IndexRig(tmp_path)
    inner = one.model.set_homing

    def too_fast(options) -> None:
        inner(options)
        one.model._drive["homing_speed_rad_s"] *= 20.0
        one.model._drive["homing_rad_s2"] *= 20.0

    one.model.set_homing = too_fast
    result, _ = one.seek_index()
    assert result.trip.cause == "over-speed", result.cause
    assert one.fastest_m_s < 4.0 * one.way.speed and one.ended_at_rest(result)


def test_a_drive_that_goes_the_other_way_is_stopped(tmp_path):
    one = IndexRig(tmp_path)
    inner = one.model.set_homing
    one.model.set_homing = lambda options: inner(options and options._replace(method=34))
    one.model._drive["has_index"] = 0
    result, _ = one.seek_index()
    assert "against motor.zero.direction" in result.cause
    assert one.furthest_m < one.way.landing + STOPPING_M and one.ended_at_rest(result)


def status_place(one: IndexRig) -> int:
    return int(one.model._drive["status_byte"][0]) + 1


@pytest.mark.parametrize(
    ("kept", "added", "sentence"),
    [
        (0xFF, 0x20, "the drive reports a homing error (status word bit 13)"),
        (0xEF, 0x00, "the drive has not attained its index pulse"),  # bit 12 never comes
        (0xFF, 0x10, "the drive has not attained its index pulse"),  # nor goes: it is of before
        (0xFB, 0x00, "the drive has not attained its index pulse"),  # bit 10 never comes
        (0x7F, 0x00, "does not call itself referenced"),
    ],
)
def test_the_status_bits_decide(tmp_path, kept, added, sentence):
    one = IndexRig(tmp_path)
    place = status_place(one)

    def otherwise(inputs: bytearray, cycle: int) -> None:
        inputs[place] = inputs[place] & kept | added

    one.answer(otherwise)
    result, _ = one.seek_index()
    assert result.outcome == "tripped" and sentence in result.cause, result.cause
    assert one.furthest_m < one.way.most + one.way.landing and one.ended_at_rest(result)


@pytest.mark.parametrize(("cycles", "outcome"), [(20, "completed"), (100, "tripped")])
def test_bits_that_come_before_the_count(tmp_path, cycles, outcome):
    """A drive that says it is home and shows the old count for so long."""
    one = IndexRig(tmp_path)
    place, home_since, offset = int(one.model._drive["position_byte"][0]), [], [0]

    def otherwise(inputs: bytearray, cycle: int) -> None:
        if one.machine["homing"] == ATTAINED:
            home_since.append(cycle)
        if len(home_since) < cycles:  # the offset was 0 before
            count = int.from_bytes(inputs[place : place + 4], "little", signed=True)
            old = count - offset[-1]  # what was sampled, was so before the drive set it
            inputs[place : place + 4] = old.to_bytes(4, "little", signed=True)
        offset.append(int(one.machine["offset_counts"]))

    one.answer(otherwise)
    result, found = one.seek_index()
    assert result.outcome == outcome and one.ended_at_rest(result), result.cause
    assert found.after == pytest.approx(10.27e-3, abs=1e-5) or "travel reads" in result.cause


def test_a_count_that_is_not_the_home_position_is_no_home(tmp_path):
    one = IndexRig(tmp_path)
    inner = one.model.set_homing
    one.model.set_homing = lambda options: inner(options and options._replace(home_counts=9000))
    result, _ = one.seek_index()
    assert result.trip.cause == "position jump" and "expected 10.27 mm (0x30B0)" in result.cause
    assert one.furthest_m < one.way.turn and one.ended_at_rest(result)


@pytest.mark.parametrize(("counts", "cause"), [(2000, "position jump"), (14060, "over-travel")])
def test_an_encoder_that_jumps_under_way_gives_no_zero(tmp_path, counts, cause):
    """Also where it jumps to what looks like the home: the motor does not stay there."""
    one = IndexRig(tmp_path)
    one.model._drive["has_index"] = 0
    one.break_it("encoder_jump", at_cycle=MOVING, value=counts)
    result, _ = one.seek_index()
    assert result.trip.cause == cause, result.cause
    assert one.furthest_m < one.way.most and one.ended_at_rest(result)


@pytest.mark.parametrize(
    ("kind", "value", "cycle"), [("sensor_stuck", None, MOVING), ("sensor_gain", 0.3, 0)]
)
def test_a_position_that_stands_or_lags_does_not_hide_the_way(tmp_path, kind, value, cycle):
    one = IndexRig(tmp_path)
    one.model._drive["has_index"] = 0
    one.break_it(kind, "motor_travel_m", cycle, value=value)
    result, _ = one.seek_index()
    assert result.trip.cause == "over-travel" and "by motor_speed_m_s" in result.cause
    assert one.furthest_m < one.way.most + 2.0 * one.way.landing + STOPPING_M
    assert one.ended_at_rest(result)


def test_bits_of_a_homing_before_are_none_of_this_one(tmp_path):
    """They were off for a while before the start; the drive does nothing, and stands at home."""
    one = IndexRig(tmp_path, at=0.0)
    place = status_place(one)

    def otherwise(inputs: bytearray, cycle: int) -> None:
        inputs[place] = inputs[place] | 0x94 if cycle > 150 else inputs[place] & ~0x10

    one.answer(otherwise)
    one.model._drive["has_index"] = 0
    result, found = one.seek_index()
    assert result.outcome == "tripped" and math.isnan(found.after)
    assert START_HOMING in words(one) and one.ended_at_rest(result)


def test_a_count_that_jumps_again_behind_its_pulse_is_no_zero(tmp_path):
    """By less than the watch of motion finds, and more than the zero's tolerance."""
    one = IndexRig(tmp_path)
    inner, returning = one.model.cycle, [0]

    def cycle(outputs_raw: bytes) -> bytes:
        returning[0] += one.machine["homing"] == RETURNING
        if returning[0] == 4:
            returning[0] += 1
            one.machine["offset_counts"] += 300
        return inner(outputs_raw)

    one.model.cycle = cycle
    result, found = one.seek_index()
    assert result.outcome == "tripped" and math.isnan(found.after)
    assert "expected 10.2700 mm to 0.2 mm" in result.cause and one.ended_at_rest(result)


def test_methods_follow_the_encoder_and_speeds_the_rig(tmp_path):
    one = IndexRig(tmp_path)
    options = homing_by_index(one.rig)
    assert options.method == 33 and options.speed_rpm == 72  # 72.6: rounded down, never faster
    assert options.acceleration_rpm_s == 720
    more = IndexRig(tmp_path, direction="increasing")
    assert homing_by_index(more.rig).method == 34
    assert IndexGuard(more.rig, more.way).follows_count

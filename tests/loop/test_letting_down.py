"""Before power goes the motor is let down to where nothing pulls: after a trip, at a run's end."""

import pytest

from epa_rt.cli.inputs import load_inputs
from epa_rt.cli.run import end_text
from epa_rt.config.rig import Rig
from epa_rt.loop.supervisor import BRAKE, DISABLE, DONE, LET_DOWN, SAFE, STOP, VENT
from epa_rt.signals.image import image_of
from sim_backend.faults import PLANT_FAULTS, FaultyRigModel, make_fault
from tests.loop.one_rig import OneRig
from tests.loop.rigging import ROOT, Outcome, Quiet, run_in_memory
from tests.loop.test_end_at_rest import STRETCHED, code, first, inputs_of, with_faults

FORCE, EXHAUST = "muscle_force_n", "cmd_muscle_exhaust_open"
AT = 4300  # the motor is on its way, 16 mm out
STUCK = (("wire_broken", FORCE), ("valve_stuck_closed", EXHAUST))
SOON = ("safety:", "safety:\n  rest_timeout: 0.6 s")
LIFTED = """
experiment: lifted
loop: joint_angle
seed: 1
phases:
  - {name: there, loop: motor_position, move: {to: no_load, speed: 40 mm/s}}
  - {name: fill, loop: motor_position, valves: {all: {set: 580 kPa gauge}}, until: valves_settled, timeout: 30 s}
  - {name: lift, move: {to: mean, speed: 10 mm/s}, valves: {all: hold}}
  - {name: rest, for: 3 s, valves: {all: hold}}
"""  # noqa: E501


def assert_let_down(out: Outcome, rig: Rig, since: int) -> None:
    """Slowly, within every limit, only toward the rest place; at rest before power goes."""
    motor = rig.motor
    place, fastest = motor.places[motor.rest_place or "no_load"], motor.let_down_speed_si
    down = [s[6] for s in out.memory.samples if s[2] == LET_DOWN]
    assert max(abs(row[motor.speed]) for row in down) < 1.1 * fastest + 0.001
    far = [abs(row[motor.position] - place) for row in down]
    assert all(b <= a + 2e-4 for a, b in zip(far, far[1:], strict=False)) and far[-1] < 2e-4
    after = [s[6] for s in out.memory.samples if s[0] >= since]
    for name in (motor.position, motor.speed):
        low, high = rig.row(name).limits
        assert all(low <= row[name] <= high for row in after)
    last = [s[6] for s in out.memory.samples if s[2] in (DISABLE, SAFE, DONE)]
    assert max(abs(row[motor.position] - place) for row in last) < 5e-4
    assert max(abs(row[motor.speed]) for row in last) < 0.02 * motor.speed_max
    assert out.result.end.at_rest and out.result.end.off and not out.result.end.beyond


@pytest.mark.parametrize("rig", ["bench", "bench_analog"])
def test_a_muscle_that_does_not_vent_is_let_down_after_a_trip(rig, tmp_path):
    inputs = inputs_of(tmp_path, rig, STRETCHED, SOON)
    out = with_faults(inputs, AT, *STUCK)
    assert out.memory.states[-5:] == [BRAKE, VENT, LET_DOWN, SAFE, DONE] and code(out) == 23
    assert_let_down(out, inputs.rig, AT)
    text = end_text(out.result, inputs.rig)
    why = "as a muscle is not measured to be vented and"
    assert f"the motor was let down under power to no_load, {why}" in text
    assert (
        "holding it takes 0." in text and "; there a muscle is not measured to be vented;" in text
    )
    assert out.result.end.facts()["let_down"] in text
    said = [event[2] for event in out.memory.events if event[1] == "let_down"]
    assert [text.split(" under ")[0] for text in said] == ["on its way", "let down"]


@pytest.fixture(scope="module")
def mass(tmp_path_factory):
    path = tmp_path_factory.mktemp("mass") / "lifted.yaml"
    path.write_text(LIFTED)
    return load_inputs(path, ROOT / "config/rigs/mass.yaml", None, with_plant=True)


@pytest.mark.parametrize("how", ["stopped", "tripped"])
def test_a_load_on_a_vented_muscle_goes_down_at_the_end_and_after_a_trip(how, mass):
    at = 8500
    if how == "stopped":
        out = run_in_memory(mass, requests=Quiet(stop_at=at))
        assert out.memory.states[-6:] == [STOP, VENT, LET_DOWN, DISABLE, SAFE, DONE]
    else:
        out = with_faults(mass, at, ("wire_broken", FORCE))
        assert out.memory.states[-5:] == [BRAKE, VENT, LET_DOWN, SAFE, DONE]
    assert first(out, LET_DOWN)[6]["motor_current_a"] > 2.0
    assert_let_down(out, mass.rig, at)
    assert out.result.end.is_quiet and code(out) == (130 if how == "stopped" else 3)
    assert "let down under power to no_load, as holding it takes 2." in end_text(
        out.result, mass.rig
    )


def never_vented(rig, changes=None):
    """One kPa more than there is, and what ``changes`` put over it by the supervisor's state."""
    place = image_of(rig, outputs=False).places["analog_in.ch1"]

    def hurt(exchange, model):
        raw = bytearray(exchange.inputs_raw)
        counts = int.from_bytes(raw[place.byte : place.byte + 2], "little") + 16
        raw[place.byte : place.byte + 2] = counts.to_bytes(2, "little")
        if changes is not None:
            changes(raw)
        return exchange._replace(inputs_raw=bytes(raw))

    return hurt


STRICT = ("{supply: 850 kPa gauge}", "{supply: 850 kPa gauge, vented: 1 Pa}")


class Watching(Quiet):
    """Stops once at a cycle; at once some cycles after the let-down began."""

    def __init__(self, stop_at: int, at_once_after: int = 1 << 60):
        super().__init__(stop_at)
        self.supervisor, self._after, self.since = None, at_once_after, 0

    def prepare(self, assembly, model):
        self.supervisor = assembly.supervisor

    def poll(self, cycle: int) -> int:
        self.since += self.supervisor.state == LET_DOWN
        return 2 if self.since > self._after else super().poll(cycle)


def stopped(inputs, changes=None, at_once_after=1 << 60) -> Outcome:
    watching = Watching(AT, at_once_after)

    def later(raw):
        if changes is not None and watching.since > 100:
            changes(raw)

    hurt = never_vented(inputs.rig, later)
    return run_in_memory(inputs, hurt, requests=watching, prepare=watching.prepare)


@pytest.fixture(scope="module")
def strict(tmp_path_factory):
    return inputs_of(tmp_path_factory.mktemp("strict"), "bench", STRETCHED, SOON, STRICT)


def test_the_end_of_a_run_lets_down_what_may_not_be_vented(strict):
    out = stopped(strict)
    assert out.memory.states[-6:] == [STOP, VENT, LET_DOWN, DISABLE, SAFE, DONE]
    assert_let_down(out, strict.rig, AT)
    assert code(out) == 130 + 20 and out.result.outcome == "stopped"


@pytest.mark.parametrize("speed_rpm", [400, -400])
def test_a_motor_that_runs_away_from_its_targets_ends_in_category_0(strict, speed_rpm):
    place = image_of(strict.rig, outputs=False).places["drive.speed"]

    def faster(raw):
        raw[place.byte : place.byte + 4] = speed_rpm.to_bytes(4, "little", signed=True)

    out = stopped(strict, faster)
    assert out.result.trip.cause == "let-down" and out.memory.states[-3:] == [LET_DOWN, SAFE, DONE]
    said = "power off, air out: the motor cannot be let down: motor_speed_m_s = "
    assert said in out.result.category and "beyond 21 mm/s" in out.result.category
    text = end_text(out.result, strict.rig)
    assert "the motor was on its way under power to no_load" in text and "let down" not in text


def test_the_second_ctrl_c_is_at_once_also_on_the_way_down(strict):
    out = stopped(strict, at_once_after=50)
    assert out.memory.states[-3:] == [LET_DOWN, SAFE, DONE]
    assert "the operator asked to stop at once" in out.result.category
    assert sum(s[2] == LET_DOWN for s in out.memory.samples) < 60


def test_a_trip_on_the_way_down_goes_on_with_it_after_braking(strict):
    place = image_of(strict.rig, outputs=False).places["analog_in.ch2"]

    def too_strong(raw):
        raw[place.byte : place.byte + 2] = round(8.0 * 3276.8).to_bytes(2, "little")

    out = stopped(strict, too_strong)
    assert out.result.trip.cause == "over-force"
    assert out.memory.states[-6:] == [LET_DOWN, BRAKE, VENT, LET_DOWN, SAFE, DONE]


def test_a_drive_that_fails_on_the_way_down_is_said(tmp_path):
    inputs = inputs_of(tmp_path, "bench", STRETCHED, SOON)

    def prepare(assembly, model):
        model.__class__ = FaultyRigModel
        FaultyRigModel.__init__(model, inputs.rig, inputs.plant, 1)
        for kind, where in STUCK:
            model.faults.add(make_fault(PLANT_FAULTS, kind, where, at_cycle=AT))
        model.faults.add(make_fault(PLANT_FAULTS, "sto", "", at_cycle=AT + 1500))

    out = run_in_memory(inputs, prepare=prepare)
    assert out.memory.states[-3:] == [LET_DOWN, SAFE, DONE]
    assert "says that it has no power" in out.result.category
    assert "stop category 0" in out.result.category


def test_without_a_place_it_stays_as_it_is_and_says_what_pulls(tmp_path):
    inputs = inputs_of(
        tmp_path,
        "bench",
        STRETCHED.replace("no_load", "home"),
        SOON,
        STRICT,
        ("places: {no_load: 0 mm", "places: {home: 0 mm"),
    )
    out = run_in_memory(inputs, never_vented(inputs.rig), requests=Quiet(stop_at=AT))
    assert LET_DOWN not in out.memory.states
    why = "not let down, though a muscle is not measured to be vented and holding it takes 0."
    text = end_text(out.result, inputs.rig)
    assert f"the motor was {why}" in text and "(the rig file has no motor.rest_place)" in text


@pytest.mark.parametrize(
    ("torque", "why"),
    [
        ("10 mNm", "(the drive holds by its own quick stop, after a torque)"),
        ("40 mNm", "(the drive was not under a target of position or speed)"),  # over-speed
    ],
)
def test_a_drive_under_a_torque_cannot_and_says_so(torque, why, tmp_path):
    push = """
experiment: push
loop: motor_torque
seed: 1
phases:
  - {{name: push, step: {{levels: [LEVEL], rise: 100 ms, dwell: 150 ms, times: 1}}}}
"""
    inputs = inputs_of(tmp_path, "bench", push.replace("LEVEL", torque), SOON, STRICT)
    out = run_in_memory(inputs, never_vented(inputs.rig))
    assert LET_DOWN not in out.memory.states
    assert why in end_text(out.result, inputs.rig)


@pytest.mark.parametrize("known", [True, False])
def test_a_load_lifted_by_hand_goes_down_where_travel_has_a_zero(known, tmp_path):
    one = OneRig(tmp_path, "mass", "motor_position")
    result, _ = one.jog("move 6 mm at 10 mm/s", known=known)
    assert (LET_DOWN in one.memory.states) is known
    if known:
        assert result.end.is_quiet and one.travel_m == pytest.approx(-0.028, abs=2e-4)
        speeds = one.measured("motor_speed_m_s")
        assert max(map(abs, speeds)) < 1.1 * one.rig.motor.let_down_speed_si
    else:
        assert result.end.let_down.endswith("(travel has no zero)")

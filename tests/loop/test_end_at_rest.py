"""A run ends when motor and muscles are measured at rest, or says what is left; the brake."""

import pytest

from epa_rt.cli.exits import code_of_run
from epa_rt.cli.inputs import load_inputs
from epa_rt.cli.run import end_text, exit_code
from epa_rt.config.rig import Valves, load_rig
from epa_rt.logs.recorder import LogSummary
from epa_rt.loop.assembly import valve_settings
from epa_rt.loop.rest import StandWatch
from epa_rt.loop.supervisor import BRAKE, DISABLE, DONE, ENABLE, RUN, SAFE, VENT
from epa_rt.signals.image import image_of
from sim_backend.faults import PLANT_FAULTS, FaultyRigModel, make_fault
from tests.loop.rigging import ROOT, TINY, Quiet, run_in_memory, tiny_inputs

TRIAL = 5000
STRETCHED = TINY.replace("out, move: {{to: 10 mm", "out, move: {{to: 20 mm").replace(
    "500 kPa", "500 kPa"
)
FORCE = "muscle_force_n"


def inputs_of(folder, rig="bench", experiment=STRETCHED, *changes):
    """A rig with lines of its file changed, beside its plant."""
    text = (ROOT / f"config/rigs/{rig}.yaml").read_text()
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    for name in ("rigs", "plants"):
        (folder / name).mkdir()
    (folder / "plants/bench.yaml").write_bytes((ROOT / "config/plants/bench.yaml").read_bytes())
    (folder / f"rigs/{rig}.yaml").write_text(text)
    loop = "motor_speed"
    (folder / "asked.yaml").write_text(experiment.format(loop=loop, pressure="500 kPa gauge"))
    return load_inputs(folder / "asked.yaml", folder / f"rigs/{rig}.yaml", None, with_plant=True)


def with_faults(inputs, at, *faults, requests=None):
    """A run with faults of the plant from cycle ``at`` on: (kind, where)."""

    def prepare(assembly, model):
        model.__class__ = FaultyRigModel
        FaultyRigModel.__init__(model, inputs.rig, inputs.plant, 1)
        for kind, where in faults:
            model.faults.add(make_fault(PLANT_FAULTS, kind, where, at_cycle=at))

    return run_in_memory(inputs, prepare=prepare, requests=requests)


def code(out) -> int:
    summary = LogSummary("x", "", "", 0, 0, 0, 0, 0, None)
    return exit_code(summary, out.result)


def first(out, state):
    return next(sample for sample in out.memory.samples if sample[2] == state)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return inputs_of(tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def stuck(bench):
    """The force wire breaks and the exhaust does not open."""
    return with_faults(
        bench, 4300, ("wire_broken", FORCE), ("valve_stuck_closed", "cmd_muscle_exhaust_open")
    )


@pytest.mark.parametrize("at", [4300, TRIAL])
def test_a_broken_wire_at_full_stretch_ends_within_every_limit_and_at_rest(bench, at):
    out = with_faults(bench, at, ("wire_broken", FORCE))
    assert out.result.trip.cause == "invalid sensor" and code(out) == 3
    assert out.memory.states[-4:] == [BRAKE, VENT, SAFE, DONE]
    assert out.result.end.is_quiet and not out.result.end.beyond
    off = first(out, SAFE)
    assert off[6]["muscle_pressure_pa"] < 110e3 and abs(off[6]["motor_speed_m_s"]) < 1.4e-3
    for name in ("motor_travel_m", "motor_speed_m_s"):
        low, high = bench.rig.row(name).limits
        after = [s for s in out.memory.samples if s[0] >= at]
        assert all(low <= s[6][name] <= high for s in after)


def test_safe_torque_off_is_category_0_and_the_run_waits_for_the_motor_to_stand(bench):
    out = with_faults(bench, 4300, ("sto", ""))
    assert out.result.trip.cause == "drive" and out.result.category.startswith("stop category 0")
    assert "status word 0x" in out.result.category and "kPa abs" in out.result.category
    assert (out.memory.states[-2:], code(out)) == ([SAFE, DONE], 3)
    assert out.result.end.is_quiet and "motor_travel_m" in out.result.end.beyond
    assert "while ending, motor travel went to -" in end_text(out.result, bench.rig)
    assert abs(out.memory.samples[-1][6]["motor_speed_m_s"]) < 1.4e-3


def test_an_exhaust_that_stays_closed_is_said_with_its_figures_and_has_a_code_of_its_own(stuck):
    end, text = stuck.result.end, end_text(stuck.result, stuck.assembly.rig)
    assert (end.at_rest, end.vented, end.off, end.timed_out) == (True, False, True, True)
    assert "NOT vented: air is stored in muscle; exhaust stuck closed" in text
    assert "kPa abs" in text and "waited for 10 s" in text
    assert code(stuck) == 3 + 20
    held = [s for s in stuck.memory.samples if s[2] in (BRAKE, VENT)]
    assert len(held) == pytest.approx(10_050, abs=60)  # under power for the rig file's time
    assert max(abs(s[6]["motor_speed_m_s"]) for s in held[100:]) < 1.4e-3


def test_the_longest_wait_stands_in_the_rig_file(tmp_path):
    inputs = inputs_of(tmp_path, "bench", STRETCHED, ("safety:", "safety:\n  rest_timeout: 0.7 s"))
    stuck = (("wire_broken", FORCE), ("valve_stuck_closed", "cmd_muscle_exhaust_open"))
    out = with_faults(inputs, 4300, *stuck)
    assert sum(s[2] == VENT for s in out.memory.samples) == pytest.approx(700, abs=2)


def test_the_page_and_the_program_call_the_same_pressure_vented():
    rig = load_rig(ROOT / "config/rigs/bench.yaml")
    (muscle,) = rig.muscles
    vented_pa = rig.vented_pa(muscle)
    assert valve_settings(muscle, rig).vented_pa == vented_pa == rig.safety.sensors.vented
    page = (ROOT / "docs/operator.md").read_text(encoding="utf-8")
    assert f"`safety.sensors.vented` ({vented_pa / 1e3:g} kPa) above atmosphere" in page
    own = muscle.model_copy(update={"valves": Valves(vented="5 kPa")})
    assert valve_settings(own, rig).vented_pa == rig.vented_pa(own) == 5e3


def test_a_normal_end_that_cannot_vent_is_no_plain_success(tmp_path):
    """Vented is what the rig file says: 1 Pa above atmosphere is less than a sensor's offset."""
    pressure = ("{supply: 850 kPa gauge}", "{supply: 850 kPa gauge, vented: 1 Pa}")
    inputs = inputs_of(tmp_path, "bench", STRETCHED.split("  - {{name: out")[0], pressure)
    place = image_of(inputs.rig, outputs=False).places["analog_in.ch1"]

    def hurt(exchange, model):
        """One kPa more than there is."""
        raw = bytearray(exchange.inputs_raw)
        counts = int.from_bytes(raw[place.byte : place.byte + 2], "little") + 16
        raw[place.byte : place.byte + 2] = counts.to_bytes(2, "little")
        return exchange._replace(inputs_raw=bytes(raw))

    out = run_in_memory(inputs, hurt, requests=Quiet(stop_at=700))
    assert out.result.outcome == "stopped" and out.result.end.vented is False
    assert out.result.end.timed_out and code(out) == 130 + 20


def test_codes_tell_what_is_missing_for_every_outcome():
    codes = {
        (outcome, rest, vented, off): code_of_run(outcome, rest, vented, off)
        for outcome in ("completed", "tripped", "failed", "stopped")
        for rest in (True, False)
        for vented in (True, False)
        for off in (True, False)
    }
    assert len(set(codes.values())) == len(codes) and max(codes.values()) < 256
    assert codes["completed", True, True, True] == 0 and codes["stopped", True, True, True] == 130
    assert codes["tripped", True, False, True] == 23 and codes["failed", False, False, False] == 74


def test_a_lost_bus_claims_nothing_and_says_what_the_drive_does(bench):
    from tests.loop.rigging import BackendError

    def hurt(exchange, model):
        if exchange.cycle == TRIAL:
            raise BackendError("the cable was pulled")
        return exchange

    out = run_in_memory(bench, hurt)
    end, text = out.result.end, end_text(out.result, bench.rig)
    assert (end.at_rest, end.vented, end.off, code(out)) == (None, None, None, 74)
    assert "0x6007, 0x605A" in text and "(rest: not known; vented: not known)" in text
    assert "muscle 6" in text and "kPa abs" in text  # what was seen last


def test_no_cycle_is_no_end():
    from epa_rt.loop.run import RunResult

    result = RunResult("failed", "no bus", 0, False, 0, 0)
    assert "not known" in end_text(result, None)
    assert exit_code(LogSummary("x", "", "", 0, 0, 0, 0, 0, None), result) == 4


def test_a_wired_drive_is_off_by_its_current(tmp_path):
    out = run_in_memory(tiny_inputs(tmp_path, "bench_analog", pressure="150 kPa gauge"))
    assert "drive off, by its current (" in end_text(out.result, out.assembly.rig)
    assert code(out) == 0


def test_a_wired_drive_whose_current_flows_on_is_not_called_off(tmp_path):
    inputs = tiny_inputs(tmp_path, "bench_analog", pressure="150 kPa gauge")
    place = image_of(inputs.rig, outputs=False).places["analog_in.ch3"]

    def hurt(exchange, model):
        raw = bytearray(exchange.inputs_raw)
        if exchange.cycle > 1000:  # half an ampere at 1 A/V
            raw[place.byte : place.byte + 2] = round(0.5 * 3276.8).to_bytes(2, "little")
        return exchange._replace(inputs_raw=bytes(raw))

    out = run_in_memory(inputs, hurt, requests=Quiet(stop_at=1500))
    assert out.result.end.off is False and code(out) == 140
    assert "did NOT confirm" in end_text(out.result, inputs.rig)


def test_without_a_row_of_its_current_nobody_says_off(tmp_path):
    inputs = inputs_of(
        tmp_path,
        "bench_analog",
        STRETCHED,
        ("  current: motor_current_a\n", ""),
        ("  i2t: {current: motor_current_a, continuous: 4.06 A, time_constant: 3.96 s}\n", ""),
        (
            "overrun: {",
            "unprotected: {motor_measured: no row of current, i2t: no row of current}\noverrun: {",
        ),
    )
    out = run_in_memory(inputs, requests=Quiet(stop_at=300))
    assert out.result.end.off is None and code(out) == 140
    assert "drive off or not: not measured" in end_text(out.result, inputs.rig)


INLET = "  - {name: cmd_muscle_inlet_open"
BRAKE_FILE = (
    (INLET, "  - {name: cmd_brake_open, entry: valves.ch4}\n" + INLET),
    (
        "  places: {no_load",
        (
            "  brake: {output: cmd_brake_open, release_delay: 70 ms, close_delay: 30 ms}\n"
            "  places: {no_load"
        ),
    ),
)


def open_brake(out, sample) -> bool:
    place = image_of(out.assembly.rig, outputs=True).places["valves.ch4"]
    return bool(sample[5][place.byte] >> place.bit & 1)


def test_a_brake_opens_under_torque_and_closes_before_it_goes(tmp_path):
    inputs = inputs_of(tmp_path, "bench", STRETCHED, *BRAKE_FILE)
    out = run_in_memory(inputs, requests=Quiet(stop_at=TRIAL))
    samples = out.memory.samples
    opened = next(s[0] for s in samples if open_brake(out, s))
    runs, closed = (
        first(out, RUN)[0],
        next(s[0] for s in samples if s[0] > opened and not open_brake(out, s)),
    )
    assert first(out, ENABLE)[0] < opened and runs - opened == pytest.approx(70, abs=2)
    assert samples[opened][8]["cmd_drive_control_raw"] == 0x0F
    assert samples[closed][2] == VENT and first(out, DISABLE)[0] - closed == pytest.approx(
        30, abs=2
    )
    assert not any(open_brake(out, s) for s in samples[closed:])
    still = [s[6]["motor_travel_m"] for s in samples[opened:runs]]
    assert max(still) - min(still) < 20e-6


@pytest.mark.parametrize(("fault", "waits"), [(("wire_broken", FORCE), True), (("sto", ""), False)])
def test_after_a_trip_the_brake_closes_before_or_with_the_power(fault, waits, tmp_path):
    inputs = inputs_of(tmp_path, "bench", STRETCHED, *BRAKE_FILE)
    out = with_faults(inputs, 4300, fault)
    off = first(out, SAFE)[0]
    closed = next(s[0] for s in out.memory.samples if s[0] >= 4300 and not open_brake(out, s))
    assert off - closed == pytest.approx(30 if waits else 0, abs=2)
    assert not any(open_brake(out, s) for s in out.memory.samples[closed:])


def test_a_brake_of_the_drive_itself_only_waits(tmp_path):
    brake = BRAKE_FILE[1][1].replace("output: cmd_brake_open", "drive: true")
    inputs = inputs_of(tmp_path, "bench", STRETCHED, (BRAKE_FILE[1][0], brake))
    plain = tmp_path / "plain"
    plain.mkdir()
    waited = run_in_memory(inputs, requests=Quiet(stop_at=300))
    unbraked = run_in_memory(inputs_of(plain), requests=Quiet(stop_at=300))
    assert first(waited, RUN)[0] - first(unbraked, RUN)[0] == 70


def test_a_trip_in_torque_control_brakes_too_and_so_does_its_end(tmp_path):
    push = """
experiment: push
loop: motor_torque
seed: 1
phases:
  - {{name: push, step: {{levels: [20 mNm], rise: 100 ms, dwell: 50 ms, times: 1}}}}
"""
    inputs = inputs_of(tmp_path, "bench", push)
    out = run_in_memory(inputs)
    assert out.result.outcome == "completed" and out.result.end.is_quiet
    vent = [s for s in out.memory.samples if s[2] == VENT]
    assert {s[8]["cmd_drive_control_raw"] for s in vent[1:-1]} == {0x02}


def test_a_fault_of_our_own_while_it_ends_only_closes(bench):
    def prepare(assembly, model):
        def step(*_):
            raise ZeroDivisionError("float division by zero")

        assembly.supervisor._rest_watch.step = step

    out = run_in_memory(bench, prepare=prepare, requests=Quiet(stop_at=TRIAL))
    assert out.result.outcome == "failed" and "float division by zero" in out.result.cause
    assert out.backend.inner.model.command["enabled"][0] == 0.0


@pytest.mark.parametrize(
    ("amplitude", "swing_cycles", "stands"),
    [(1.0, 1000, False), (0.04, 1000, True), (0.0, 1000, True)],
)
def test_a_joint_that_turns_round_does_not_stand(amplitude, swing_cycles, stands):
    import math

    watch, seen = StandWatch("angle", 0.1, 500), False
    for i in range(3000):
        watch.step(amplitude * math.sin(2.0 * math.pi * i / swing_cycles))
        seen = seen or watch.stands
    assert seen is stands


def test_what_is_no_number_does_not_stand():
    watch = StandWatch("angle", 0.1, 3)
    for _ in range(10):
        watch.step(float("nan"))
    assert not watch.stands

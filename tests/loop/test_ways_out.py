"""Every way out of a run ends at rest, vented and without power, or says what is left, and why."""

import pytest

from epa_rt.loop.assembly import assemble
from epa_rt.loop.run import run
from epa_rt.loop.supervisor import (
    BRAKE,
    BRING_UP,
    DISABLE,
    DONE,
    ENABLE,
    LET_DOWN,
    RUN,
    SAFE,
    STOP,
    VENT,
)
from sim_backend.backend import SimBackend
from tests.loop.rigging import BackendError, Between, Memory, Quiet, run_in_memory, tiny_inputs

TRIAL = 5000  # a cycle well inside the tiny experiment's motion


def _poke(exchange, at: int, data: bytes):
    raw = exchange.inputs_raw
    return exchange._replace(inputs_raw=raw[:at] + data + raw[at + len(data) :])


def _from(cycle: int, change):
    return lambda exchange, model: change(exchange) if exchange.cycle >= cycle else exchange


def lost_working_counter(exchange, model):
    return exchange._replace(working_counter_ok=exchange.cycle < TRIAL)


def drive_fault(exchange, model):
    if exchange.cycle == TRIAL:
        model.machine["state"], model.machine["error_code"] = 7, 0x8611
    return exchange


def frozen_toggle():
    kept: list[bytes] = []

    def hurt(exchange, model):
        if exchange.cycle < TRIAL:
            return exchange
        kept.append(exchange.inputs_raw[:16])
        return _poke(exchange, 0, kept[0])

    return hurt


# pressure: status at byte 0, value at byte 2; force: value at byte 6; 3277 counts are one volt
HURTS = {
    "invalid sensor": _from(TRIAL, lambda e: _poke(e, 2, (0).to_bytes(2, "little"))),
    "over-pressure": _from(TRIAL, lambda e: _poke(e, 2, round(4.5 * 3276.8).to_bytes(2, "little"))),
    "over-force": _from(TRIAL, lambda e: _poke(e, 6, round(8.0 * 3276.8).to_bytes(2, "little"))),
    "over-travel": _from(
        TRIAL, lambda e: _poke(e, 19, (200_000).to_bytes(4, "little", signed=True))
    ),
    "over-current": _from(TRIAL, lambda e: _poke(e, 29, (9500).to_bytes(4, "little", signed=True))),
    "lost working counter": lost_working_counter,
    "stale": frozen_toggle(),
    "drive": drive_fault,
}


AT_ONCE = ("over-travel", "lost working counter", "drive")  # position, bus or drive is lost
# nothing tells then that the muscle is vented, or that the motor holds without a current
NOT_KNOWN = ("invalid sensor", "over-pressure", "over-current", "stale")


def control_word(out, outputs_raw: bytes) -> int:
    from epa_rt.signals.image import image_of

    place = image_of(out.assembly.rig, outputs=True).places["drive.control_word"]
    return int.from_bytes(outputs_raw[place.byte : place.byte + 2], "little")


def air_is_let_out(out, outputs_raw: bytes) -> bool:
    """Inlet and exhaust without current."""
    from epa_rt.signals.image import image_of

    places = image_of(out.assembly.rig, outputs=True).places
    rows = [
        out.assembly.rig.row(row) for m in out.assembly.rig.muscles for row in (m.inlet, m.exhaust)
    ]
    return not any(outputs_raw[places[r.entry].byte] >> places[r.entry].bit & 1 for r in rows)


def assert_within_limits(samples, rig) -> None:
    for name in (rig.motor.position, rig.motor.speed):
        low, high = rig.row(name).limits
        assert all(low <= sample[6][name] <= high for sample in samples), name


def assert_safe_end(out, rig) -> None:
    safe = out.assembly.encoder.safe_raw
    assert out.memory.samples[-1][5] == safe
    assert out.backend.closed >= 1
    model = out.backend.inner.model
    assert model.command["enabled"][0] == 0.0
    assert not model.command["inlet"].any()
    assert model.command["exhaust"][0, 0] == 1.0  # normally open: the muscle vents


@pytest.mark.parametrize("cause", HURTS)
def test_a_fault_in_mid_motion_trips_with_its_name_and_within_the_reaction_time(cause, tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, HURTS[cause])
    assert out.result.outcome == "tripped"
    assert out.result.trip.cause == cause
    assert_safe_end(out, inputs.rig)
    allowed = round(inputs.rig.safety.reaction / inputs.rig.period_s)
    stale_after = inputs.rig.row("muscle_pressure_pa").stale_after if cause == "stale" else 0
    assert TRIAL <= out.result.trip.cycle <= TRIAL + allowed + stale_after
    trips = [event for event in out.memory.events if event[1] == "trip"]
    assert len(trips) == 1 and cause in trips[0][2]
    after = [sample for sample in out.memory.samples if sample[0] >= out.result.trip.cycle]
    assert all(air_is_let_out(out, sample[5]) for sample in after)
    safe = out.assembly.encoder.safe_raw
    if cause in AT_ONCE:
        assert all(sample[5] == safe for sample in after)
        assert out.memory.states[-2:] == [SAFE, DONE]
        return
    down = [LET_DOWN] if cause in NOT_KNOWN else []
    states = [BRAKE, VENT, *down, SAFE, DONE]
    assert out.memory.states[-len(states) :] == states
    held = [sample for sample in after if sample[2] in (BRAKE, VENT)]
    assert {control_word(out, sample[5]) for sample in held[:-1]} == {0x02}
    assert all(sample[5] == safe for sample in after if sample[2] >= SAFE)
    assert_within_limits(after, inputs.rig)
    off = next(sample for sample in after if sample[2] == SAFE)
    assert abs(off[6]["motor_speed_m_s"]) < 0.02 * inputs.rig.motor.speed_max
    assert out.result.end.at_rest and out.result.end.off
    pressure_says = {"invalid sensor": None, "stale": None, "over-pressure": False}
    assert out.result.end.vented is pressure_says.get(cause, True)


def test_a_drive_fault_is_named_with_its_error_code(tmp_path):
    out = run_in_memory(tiny_inputs(tmp_path), drive_fault)
    assert "0x8611 following error" in out.result.cause


def test_the_normal_end_is_safe_and_confirmed(tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs)
    assert (out.result.outcome, out.result.confirmed) == ("completed", True)
    assert out.memory.states == [BRING_UP, ENABLE, RUN, VENT, DISABLE, SAFE, DONE]
    assert out.result.end.is_quiet and not out.result.end.timed_out
    assert_safe_end(out, inputs.rig)
    assert out.memory.samples[-1][6]["muscle_pressure_pa"] < 110e3


def test_a_stop_brakes_before_it_disables(tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, requests=Quiet(stop_at=TRIAL))
    assert out.result.outcome == "stopped"
    assert out.memory.states == [BRING_UP, ENABLE, RUN, STOP, VENT, DISABLE, SAFE, DONE]
    assert_safe_end(out, inputs.rig)
    stop = next(s for s in out.memory.samples if s[2] == VENT)
    assert (
        abs(stop[6]["motor_speed_m_s"]) < 6e-3
    )  # the reference is at rest; the motor follows two cycles behind


def test_a_stop_asked_twice_takes_the_torque_off_at_once(tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, requests=Quiet(stop_at=TRIAL, stop_at_once_at=TRIAL))
    assert (out.result.outcome, out.result.trip.cause, out.result.trip.cycle) == (
        "tripped",
        "operator",
        TRIAL,
    )
    assert_safe_end(out, inputs.rig)
    assert all(s[5] == out.assembly.encoder.safe_raw for s in out.memory.samples if s[0] >= TRIAL)
    assert "category 0" in out.result.category and "kPa" in out.result.category


@pytest.mark.parametrize("cycle", [0, 50, *range(100, 110), 130])
def test_a_stop_before_anything_moves_is_safe_too(cycle, tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, requests=Quiet(stop_at=cycle))
    assert out.result.outcome == "stopped"
    assert_safe_end(out, inputs.rig)


MODE_BYTE = 18  # of the inputs: the mode that the drive reports


def test_a_drive_that_changes_its_mode_by_itself_trips(tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, _from(TRIAL, lambda e: _poke(e, MODE_BYTE, b"\x01")))
    assert (out.result.outcome, out.result.trip.cause, out.result.trip.cycle) == (
        "tripped",
        "drive",
        TRIAL,
    )
    assert "reports mode 1 (0x6061), asked for 9" in out.result.cause
    assert_safe_end(out, inputs.rig)


@pytest.mark.parametrize(("until", "outcome"), [(500, "completed"), (10**9, "tripped")])
def test_a_drive_has_time_to_change_its_mode_and_nothing_moves_before(until, outcome, tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(
        inputs, lambda e, model: _poke(e, MODE_BYTE, b"\x01") if e.cycle < until else e
    )
    assert out.result.outcome == outcome
    assert (
        "cannot be enabled: it reports mode 1 (0x6061), asked for 9" in out.result.cause
        or outcome == "completed"
    )
    assert max(abs(s[6]["motor_speed_m_s"]) for s in out.memory.samples if s[0] < 500) < 1e-4
    assert_safe_end(out, inputs.rig)


def test_a_drive_that_says_it_is_on_when_the_bus_closes_is_not_called_off(tmp_path):
    """A drive on wires is off for the loop where the enabling output is; its own status word may
    know better.
    """
    inputs = tiny_inputs(tmp_path)
    assembly, backend = (
        assemble(inputs.rig, inputs.experiment),
        Between(SimBackend(inputs.rig, inputs.plant, 1)),
    )
    backend.drive_off = False
    result = run(
        inputs.rig,
        backend,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        Memory(),
        Quiet(stop_at=50),
    )
    assert assembly.supervisor.confirmed and not result.confirmed


def test_a_recorder_that_fails_ends_the_run(tmp_path):
    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, memory=Memory(fail_at=TRIAL))
    assert (out.result.outcome, out.result.trip.cause) == ("tripped", "recorder")
    assert_safe_end(out, inputs.rig)


def test_a_lost_bus_ends_the_run_with_its_sentence(tmp_path):
    def hurt(exchange, model):
        if exchange.cycle == TRIAL:
            raise BackendError("the cable was pulled")
        return exchange

    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, hurt)
    assert (out.result.outcome, out.result.cause) == ("failed", "the cable was pulled")
    assert out.backend.closed >= 1
    assert out.backend.inner.model.command["enabled"][0] == 0.0
    assert [event[1] for event in out.memory.events][-1] == "error"


def test_a_fault_of_our_own_does_not_leave_the_last_command_standing(tmp_path):
    def prepare(assembly, model):
        motion = assembly.supervisor.motions["motor_speed"]
        whole = motion.step

        def step(measured, reference, dt_s):
            if measured["motor_travel_m"] > 0.009:
                raise ZeroDivisionError("float division by zero")
            return whole(measured, reference, dt_s)

        motion.step = step

    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, prepare=prepare)
    assert (out.result.outcome, out.result.trip.cause) == ("tripped", "internal error")
    assert "float division by zero" in out.result.cause
    assert_safe_end(out, inputs.rig)


def test_a_codec_that_fails_ends_the_run_and_keeps_the_traceback(tmp_path):
    def hurt(exchange, model):
        return (
            exchange._replace(inputs_raw=exchange.inputs_raw[:-1])
            if exchange.cycle == TRIAL
            else exchange
        )

    inputs = tiny_inputs(tmp_path)
    out = run_in_memory(inputs, hurt)
    assert out.result.outcome == "failed" and "internal error" in out.result.cause
    error = next(event for event in out.memory.events if event[1] == "error")
    assert "traceback" in error[3] and out.result.cause.count("internal error") == 1
    assert out.memory.states[-4:] == [BRAKE, VENT, SAFE, DONE]
    assert out.result.end.is_quiet
    assert out.backend.inner.model.command["enabled"][0] == 0.0


@pytest.mark.parametrize("at", [14_000, 20_200, 21_350])
def test_a_stop_in_joint_control_does_not_throw_the_motor(at):
    from epa_rt.cli.inputs import load_inputs
    from tests.loop.rigging import ROOT

    inputs = load_inputs(
        ROOT / "config/experiments/knee_chirp_short.yaml",
        ROOT / "config/rigs/knee.yaml",
        None,
        with_plant=True,
    )
    out = run_in_memory(inputs, requests=Quiet(stop_at=at))
    assert out.result.outcome == "stopped"
    after = [sample for sample in out.memory.samples if sample[0] >= at]
    assert (
        max(abs(sample[6]["motor_current_a"]) for sample in after) < 5.0
    )  # the drive's own limit is 8 A
    disabled = next(sample for sample in after if sample[2] == DISABLE)
    assert abs(disabled[6]["motor_speed_m_s"]) < 0.02 * inputs.rig.motor.speed_max


def test_a_drive_that_cannot_be_heard_is_not_called_off(tmp_path):
    inputs = tiny_inputs(tmp_path)
    silent = run_in_memory(inputs, lambda e, model: e._replace(working_counter_ok=e.cycle < TRIAL))
    assert silent.result.trip.cause == "lost working counter" and not silent.result.confirmed
    zeros = run_in_memory(
        inputs,
        lambda e, model: e if e.cycle < TRIAL else e._replace(inputs_raw=bytes(len(e.inputs_raw))),
    )
    assert zeros.result.outcome == "tripped" and not zeros.result.confirmed


def test_a_backend_that_cannot_close_is_reported_and_not_raised(tmp_path):
    inputs = tiny_inputs(tmp_path)
    assembly, memory = assemble(inputs.rig, inputs.experiment), Memory()
    backend = Between(SimBackend(inputs.rig, inputs.plant, 1))

    def close():
        raise OSError("the cable is gone")

    backend.close = close
    result = run(
        inputs.rig,
        backend,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        memory,
        Quiet(),
    )
    assert result.outcome == "failed" and "the cable is gone" in result.cause
    assert memory.events[-1][1] == "error"


def test_what_fails_on_the_way_out_does_not_hide_what_ended_the_run(tmp_path):
    inputs = tiny_inputs(tmp_path)
    assembly = assemble(inputs.rig, inputs.experiment)

    def hurt(exchange, model):
        if exchange.cycle == TRIAL + 10:
            raise BackendError("the cable was pulled")
        return HURTS["over-force"](exchange, model)

    backend = Between(SimBackend(inputs.rig, inputs.plant, 1), hurt)

    def close():
        raise OSError("no such interface")

    backend.close = close
    result = run(
        inputs.rig,
        backend,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        Memory(),
        Quiet(),
    )
    assert result.outcome == "failed"
    places = [
        result.cause.index(words)
        for words in ("over-force", "the cable was pulled", "no such interface")
    ]
    assert places == sorted(places)


PUSH = """
experiment: push
loop: motor_torque
seed: 1
phases:
  - {name: push, step: {levels: [20 mNm], rise: 100 ms, dwell: DWELL, times: 1}}
"""


@pytest.mark.parametrize(("dwell", "stop_at"), [("4 s", 4250), ("50 ms", 1 << 60)])
def test_the_end_of_torque_control_lets_the_motor_go(dwell, stop_at, tmp_path):
    from epa_rt.cli.inputs import load_inputs
    from tests.loop.rigging import ROOT

    (tmp_path / "push.yaml").write_text(PUSH.replace("DWELL", dwell))
    inputs = load_inputs(
        tmp_path / "push.yaml", ROOT / "config/rigs/bench.yaml", None, with_plant=True
    )
    out = run_in_memory(inputs, requests=Quiet(stop_at=stop_at))
    assert out.result.outcome == ("completed" if stop_at > TRIAL else "stopped"), out.result.cause
    end = (
        stop_at
        if stop_at < TRIAL
        else next(cycle for cycle, kind, *_ in out.memory.events if kind == "finished")
    )
    before, after = (
        [s for s in out.memory.samples if (s[0] >= end) is late] for late in (False, True)
    )
    assert (
        before[-1][8]["cmd_motor_torque_nm"] > 0.01 and abs(before[-1][6]["motor_speed_m_s"]) > 0.01
    )
    assert all(s[8]["cmd_motor_torque_nm"] == 0.0 for s in after[10:])


def test_bad_cycles_that_a_run_survives_are_counted_and_said(tmp_path):
    bad = (TRIAL, TRIAL + 100, TRIAL + 101)
    out = run_in_memory(
        tiny_inputs(tmp_path), lambda e, model: e._replace(working_counter_ok=e.cycle not in bad)
    )
    assert (out.result.outcome, out.result.bad_cycles) == ("completed", 3)
    assert [(cycle, text) for cycle, kind, text, _data in out.memory.events if kind == "gap"] == [
        (TRIAL + 1, "1 cycle without sound process data; the last good ones stood in"),
        (TRIAL + 102, "2 cycles without sound process data; the last good ones stood in"),
    ]


def test_a_stop_under_tension_vents_the_muscle_before_the_power_goes_off(tmp_path):
    """Else the muscle would spin the unpowered motor: over-speed at 600 kPa and 20 mm of
    stretch.
    """
    inputs = tiny_inputs(tmp_path, pressure="640 kPa gauge")
    whole = run_in_memory(inputs)
    stretched = max(whole.memory.samples, key=lambda sample: sample[6]["muscle_force_n"])
    assert stretched[6]["muscle_force_n"] > 60.0
    out = run_in_memory(inputs, requests=Quiet(stop_at=stretched[0]))
    assert out.result.outcome == "stopped", out.result.cause
    after = [sample for sample in out.memory.samples if sample[0] >= stretched[0]]
    disabled = next(sample for sample in after if sample[2] == DISABLE)
    assert disabled[6]["muscle_force_n"] < 5.0
    assert max(abs(sample[6]["motor_speed_m_s"]) for sample in after if sample[2] >= DISABLE) < 0.02


def test_what_a_bus_has_to_say_stands_in_the_log(tmp_path):
    inputs = tiny_inputs(tmp_path)
    assembly, memory = assemble(inputs.rig, inputs.experiment), Memory()
    backend = Between(SimBackend(inputs.rig, inputs.plant, 1))
    backend.events, backend.drive_off = [("recovery", "valves is back", {"slave": "valves"})], True
    run(
        inputs.rig,
        backend,
        assembly.supervisor,
        assembly.envelope,
        assembly.decoder,
        assembly.encoder,
        memory,
        Quiet(stop_at=200),
    )
    assert (0, "recovery", "valves is back", {"slave": "valves"}) in memory.events


def _frozen(at: int, length: int, zero: tuple[int, int] | None = None):
    """From TRIAL on these bytes stay what they were, and others read zero: a sensor that died
    without a word.
    """
    kept: list[bytes] = []

    def hurt(exchange, model):
        if exchange.cycle < TRIAL:
            return exchange
        raw = exchange.inputs_raw
        kept.append(raw[at : at + length])
        exchange = _poke(exchange, at, kept[0])
        return _poke(exchange, zero[0], bytes(zero[1])) if zero else exchange

    return hurt


@pytest.mark.parametrize("loop", ["motor_speed", "motor_position"])
def test_a_dead_encoder_does_not_end_as_completed(loop, tmp_path):
    inputs = tiny_inputs(tmp_path, loop=loop)
    out = run_in_memory(
        inputs, _frozen(19, 4, zero=(23, 4))
    )  # position stands, speed says zero: they agree
    assert out.result.trip.cause == "following error", out.result.cause
    assert_safe_end(out, inputs.rig)
    low, high = inputs.rig.row("motor_travel_m").limits
    assert low <= out.backend.inner.model.state["truth"]["travel_m"][0] <= high


def test_a_frozen_joint_sensor_does_not_end_as_completed():
    from epa_rt.cli.inputs import load_inputs
    from tests.loop.rigging import ROOT

    inputs = load_inputs(
        ROOT / "config/experiments/knee_chirp_short.yaml",
        ROOT / "config/rigs/knee.yaml",
        None,
        with_plant=True,
    )
    kept: list[bytes] = []

    def hurt(exchange, model):
        if exchange.cycle < 14_000:
            return exchange
        kept.append(exchange.inputs_raw[14:16])
        return _poke(exchange, 14, kept[0])

    out = run_in_memory(inputs, hurt)
    assert (
        out.result.trip.cause == "following error" and out.result.trip.signal == "knee_angle_rad"
    ), out.result.cause


def test_after_a_second_fault_of_our_own_the_envelope_brakes_and_vents_alone(tmp_path):
    class Broken(Memory):
        def sample(self, cycle, *values):
            super().sample(cycle, *values)
            if cycle >= TRIAL:
                raise RuntimeError("no place left")

    out = run_in_memory(tiny_inputs(tmp_path), memory=Broken())
    end = out.result.end
    assert out.result.outcome == "failed" and end.pressures["muscle_pressure_pa"] < 110e3
    assert "the envelope braked and vented alone" in end.unknown[-1]
    assert "holds by itself" not in str(end)
    assert (end.at_rest, end.vented) == (None, None)

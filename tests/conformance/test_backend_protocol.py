"""Every backend keeps the protocol of epa_rt/backend.py."""

import math

import pytest
from backends import CYCLES, FACTORIES, RIGS, SCENARIOS, rig

from epa_rt.backend import BackendError, Exchange
from epa_rt.control.cia402 import DriveState, decode

EVERY = [
    pytest.param(name, make, id=f"{backend}-{name}")
    for backend, make in FACTORIES.items()
    for name in RIGS
]
every_backend = pytest.mark.parametrize(("name", "make"), EVERY)


def run(
    make, name: str, scenario: str, cycles: int = CYCLES
) -> tuple[list[Exchange], list[dict], object]:
    """A scenario run through: exchanges, measured signals (a copy each), the operator."""
    on = rig(name)
    backend, operator = make(on, scenario), SCENARIOS[scenario](on)
    outputs, exchanges, measured = operator.outputs_raw, [], []
    backend.open()
    try:
        for _ in range(cycles):
            exchanges.append(backend.exchange(outputs))
            outputs = operator.step(exchanges[-1].inputs_raw)
            measured.append(dict(operator.measured))
            assert operator.decoder.invalid == operator.decoder.stale == 0
    finally:
        backend.close()
    return exchanges, measured, operator


@every_backend
def test_closed_until_opened_and_after_closing(name, make):
    on = rig(name)
    backend, safe = make(on, "rest"), SCENARIOS["rest"](on).outputs_raw
    assert backend.period_s == on.period_s
    with pytest.raises(BackendError, match="found .*, expected "):
        backend.exchange(safe)
    backend.close()  # before open
    backend.open()
    backend.exchange(safe)
    backend.close()
    backend.close()  # twice
    with pytest.raises(BackendError, match="found .*, expected "):
        backend.exchange(safe)


@every_backend
def test_outputs_of_another_size_are_refused_and_it_can_still_be_closed(name, make):
    on = rig(name)
    backend, safe = make(on, "rest"), SCENARIOS["rest"](on).outputs_raw
    backend.open()
    for wrong in (b"", safe[:-1], safe + b"\0"):
        with pytest.raises(
            BackendError, match=f"found {len(wrong)} bytes, expected .* {len(safe)} bytes"
        ):
            backend.exchange(wrong)
    first = backend.exchange(safe)
    assert first.cycle == 0  # what was refused was no cycle
    with pytest.raises(BackendError):
        backend.exchange(b"")
    backend.close()
    with pytest.raises(BackendError):
        backend.exchange(safe)


@every_backend
def test_cycles_count_from_zero_and_time_steps_by_the_period(name, make):
    exchanges, _, operator = run(make, name, "rest")
    assert [e.cycle for e in exchanges] == list(range(CYCLES))
    stamps = [e.t_ns for e in exchanges]
    assert {b - a for a, b in zip(stamps, stamps[1:], strict=False)} == {
        round(rig(name).period_s * 1e9)
    }
    for e in exchanges:
        assert (
            type(e) is Exchange
            and type(e.inputs_raw) is bytes
            and len(e.inputs_raw) == operator.decoder.size
        )
        assert (
            type(e.t_ns) is type(e.lateness_ns) is type(e.busy_ns) is int
            and e.working_counter_ok is True
        )


@every_backend
def test_inputs_are_valid_from_the_first_cycle_on(name, make):
    _, measured, _ = run(make, name, "rest")
    assert all(math.isfinite(value) for row in measured for value in row.values())


@every_backend
def test_safe_outputs_move_and_energise_nothing(name, make):
    _, measured, _ = run(make, name, "rest")
    on = rig(name)
    for row in measured:
        for muscle in on.muscles:
            assert abs(row[muscle.pressure] - on.atmosphere_pa) < 5e3
        assert abs(row[on.motor.current]) < 0.1
        if on.drive.interface == "cia402":
            assert decode(row[on.drive.status_word]) in (
                DriveState.NOT_READY,
                DriveState.SWITCH_ON_DISABLED,
            )
        if name != "mass":  # there the bias load pulls the motor round
            assert abs(row[on.motor.position] - measured[0][on.motor.position]) < 1e-3


@every_backend
def test_the_drive_walks_up_by_its_control_words(name, make):
    _, measured, operator = run(make, name, "walk")
    assert operator.enabler.enabled and not operator.enabler.cause
    on = rig(name)
    if on.drive.interface == "analog":
        assert operator.control[0] == operator.control[-1] == 1.0
        return
    states = list(dict.fromkeys(decode(word) for word in operator.status))
    assert states == [
        DriveState.NOT_READY,
        DriveState.SWITCH_ON_DISABLED,
        DriveState.READY,
        DriveState.SWITCHED_ON,
        DriveState.OPERATION_ENABLED,
    ]
    assert list(dict.fromkeys(operator.control)) == [0x00, 0x06, 0x07, 0x0F]
    assert measured[-1][on.drive.mode_display] == 9
    live = operator.control.index(0x0F)
    assert (
        decode(operator.status[live]) is DriveState.SWITCHED_ON
    )  # an answer comes in a later cycle than its command
    for row in measured[live:] if name != "mass" else []:
        assert abs(row[on.motor.position] - measured[live][on.motor.position]) < 1e-3


@every_backend
def test_the_same_twice_is_the_same_bytes(name, make):
    first, second = run(make, name, "walk")[0], run(make, name, "walk")[0]
    assert [e.inputs_raw for e in first] == [e.inputs_raw for e in second]
    assert [e.t_ns for e in first] == [e.t_ns for e in second]

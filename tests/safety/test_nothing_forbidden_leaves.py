"""Whatever comes in, what leaves is a command within every limit, or the safe outputs for ever."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import NAMES, Bench, assert_may_leave, is_powered, rig

ODD = [math.nan, math.inf, -math.inf, -0.0, 0.0, 1.0, 1e308, -1e308, 5e-324, 10**400, -(10**400), True, False, 2, 15, 0x0F, 8, 9, 0x10]
anything = st.one_of(st.sampled_from(ODD), st.floats(), st.floats(-1.0, 1.0), st.integers())


def near(row) -> st.SearchStrategy:
    """A value for a row: mostly what it can take, now and then anything."""
    if row.name.endswith("_raw"):
        return st.one_of(st.sampled_from([8, 9, 10] if "mode" in row.name else [0, 6, 7, 15, 15, 15]), anything)
    if row.limits is None:
        return st.one_of(st.sampled_from([0.0, 1.0]), st.sampled_from([0.0, 1.0]), anything)
    low, high = row.limits
    return st.one_of(st.floats(low, high), st.floats(2 * low, 2 * high), st.just(row.safe), anything)


def changes(rows) -> st.SearchStrategy:
    """A few rows of a signal dict, changed."""
    return st.fixed_dictionaries({}, optional={row.name: near(row) for row in rows})


def measurements(rows) -> st.SearchStrategy:
    """Measured signals are floats, whatever they say."""
    value = st.one_of(st.sampled_from([math.nan, math.inf, -math.inf, -0.0, 1e308, 5e-324]), st.floats(-0.1, 0.1), st.floats())
    return st.fixed_dictionaries({}, optional={row.name: value for row in rows})


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=120)
@given(data=st.data())
def test_no_sequence_lets_anything_forbidden_out(name, data):
    on = rig(name)
    bench = Bench(on)
    before = dict(bench.safe)
    powered = False
    for _ in range(data.draw(st.integers(1, 12))):
        measured = data.draw(st.one_of(st.just({}), st.just({}), measurements(on.inputs)))
        command = data.draw(changes(on.outputs))
        if data.draw(st.booleans()) and on.motor.position_target:  # a sound controller: the target is where the rig is
            command[on.motor.position_target] = (bench.measured | measured)[on.motor.position]
        was = bench.trip
        out = bench.check(measured, command, bus_ok=data.draw(st.sampled_from([True, True, True, False])),
                          invalid=data.draw(st.sampled_from([0, 0, 0, 0, 1])), stale=data.draw(st.sampled_from([0, 0, 0, 0, 2])))
        if was is not None:
            assert bench.trip is was
        if bench.trip is not None:
            assert out == bench.safe
            before, powered = dict(bench.safe), False
        else:
            assert_may_leave(on, before, out, powered)
            before, powered = dict(out), is_powered(on, out)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=60)
@given(data=st.data())
def test_after_any_trip_only_safe_values_for_ever(name, data):
    bench = Bench(name)
    bench.envelope.trip("valve", "x", "stuck", 7)
    first = bench.trip
    for _ in range(data.draw(st.integers(1, 6))):
        out = bench.check(data.draw(measurements(bench.rig.inputs)), data.draw(changes(bench.rig.outputs)),
                          bus_ok=data.draw(st.booleans()), invalid=data.draw(st.integers(0, 3)))
        assert out == bench.safe and bench.trip is first
        bench.envelope.trip("another", "y", "later", 8)
        assert bench.trip is first


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_a_measured_value_out_of_this_world_trips(value):
    bench = Bench()
    assert bench.check({"muscle_force_n": value}) == bench.safe
    assert bench.trip.cause == ("NaN" if value != value else "over-force")

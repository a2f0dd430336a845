"""Whatever comes in, what leaves is a command within every limit; after a trip, rest or stop."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safety_bench import NAMES, Bench, assert_may_leave, assert_may_stop, is_powered, rig

ODD = [
    math.nan,
    math.inf,
    -math.inf,
    -0.0,
    0.0,
    1.0,
    1e308,
    -1e308,
    5e-324,
    10**400,
    -(10**400),
    True,
    False,
    2,
    15,
    0x0F,
    8,
    9,
    0x10,
]
anything = st.one_of(st.sampled_from(ODD), st.floats(), st.floats(-1.0, 1.0), st.integers())


def near(row) -> st.SearchStrategy:
    """A value for a row: mostly what it can take or a little more, now and then anything."""
    if row.name.endswith("_raw"):
        sound = st.sampled_from([8, 9, 10] if "mode" in row.name else [0x0F] * 5 + [0, 6, 7])
    elif row.limits is None:
        sound = st.sampled_from([0.0, 1.0])
    else:
        low, high = row.limits
        sound = st.one_of(st.floats(2 * low, 2 * high), st.just(row.safe))
    return st.integers(0, 19).flatmap(lambda n: sound if n else anything)


def changes(rows, most: int) -> st.SearchStrategy:
    """Up to ``most`` rows of a signal dict, changed."""
    one = st.sampled_from(rows).flatmap(lambda row: st.tuples(st.just(row.name), near(row)))
    return st.lists(one, max_size=most).map(dict)


def measurements(rows) -> st.SearchStrategy:
    """Measured signals are floats, whatever they say; most often they are sound."""
    odd = st.one_of(
        st.sampled_from([math.nan, math.inf, -math.inf, -0.0, 1e308, 5e-324]), st.floats()
    )
    one = st.sampled_from(rows).flatmap(
        lambda row: st.tuples(st.just(row.name), st.floats(*(row.limits or (-1.0, 1.0))))
    )
    strange = st.tuples(st.sampled_from([row.name for row in rows]), odd)
    return st.integers(0, 14).flatmap(
        lambda n: st.lists(one if n else strange, max_size=2).map(dict)
    )


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("mode", [None, 8, 9, 10])
@settings(max_examples=25)
@given(data=st.data())
def test_no_sequence_lets_anything_forbidden_out(name, mode, data):
    """From rest, or from a drive that is powered in some mode."""
    on = rig(name)
    bench = Bench(on)
    if mode is not None:
        bench.power_on(mode, says=data.draw(st.sampled_from([None, 0x27, 0x0237])))
    before, powered, is_off = dict(bench.gate.outputs), mode is not None, False
    for _ in range(data.draw(st.integers(1, 12))):
        was = bench.trip
        health = data.draw(
            st.sampled_from([{}] * 40 + [{"bus_ok": False}] * 8 + [{"invalid": 1}, {"stale": 2}])
        )
        out = bench.check(
            data.draw(measurements(on.inputs)), data.draw(changes(on.outputs, 3)), **health
        )
        if was is not None:
            assert bench.trip is was
        if bench.trip is not None:
            is_off = is_off or out == bench.safe
            if is_off:  # for ever
                assert out == bench.safe
            else:
                assert powered or before[on.drive.control_word] == 0x02
                assert_may_stop(on, dict(bench.gate.outputs) if was is None else before, out)
            before = dict(out)
        else:
            assert_may_leave(on, before, out, powered)
            before, powered = dict(out), is_powered(on, out)


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=25)
@given(data=st.data())
def test_after_any_trip_only_safe_values_for_ever(name, data):
    bench = Bench(name)
    bench.envelope.trip("valve", "x", "stuck", 7)
    first = bench.trip
    for _ in range(data.draw(st.integers(1, 6))):
        out = bench.check(
            data.draw(measurements(bench.rig.inputs)),
            data.draw(changes(bench.rig.outputs, 7)),
            bus_ok=data.draw(st.booleans()),
            invalid=data.draw(st.integers(0, 3)),
        )
        assert out == bench.safe and bench.trip is first
        bench.envelope.trip("another", "y", "later", 8)
        assert bench.trip is first


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300])
def test_a_measured_value_out_of_this_world_trips(value):
    bench = Bench()
    assert bench.check({"muscle_force_n": value}) == bench.safe
    assert bench.trip.cause == ("NaN" if value != value else "over-force")

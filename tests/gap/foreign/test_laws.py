"""Laws against formulas written here by hand, not by the code that fits them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from epa_rt.gap.likelihood.colour import LOWPASS_ORDER
from epa_rt.gap.recording import Recording
from epa_rt.gap.rig.foreign import servo_model
from epa_rt.gap.rig.foreign.chamber_laws import rate_pa_s
from epa_rt.gap.rig.foreign.law import kept, motion
from epa_rt.gap.rig.foreign.operators import carried, dahl, lugre, swung
from epa_rt.gap.rig.foreign.repeats import lap_differences, lap_samples
from epa_rt.gap.rig.foreign.signals import lagged, lowpass, shifted
from tests.gap.foreign.made import blank, one_trial, subject_of


def test_a_carriage_by_newtons_law():
    subject, rate = subject_of("carriage").evenly(), 1000.0
    t = np.arange(0.0, 10.0, 1.0 / rate)
    w = 2 * np.pi * 0.5
    place, speed, acceleration = (
        0.123 + 0.1 * np.sin(w * t),
        0.1 * w * np.cos(w * t),
        -0.1 * w * w * np.sin(w * t),
    )
    force = 80.0 * acceleration + 150.0 * speed + 12.0 * np.sign(speed) - 2.0
    made = Recording(
        "made",
        "",
        "emps",
        "",
        "",
        1.0 / rate,
        np.arange(len(t)),
        {"carriage_position_m": place, "motor_force_n": force},
        (),
    )
    ready = subject.prepare(made)
    truth = {
        "carriage.inertia_kg": 80.0,
        "friction.viscous_n_s_m": 150.0,
        "friction.coulomb_n": 12.0,
        "friction.offset_n": -2.0,
    }
    left = subject.residual(ready, truth, "force")
    assert np.nanstd(left) < 0.2 and np.isfinite(left).mean() > 0.95  # N, of forces to 90 N
    for key, other in (
        ("friction.coulomb_n", 11.0),
        ("carriage.inertia_kg", 79.0),
        ("friction.viscous_n_s_m", 145.0),
    ):
        assert np.nanstd(subject.residual(ready, {**truth, key: other}, "force")) > 0.6
    assert np.nanmean(
        subject.residual(ready, {**truth, "friction.offset_n": -2.5}, "force")
    ) == pytest.approx(0.5, abs=0.01)


@settings(max_examples=5, deadline=None, derandomize=True)
@given(rate=st.floats(2e-3, 0.1))
def test_a_chamber_that_leaks_exponentially(rate):
    subject = subject_of("chamber")
    t = np.arange(0.0, 60.0, 0.1)
    pressure = 101_325.0 + 7e5 * np.exp(-rate * t)
    made = Recording(
        "made",
        "",
        "sealed_chamber",
        "",
        "",
        0.1,
        np.arange(len(t)),
        {"chamber_pressure_pa": pressure},
        (),
    )
    ready = subject.prepare(made)
    left = subject.residual(
        ready, {"chamber.stand_leak_per_s": 0.0, "leak.linear_per_s": rate}, "pressure"
    )
    assert np.nanmax(np.abs(left)) < 30.0  # Pa, of 700 kPa
    run = subject.free_run(
        made, {"chamber.stand_leak_per_s": 0.0, "leak.linear_per_s": rate}, None
    ).columns["chamber_pressure_pa"]
    assert np.max(np.abs(run - pressure)) < 300.0


@pytest.mark.parametrize("power", [-0.5, -0.1, 0.0, 0.5])
def test_a_leak_by_a_power_of_the_pressure_ends_where_nothing_stands_over(power):
    over = np.array([-2e3, 0.0, 1.0, 5e5])
    subject = subject_of("chamber")
    rate = rate_pa_s(
        101_325.0 + over,
        {
            **subject.rig.settings,
            **subject.plant.numbers,
            "chamber.stand_leak_per_s": 0.0,
            "leak.power_per_s": 0.1,
            "leak.power_ratio": power,
        },
    )
    assert np.isfinite(rate).all() and rate[1] == 0.0 and rate[3] < -1e3


def test_a_servo_without_friction_answers_a_step_as_a_second_order_lag():
    gain, lag, count = 10.0, 0.02, 100
    numbers = np.zeros(servo_model.PLACES)
    numbers[servo_model.GAIN], numbers[servo_model.LAG] = gain, lag
    run = servo_model.run(np.ones(count), np.ones(count), np.zeros(count), numbers, 0.0, 0.02)
    poles = np.roots([lag, 1.0, gain])
    t = np.arange(1, count + 1) * 0.02
    answer = (
        1.0
        - (poles[1] * np.exp(poles[0] * t) - poles[0] * np.exp(poles[1] * t)).real
        / (poles[1] - poles[0]).real
    )
    assert np.max(np.abs(run - answer)) < 0.02


def test_friction_leaves_a_servo_standing_where_its_gain_no_longer_moves_it():
    numbers = np.zeros(servo_model.PLACES)
    numbers[servo_model.GAIN], numbers[servo_model.LAG], numbers[servo_model.COULOMB] = (
        10.0,
        0.02,
        0.2,
    )
    run = servo_model.run(np.full(300, 0.5), np.ones(300), np.zeros(300), numbers, 0.0, 0.02)
    assert run[-1] == run[-50] and 0.0 < 0.5 - run[-1] <= 0.02 + 1e-9


def test_dahl_and_lugre_reach_full_friction():
    moved = np.full(1000, 1e-5)
    assert dahl(moved, 1e-3)[-1] == pytest.approx(1.0 - np.exp(-10.0), rel=1e-6)
    assert lugre(np.full(1000, 0.01), 1e-3, 1e-3, 0.5, 0.02)[-1] == pytest.approx(
        1.0 + 0.5 * np.exp(-0.25), rel=1e-3
    )


@settings(max_examples=20, deadline=None)
@given(
    gap=st.floats(0.01, 1.5),
    dry=st.floats(0.0, 5.0),
    pull=st.floats(-2.0, 2.0),
    drag=st.floats(0.0, 3.0),
)
def test_a_load_in_a_gap_stays_in_it_and_has_its_speed_from_walls_and_friction_alone(
    gap, dry, pull, drag
):
    t = np.arange(0.0, 10.0, 1e-3)
    x = np.sin(2.0 * t) + 0.3 * np.sin(5.0 * t)
    walls = carried(x, 1e-3, gap, np.full(len(t), pull), np.full(len(t), dry), drag)
    place, speed = x[0], 0.0
    for k in range(len(t) - 1):
        free = speed - 1e-3 * (pull + drag * speed)
        speed = np.sign(free) * max(abs(free) - 1e-3 * dry, 0.0) + 1e-3 * walls[k]
        place += 1e-3 * speed
        assert abs(place - x[k + 1]) <= 0.5 * gap + 1e-9


@settings(max_examples=20, deadline=None)
@given(
    acceleration=st.floats(2.0, 200.0),
    speed=st.floats(0.3, 8.0),
    commands=st.lists(st.floats(-2.0, 2.0), min_size=1, max_size=6),
)
def test_a_planned_motion_keeps_its_limits_and_stops_at_its_command(acceleration, speed, commands):
    held = np.repeat(commands, 10)  # too short to arrive in
    rows = round((4.0 / speed + 4.0 * np.sqrt(4.0 / acceleration) + 1.0) / 0.02)
    asked = np.append(held, np.full(rows, commands[-1]))
    place = servo_model.profiled(asked, 1.0 / acceleration, 1.0 / speed, 0.0, 0.02)
    moved = np.diff(place, prepend=0.0) / 0.02
    assert np.max(np.abs(moved)) <= speed * (1.0 + 1e-9)
    assert np.max(np.abs(np.diff(moved))) <= 0.02 * acceleration * (1.0 + 1e-6) + 1e-6
    assert abs(place[-1] - asked[-1]) < 1e-6


def test_a_load_without_a_gap_moves_as_what_carries_it_and_one_within_it_stands():
    t = np.arange(0.0, 10.0, 1e-3)
    x, none = np.sin(2.0 * t), np.zeros(len(t))
    tight = carried(x, 1e-3, 1e-9, none, np.full(len(t), 0.7), 0.1)
    turned = np.sign(np.cos(2.0 * t))
    asked = -4.0 * np.sin(2.0 * t) + 0.7 * turned + 0.2 * np.cos(2.0 * t)
    off = np.abs(tight - asked)[1:-1]
    assert np.quantile(off, 0.99) < 2e-3 and off.max() < 1.5  # a row at each reversal
    assert not carried(x, 1e-3, 2.1, none, none, 0.0).any()


@settings(max_examples=20, deadline=None)
@given(
    lag_s=st.floats(4e-3, 4e-2),
    damping=st.floats(0.05, 0.5),
    drag=st.floats(0.0, 3.0),
    hertz=st.floats(0.5, 8.0),
)
def test_a_load_on_a_spring_swings_as_its_transfer_function_says(lag_s, damping, drag, hertz):
    """(1 + 2 D T s) / (1 + 2 D T s + T^2 s (s + drag)) from place to place."""
    t, s = np.arange(0.0, 20.0, 1e-3), 2j * np.pi * hertz
    moved, none = np.exp(s * t), np.zeros(len(t))
    found = swung((s * moved).real, (s**2 * moved).real, 1e-3, lag_s, damping, none, none, drag)
    follows = 1.0 + 2.0 * damping * lag_s * s
    loads = follows / (follows + lag_s**2 * s * (s + drag))
    asked = (s * (s + drag) * loads * moved).real
    late = t > 15.0  # what it began with has died away
    off = np.abs(found - asked)[late].max() / np.abs(asked)[late].max()
    assert off < 0.01 + 0.5 * abs(s) * 1e-3  # half a row


def test_a_load_on_a_stiff_spring_is_carried_rigidly_and_one_that_friction_holds_stands():
    t = np.arange(0.0, 10.0, 1e-3)
    x, v, a = np.sin(2.0 * t), 2.0 * np.cos(2.0 * t), -4.0 * np.sin(2.0 * t)
    none, dry = np.zeros(len(t)), np.full(len(t), 0.7)
    stiff = swung(v, a, 1e-3, 1e-3, 0.5, none, dry, 0.1)
    off = np.abs(stiff - (a + 0.7 * np.sign(v) + 0.1 * v))[10:-1]
    assert np.quantile(off, 0.98) < 0.01
    held = swung(v, a, 1e-3, 0.5, 0.1, none, np.full(len(t), 1e5), 0.0)
    assert held[5:] == pytest.approx((x / 0.25 + 2.0 * 0.1 / 0.5 * v)[5:], abs=0.02)


@settings(max_examples=20, deadline=None)
@given(delay=st.floats(-3.0, 3.0))
def test_a_delay_by_parts_of_a_sample(delay):
    k = np.arange(400)
    wave = np.sin(2 * np.pi * k / 40.0)
    assert np.allclose(
        shifted(wave, delay)[10:-10], np.sin(2 * np.pi * (k - delay) / 40.0)[10:-10], atol=5e-4
    )


def test_laps_are_found_by_the_motion_and_told_from_disturbed_ones():
    t = np.arange(0.0, 20.0, 0.01)
    motion = np.sin(2 * np.pi * t / 4.0) + 0.3 * np.sin(2 * np.pi * t / 2.0)
    noise = 1e-3 * np.random.default_rng(1).standard_normal((2, len(t)))
    assert lap_samples({"a": motion + noise[0], "b": 2.0 * motion + noise[1]}, 100.0) == 400
    assert lap_samples({"a": motion, "b": motion + np.sin(2 * np.pi * t / 3.1)}, 100.0) is None
    assert np.nanstd(lap_differences(noise[0] * 1e3, 400.0)) == pytest.approx(1.0, rel=0.1)


@settings(max_examples=6, deadline=None, derandomize=True)
@given(rows=st.floats(0.0, 3.0))
def test_dry_friction_of_a_piston_turns_round_late_by_parts_of_a_row(rows):
    subject, period_s = subject_of("piston").evenly(), 0.01
    delay_s, t = rows * period_s, np.arange(0.0, 40.0, 0.01)

    def place_m(t):
        return 0.017 - 0.015 * np.cos(2 * np.pi * 0.11 * t) + 0.002 * np.sin(2 * np.pi * 0.43 * t)

    def speed_m_s(t):
        return 0.015 * 2 * np.pi * 0.11 * np.sin(
            2 * np.pi * 0.11 * t
        ) + 0.002 * 2 * np.pi * 0.43 * np.cos(2 * np.pi * 0.43 * t)

    def over_pa(t):
        return 4e5 + 3e4 * np.sin(2 * np.pi * 0.3 * t)

    then = t - delay_s
    force = 5e-4 * over_pa(then) + 110.0 * speed_m_s(then) + 10.0 * np.sign(speed_m_s(then))
    names = subject.rig.channels
    made = one_trial(
        "made",
        subject.name,
        period_s,
        {
            names["position"]: place_m(t),
            names["pressure"]: 101_325.0 + over_pa(t),
            names["force"]: force,
        },
    )
    truth = {"piston.area_m2": 5e-4, "friction.viscous_n_s_m": 110.0, "friction.coulomb_n": 10.0}
    truth["sensor.force_delay_s"] = delay_s
    left_n = subject.residual(subject.prepare(made), truth, subject.links[0].name)
    assert np.nanstd(left_n) < 0.15  # where 10 N turn round in 17 of 4000 rows


@pytest.mark.parametrize("kind", ["carriage", "piston"])
def test_what_is_kept_of_a_motion_is_what_would_be_made_anew(kind):
    """Of every two effects, in an order in which each is on, beside another, and off again."""
    subject, made = subject_of(kind).evenly(), blank(kind)
    (link,) = subject.links
    ready, random = subject.prepare(made), np.random.default_rng(0)
    starts = [dict(zip(one.knobs, one.starts[0], strict=True)) for one in subject.catalogue]
    for a, b in random.integers(len(starts), size=(40, 2)):
        for values in (starts[a], {**starts[a], **starts[b]}, starts[b], {}):
            again = subject.residual(subject.prepare(made), values, link.name)
            left = subject.residual(ready, values, link.name)
            assert np.array_equal(left, again, equal_nan=True), values


def test_a_law_is_asked_again_where_any_number_that_it_has_read_is_another():
    asked = []

    def force_n(m, n):
        asked.append(n["a"])
        return n["a"] * m.speed_m_s if n["a"] != 0.0 else n["b"] * m.speed_m_s

    place_m = np.linspace(0.0, 1.0, 20) ** 2
    m = motion(place_m, place_m, 100.0, 0.1, 0.0, 1.0, False)
    for a, b, times in ((1.0, 0.0, 1), (1.0, 5.0, 1), (0.0, 5.0, 2), (0.0, 6.0, 3), (1.0, 7.0, 3)):
        n = {"a": a, "b": b}
        assert np.array_equal(kept(force_n, m, n), (a or b) * m.speed_m_s)
        assert len(asked) == times


@settings(deadline=None)  # compiled at first use
@given(rows=st.integers(16, 300), hertz=st.floats(0.5, 49.5), seed=st.integers(0, 9))
def test_the_low_pass_is_scipy_s_forth_and_back_to_the_bit(rows, hertz, seed):
    values = np.random.default_rng(seed).standard_normal(rows)
    sections = signal.butter(LOWPASS_ORDER, hertz / 50.0, output="sos")
    made = lowpass(values, 100.0, hertz)
    assert np.array_equal(made, signal.sosfiltfilt(sections, values))


@given(st.floats(0.05, 40.0), st.floats(-3.0, 3.0), st.floats(-0.5, 0.5))
def test_a_lag_is_exact_on_a_line_and_begins_settled(lag_samples, level, rise):
    still = np.full(50, level)
    assert lagged(still, lag_samples) == pytest.approx(still)
    line = level + rise * np.arange(30.0 * lag_samples + 10.0)
    assert lagged(line, lag_samples)[-1] == pytest.approx(line[-1] - rise * lag_samples, abs=1e-6)


@given(st.floats(1.0, 20.0), st.floats(0.001, 0.02))
def test_a_lag_is_undone_by_its_slope(lag_samples, cycles_per_sample):
    asked = np.sin(2.0 * np.pi * cycles_per_sample * np.arange(1200.0))
    behind = lagged(asked, lag_samples)
    again = behind + lag_samples * np.gradient(behind)
    assert again[600:-1] == pytest.approx(asked[600:-1], abs=0.02)

"""Narrow lines on raw channels: found with frequency and amplitude, taken out; never made of noise,
of what was commanded, or of what turns.
"""

import dataclasses
import re
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from epa_rt.gap.finding import Finding
from epa_rt.gap.hygiene.answering import terms_of_motion
from epa_rt.gap.hygiene.check import check, clean
from epa_rt.gap.hygiene.lines import check_lines
from epa_rt.gap.recording import Recording
from tests.gap.foreign.made import one_trial
from tests.gap.recorded import column, recording_of, rig_of_name

PERIOD_S, N = 1e-3, 6000
T = np.arange(N) * PERIOD_S
FORCE, PLACE, ASKED = "muscle_force_n", "motor_travel_m", "cmd_motor_travel_m"
SAYS = re.compile(r"(\S+) carries a line (?:of|seen at) (\S+) Hz.*?, (\S+) ± (\S+) N amplitude")


def log(name: str = "log", period_s: float = PERIOD_S, **columns: np.ndarray) -> Recording:
    return one_trial(name, "rig", period_s, columns)


def noise(seed: int, rows: int = N) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal(rows)


def hum(hertz: float, amplitude: float = 3.0, phase: float = 0.3, t: np.ndarray = T) -> np.ndarray:
    return amplitude * np.sin(2.0 * np.pi * hertz * t + phase)


def said(findings: Sequence[Finding]) -> tuple[str, float, float, float]:
    """(channel, Hz, amplitude, its deviation) of the one line that is found."""
    (says,) = {one.says for one in findings}
    name, *numbers = SAYS.match(says).groups()
    return (name, *map(float, numbers))


def hertz_of(findings: Sequence[Finding], period_s: float = PERIOD_S) -> float:
    return findings[0].sinusoids[0].frequency / period_s


@settings(max_examples=25, deadline=None)
@given(
    hertz=st.floats(15.0, 480.0),
    amplitude=st.floats(1.2, 100.0),
    phase=st.floats(0.0, 6.3),
    seed=st.integers(0, 10**6),
)
def test_any_line_in_noise_is_found_where_it_is_and_as_large_as_it_is(
    hertz, amplitude, phase, seed
):
    found = check_lines([log(muscle_force_n=hum(hertz, amplitude, phase) + noise(seed))])
    name, _, size, deviation = said(found)
    assert name == FORCE and abs(hertz_of(found) - hertz) < 1.0 / (N * PERIOD_S)
    assert abs(size - amplitude) < 5.0 * deviation
    assert deviation < 3.0 * np.sqrt(2.0 / N)  # thrice what noise of that size allows at best


def test_the_deviation_that_is_said_is_that_of_the_amplitude():
    off = []
    for seed in range(60):
        made = log(muscle_force_n=hum(50.0, 3.0, seed) + noise(seed))
        _, _, size, deviation = said(check_lines([made]))
        off.append((size - 3.0) / deviation)
    assert 0.7 < np.sqrt(np.mean(np.square(off))) < 1.3


@pytest.mark.parametrize("dither", [0.0, 0.15, 0.5])
def test_on_a_coarse_channel_the_steps_are_in_the_deviation(dither):
    off, random = [], np.random.default_rng(7)
    for seed in range(40):
        size, place = random.uniform(1.3, 6.0), random.uniform(0.0, 1.0)
        values = np.round(
            hum(random.uniform(20.0, 450.0), size, seed) + place + dither * noise(seed)
        )
        _, _, found, deviation = said(check_lines([log(muscle_force_n=values)])[:1])
        off.append((found - size) / deviation)
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.5


def test_noise_of_any_colour_has_no_line():
    """A hundred and twenty channels, of which one would be enough in a thousand sets."""
    colours = [
        ([1.0], [1.0]),
        ([1.0], [1.0, -0.95]),
        ([1.0], [1.0, -1.0]),
        ([1.0, -1.0], [1.0, 0.5]),
        ([1.0], [1.0, -2.0 * 0.99 * np.cos(0.5), 0.99**2]),  # rings for 0.1 s
        ([1.0], [1.0, -2.0 * 0.998 * np.cos(0.3), 0.998**2]),  # rings for half a second
    ]
    made = [
        log(muscle_force_n=lfilter(b, a, noise(100 * k + i)))
        for i, (b, a) in enumerate(colours)
        for k in range(20)
    ]
    assert [one.says for recording in made for one in check_lines([recording])] == []


@pytest.mark.parametrize("factor", [4.4482216, 1e-3, 1e5])
def test_units_change_the_amplitude_and_nothing_else(factor):
    values = hum(50.0) + noise(1)
    one = check_lines([log(muscle_force_n=values)])
    other = check_lines([log(muscle_force_n=factor * values)])
    assert hertz_of(other) == pytest.approx(hertz_of(one), rel=1e-9)
    assert said(other)[2:] == pytest.approx([factor * x for x in said(one)[2:]], rel=0.05)


def test_one_log_and_two_halves_of_it_say_the_same():
    t = np.arange(4 * N) * PERIOD_S
    values = hum(50.0, t=t) + noise(2, 4 * N)
    whole = check_lines([log(muscle_force_n=values)])
    halves = check_lines(
        [log("a", muscle_force_n=values[: 2 * N]), log("b", muscle_force_n=values[2 * N :])]
    )
    assert [one.log for one in halves] == ["a", "b"] and "in all logs" in halves[0].says
    assert hertz_of(halves) == pytest.approx(hertz_of(whole), abs=0.02)
    assert said(halves)[2] == pytest.approx(said(whole)[2], abs=0.05)


def test_the_logs_that_have_it_are_named():
    logs = [log(n, muscle_force_n=noise(i) + (i > 0) * hum(23.4)) for i, n in enumerate("abc")]
    found = check_lines([*logs, log("d", muscle_force_n=noise(9, 300))])
    assert [one.log for one in found] == ["b", "c"] and "in b, c; " in found[0].says
    assert "(d: too short or too torn to tell)" in found[0].says


def moving(asked: np.ndarray, seed: int = 0, force: np.ndarray | float = 0.0) -> Recording:
    """A travel that follows late, with a force that is not linear in it."""
    travel = np.roll(asked, 7)
    pull = 3e4 * travel + 2e6 * travel**2 + 5e8 * travel**3 + 20.0 * np.sign(np.gradient(travel))
    return log(
        cmd_motor_travel_m=asked,
        motor_travel_m=travel + 1e-6 * noise(seed),
        muscle_force_n=pull + force + 0.5 * noise(seed + 1),
    )


COMMANDED = {
    "sine": hum(12.0, 5e-3),
    "slow sine": hum(1.5, 5e-3),
    "chirp": 5e-3 * np.sin(2.0 * np.pi * (5.0 * T + 3.0 * T**2)),
    "multisine": sum(hum(f, 1e-3, f**2) for f in (6.0, 10.0, 15.0, 21.0)),
    "steps": 5e-3 * np.sign(np.sin(2.0 * np.pi * 2.0 * T)),
}


@pytest.mark.parametrize("motion", COMMANDED)
def test_what_is_commanded_and_what_answers_to_it_is_no_line(motion):
    assert [one.says for one in check_lines([moving(COMMANDED[motion])])] == []


@pytest.mark.parametrize("size", [20.0, 5.0])
@pytest.mark.parametrize("motion", COMMANDED)
def test_hum_beside_a_motion_is_found(motion, size):
    found = check_lines([moving(COMMANDED[motion], force=hum(77.3, size))])
    assert said(found)[0] == FORCE and hertz_of(found) == pytest.approx(77.3, abs=0.05)


def test_a_limit_cycle_is_no_line():
    """Of the loop (it is in the command), and of a rig whose commands nobody recorded."""
    loop = {PLACE: hum(17.0, 1e-3) + 1e-5 * noise(3), FORCE: hum(17.0, 30.0, 1.0) + noise(4)}
    assert check_lines([log(**loop, cmd_motor_travel_m=hum(17.0, 1e-3, 2.0))]) == []
    assert check_lines([log(**loop)]) == []


def test_what_lasts_for_a_trial_alone_is_no_line():
    assert check_lines([log(muscle_force_n=noise(5) + (T > 3.0) * hum(50.0))]) == []


def turning(speed_rad_s: np.ndarray, name: str, seed: int) -> Recording:
    """A shaft with cogging 36 times a turn."""
    angle = np.cumsum(speed_rad_s) * PERIOD_S
    return log(
        name,
        shaft_angle_rad=angle + 1e-3 * noise(seed),
        brake_force_n=3.0 * np.sin(36.0 * angle) + noise(seed + 1),
    )


def test_cogging_is_no_line_and_at_one_speed_it_is_said_and_kept():
    assert check_lines([turning(5.0 + 3.0 * np.sin(2.0 * np.pi * 0.4 * T), "a", 6)]) == []
    (one,) = check_lines([turning(np.full(N, 9.0), "a", 7)])
    assert (one.severity, one.sinusoids) == ("note", ())
    assert "it is kept, as it may turn with shaft_angle_rad" in one.says
    both = [turning(np.full(N, speed), name, 8) for speed, name in ((9.0, "a"), (11.0, "b"))]
    assert [one.sinusoids for one in check_lines(both)] == [(), ()]


def test_at_a_low_rate_it_may_be_an_alias():
    t = np.arange(N) * 0.01
    (one,) = check_lines([log("log", 0.01, muscle_force_n=hum(60.0, t=t) + noise(10))])
    assert "a line seen at 40.0 Hz (may be an alias), " in one.says
    assert "(mains hum of 60 Hz?)" in one.says


def test_what_is_smaller_than_the_noise_or_a_step_is_left_in():
    assert check_lines([log(muscle_force_n=hum(50.0, 0.5) + noise(11))]) == []
    steps = np.round(hum(50.0, 0.8) + 0.3 * noise(12))
    assert check_lines([log(muscle_force_n=steps)]) == []


def test_cycles_that_go_back_or_leap_are_no_reason_to_fall_over():
    made = log("a", muscle_force_n=hum(50.0) + noise(13))
    for cycle in (made.cycle[::-1].copy(), made.cycle * 10**9):
        assert check_lines([dataclasses.replace(made, cycle=cycle)]) == []
    lost = dataclasses.replace(made, cycle=made.cycle + (made.cycle > 3000) * 40)
    lost.columns[FORCE][:] = hum(50.0, t=lost.cycle * PERIOD_S) + noise(13)
    (one,) = check_lines([lost])
    (cleaned,) = clean([lost], [one])
    left = cleaned.columns[FORCE][np.isfinite(cleaned.columns[FORCE])] - noise(13)
    assert len(left) == N and np.std(left) < 0.05


@pytest.mark.parametrize("value", [0.0, 0.1, 730000.3])
def test_a_motion_that_stands_still_answers_for_nothing(value):
    still, force = np.full(N, value), hum(50.0) + noise(14)
    (alone,) = check_lines([log(muscle_force_n=force)])
    (beside,) = check_lines([log(muscle_force_n=force, motor_travel_m=still)])
    assert beside.says == alone.says
    made = log(muscle_force_n=force, motor_travel_m=still, ref_motor_travel_m=hum(0.5))
    with_still = terms_of_motion(made, [PLACE, "ref_motor_travel_m"])
    assert np.array_equal(with_still, terms_of_motion(made, ["ref_motor_travel_m"]))


def test_a_sound_log_of_the_bench_stays_as_it_is_bit_for_bit():
    sound, rig = recording_of("bench", "identification_short"), rig_of_name("bench")
    (cleaned,) = clean([sound], check([sound], rig))
    for name, values in sound.columns.items():
        assert cleaned.columns[name].tobytes() == values.tobytes()


def test_hum_on_a_log_of_the_bench_is_said_first_and_only_it_is_taken_out():
    sound, rig = recording_of("bench", "identification_short"), rig_of_name("bench")
    t = sound.cycle * sound.period_s
    step = np.min(np.diff(np.unique(sound.columns[FORCE])))
    added = np.round((sound.columns[FORCE] + hum(50.0, 3.0, t=t)) / step) * step
    hummed = column(sound, FORCE, added)
    findings = check([hummed], rig)
    assert findings[0].kind == "line" and len(findings) == 1
    assert "muscle_force_n carries a line of 50.0 Hz, " in findings[0].says
    assert said(findings)[2] == pytest.approx(3.0, abs=0.05)
    (cleaned,) = clean([hummed], findings)
    assert cleaned.found == (findings[0].says,)
    for name, values in sound.columns.items():
        off = np.where(np.isnan(values), 0.0, cleaned.columns[name] - values)
        assert np.array_equal(off, np.zeros(len(off))) or (
            name == FORCE and np.std(off) < step / np.sqrt(12.0) + 0.05
        )
    assert check_lines([cleaned]) == []

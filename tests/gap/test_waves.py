"""Number of periods of a wave over an angle, found from the residual, on a made-up shaft."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.gap.likelihood.floor import Floor
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import refit, settled
from epa_rt.gap.likelihood.screen import starts
from epa_rt.gap.likelihood.waves import APART_RAD, FAST, FINEST, SLOW, grid, look
from epa_rt.gap.recording import Recording, Span
from epa_rt.gap.subject import Link, Plain
from epa_rt.models.effect import Effect, Knob

RATE_HZ, NOISE_NM = 100.0, 0.01
KNOBS = {
    k.key: k
    for k in (
        Knob("drive.viscous", "", 0.1, 0.0, 1.0, 0.02),
        Knob("drive.wave", "", 0.0, -1.0, 1.0, 0.1, "wave"),
        Knob("drive.per_turn", "", 1.0, 0.01, 200.0, 1.0, "wave"),
        Knob("drive.phase", "", 0.0, -6.3, 6.3, 1.0, "wave"),
    )
}


class Shaft(Plain):
    """A torque over a shaft's angle: viscous, and a wave."""

    name, rate_hz, without_stop, knobs = "shaft", RATE_HZ, True, KNOBS
    links = (Link("torque", "drive", "torque_nm", "N*m", "speed to torque"),)
    nominal = (KNOBS["drive.viscous"],)

    def __init__(self, angle: str = "angle_rad") -> None:
        knobs = ("drive.wave", "drive.per_turn", "drive.phase")
        self.catalogue = (
            Effect(
                "wave",
                "wave",
                "drive",
                knobs,
                ((0.1, 1.0, 0.0), (0.1, 1.0, 2.1)),
                "",
                "",
                "",
                angle,
            ),
        )

    def touched(self, key):
        return ("torque",)

    def prepare(self, recording):
        return recording

    def residual(self, prepared, values, link):
        return prepared.columns["torque_nm"] - torque(prepared.columns, values)

    def features(self, prepared, link):
        return {"angle_rad": prepared.columns["angle_rad"]}


def torque(c, values) -> np.ndarray:
    v = {key: values.get(key, knob.value) for key, knob in KNOBS.items()}
    return v["drive.viscous"] * c["speed_rad_s"] + v["drive.wave"] * np.sin(
        v["drive.per_turn"] * c["angle_rad"] + v["drive.phase"]
    )


def held(
    per_turn: float, phase: float, reach_rad: float = 25.0, angle: str = "angle_rad"
) -> Problem:
    """A shaft that goes to and fro over ``reach_rad``, with a wave of three times the noise."""
    time = np.arange(3000) / RATE_HZ
    angle_rad = 0.5 * reach_rad * (1.0 - np.cos(0.6 * time) * np.cos(0.05 * time))
    columns = {"angle_rad": angle_rad, "speed_rad_s": np.gradient(angle_rad) * RATE_HZ}
    columns["torque_nm"] = torque(
        columns, {"drive.wave": 0.03, "drive.per_turn": per_turn, "drive.phase": phase}
    )
    columns["torque_nm"] += np.random.default_rng(1).normal(0.0, NOISE_NM, len(time))
    log = Recording(
        "log",
        "",
        "shaft",
        "",
        "",
        1.0 / RATE_HZ,
        np.arange(len(time)),
        columns,
        (Span("trial 0", 0, len(time), True),),
    )
    return Problem(
        Shaft(angle), [log], {"torque": Floor("torque", NOISE_NM, np.zeros(0), NOISE_NM)}
    )


@settings(max_examples=12, deadline=None)
@given(st.one_of(st.floats(0.15, 1.1), st.integers(2, FAST).map(float)), st.floats(-3.0, 3.0))
def test_number_of_periods_is_found_whatever_the_phase_and_a_fit_from_there_arrives(
    per_turn, phase
):
    problem = held(per_turn, phase)
    base = settled(problem)
    look(problem, base)
    (start,) = problem.waves["wave"]
    assert start["drive.per_turn"] == pytest.approx(per_turn, abs=APART_RAD / 25.0)
    assert start["drive.wave"] == pytest.approx(0.03, rel=0.4)
    fit = refit(problem, base, "wave", start, rounds=20)
    assert abs(fit.values["drive.per_turn"]) == pytest.approx(per_turn, abs=0.01)
    assert fit.chi == pytest.approx(problem.samples("torque"), rel=0.1)


def test_without_the_look_a_fit_finds_no_wave_of_another_number_of_periods():
    problem = held(0.16, 1.0)
    base = settled(problem)
    found = [
        refit(problem, base, "wave", start, rounds=20).chi for start in starts(problem, "wave")
    ]
    look(problem, base)
    assert refit(problem, base, "wave", problem.waves["wave"][0], rounds=20).chi < 0.7 * min(found)


def test_what_is_found_is_a_start_of_the_effect_here_and_on_other_recordings_and_the_last_start_stays_the_weak_one():  # noqa: E501
    problem = held(0.4, 0.0)
    look(problem, settled(problem))
    names = starts(problem, "wave")
    assert (
        problem.waves["wave"][0] in names
        and names[0]["drive.per_turn"] == 1.0
        and names[-1]["drive.wave"] < 0.1
    )
    assert starts(problem.on(problem.recordings), "wave") == names


def test_no_number_of_periods_outside_of_its_bounds_is_a_start():
    problem = held(0.4, 0.0)
    problem.knobs = {**KNOBS, "drive.per_turn": KNOBS["drive.per_turn"]._replace(low=1.0)}
    look(problem, settled(problem))
    assert problem.waves["wave"][0]["drive.per_turn"] >= 1.0


def test_a_log_that_is_set_aside_is_not_looked_at_however_far_it_goes():
    seen, further = (held(7.0, 0.3, reach_rad=reach).recordings[0] for reach in (25.0, 30.0))
    unjudged = further.columns | {"torque_nm": np.full(further.samples, np.nan)}
    aside = replace(further, name="aside", columns=unjudged)
    floors = {"torque": Floor("torque", NOISE_NM, np.zeros(0), NOISE_NM)}
    problem = Problem(Shaft(), [seen, aside], floors)
    look(problem, settled(problem))
    assert problem.waves["wave"][0]["drive.per_turn"] == 7.0


@pytest.mark.parametrize(
    "problem",
    [held(0.4, 0.0, angle="another_angle_rad"), held(0.4, 0.0, reach_rad=0.0)],
    ids=["no link sees the angle", "it stands still"],
)
def test_an_angle_that_nothing_shows_gives_no_start(problem):
    look(problem, settled(problem))
    assert problem.waves["wave"] == ()


@given(st.floats(1e-3, 1e5))
def test_grid_goes_from_half_a_period_to_poles_and_slots_and_stays_small(range_rad):
    tried = grid(range_rad)
    assert np.all(np.diff(tried) > 0.0) and len(tried) <= SLOW / FINEST + FAST
    assert np.all(tried * range_rad >= np.pi - 1e-9) and (
        range_rad < np.pi / FAST or tried[-1] == FAST
    )

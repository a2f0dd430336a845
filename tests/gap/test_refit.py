"""Whitened problem, signatures, refits and what they are judged by, on the made-up rig."""

import numpy as np
import pytest

from epa_rt.gap.answer.named import moved
from epa_rt.gap.diagnosis import Number
from epa_rt.gap.held_out.aside import split
from epa_rt.gap.likelihood.intervals import intervals
from epa_rt.gap.likelihood.point import linearised
from epa_rt.gap.likelihood.problem import FOLDS, Problem
from epa_rt.gap.likelihood.refit import refit, settled
from epa_rt.gap.likelihood.screen import amplitudes, scaled, screen
from tests.gap import toy

TRUE = {"drive.gain_a": 1.03, "spring.dahl_n": 1.5, "spring.dahl_m": 4e-3}


@pytest.fixture(scope="module")
def problem() -> Problem:
    data = [toy.recording(f"log{i}", 50 + i, TRUE) for i in range(2)]
    return Problem(toy.Toy(), data, toy.floors(None, data, {}))


@pytest.fixture(scope="module")
def base(problem):
    return settled(problem)


def test_residual_is_unit_noise_where_the_model_is_right(problem):
    for link in problem.links:
        assert problem.residual(TRUE, link).std() == pytest.approx(1.0, abs=0.05)


def test_blocks_cover_every_sample_once_and_folds_are_whole_trials(problem):
    for link in problem.links:
        assert problem.edges[link][0] == 0 and problem.edges[link][-1] == problem.samples(link)
    assert set(problem.fold_of_block) == set(range(FOLDS))
    assert problem.blocks == len(problem.fold_of_block)


def test_a_law_without_a_finite_value_beside_a_number_leads_nowhere(problem, monkeypatch):
    here = problem.residual({}, "gas")
    monkeypatch.setattr(problem, "change", lambda *_: np.where(here > 0.0, np.nan, 1.0))
    assert not problem.derivative({}, "gas.leak_ratio", "gas", here).any()


@pytest.mark.parametrize(("half_n_m", "went"), [(200.0, True), (900.0, False)])
def test_a_nominal_parameter_that_the_logs_do_not_know_is_not_said_to_be_wrong(
    problem, half_n_m, went
):
    key = "spring.stiffness_n_m"  # 900 in the plant file
    normal = linearised(problem, (), {key: 180.0}).normal
    one = Number(key, 180.0, "N/m", 180.0 - half_n_m, 180.0 + half_n_m, 900.0)
    assert bool(moved(problem, normal, [one])) is went


def test_nominal_parameters_are_found_where_no_effect_hides_them(problem, base):
    assert base.values["drive.gain_a"] == pytest.approx(1.03, abs=2e-3)


def test_refit_from_a_typical_strength_finds_the_truth_and_lowers_chi_square(problem, base):
    fit = refit(problem, base, "dahl", {"spring.dahl_n": 2.0, "spring.dahl_m": 2e-3}, rounds=20)
    assert fit.values["spring.dahl_n"] == pytest.approx(1.5, rel=0.03)
    assert fit.values["spring.dahl_m"] == pytest.approx(4e-3, rel=0.05)
    assert fit.chi == pytest.approx(sum(problem.samples(link) for link in problem.links), rel=0.05)
    assert fit.normal.chi == pytest.approx(fit.chi)
    assert fit.chi < base.normal.chi


def test_knobs_that_move_residuals_in_proportion_need_their_derivatives_once(monkeypatch):
    values = {"drive.gain_a": 1.03, "spring.cubic_n_m3": -2e5}
    logs = [toy.recording(f"log{i}", 60 + i, values) for i in range(2)]
    problem = Problem(toy.Toy(), logs, toy.floors(None, logs, {}))
    point, asked = settled(problem), []
    derivative = problem.derivative
    monkeypatch.setattr(
        problem, "derivative", lambda *given: asked.append(given[1]) or derivative(*given)
    )
    start = {"spring.cubic_n_m3": 0.0}
    anew = refit(problem, point, "hardening", start)
    often, asked[:] = len(asked), []
    kept = refit(problem, point, "hardening", start, in_proportion=True)
    assert len(asked) == len(problem.touched(start)) < often
    assert kept.values["spring.cubic_n_m3"] == pytest.approx(-2e5, rel=0.02)
    assert kept.values == pytest.approx(anew.values, rel=1e-3)
    assert kept.chi == pytest.approx(anew.chi, rel=1e-4)
    assert kept.normal.chi == pytest.approx(kept.chi)


def test_linearised_loss_is_exact_at_the_point_itself_and_worse_on_data_left_out(base, problem):
    normal = base.normal
    assert np.allclose(normal.loss(np.zeros(len(normal.keys))), normal.square)
    assert normal.left_out(problem.fold_of_block).sum() > normal.square.sum()


def test_interval_holds_the_truth(problem, base):
    width = intervals(base.normal, ["drive.gain_a"])["drive.gain_a"] * problem.spread(
        "drive.gain_a"
    )
    assert 0.0 < width < 0.01
    assert abs(base.values["drive.gain_a"] - 1.03) < 2.0 * width


def test_signature_of_the_truth_gains_most_and_other_links_have_no_part_in_it(problem, base):
    screening = screen(problem, base)
    best = screening.best()
    assert max(best, key=lambda name: best[name].gain) == "dahl"
    assert (
        screening.cosine("force_offset", "pressure_offset") > 0.1 > screening.cosine("dahl", "leak")
    )
    assert screening.typical()["leak"] < 40.0 < screening.typical()["valve_delay"]


def test_strength_scales_and_shape_stays(problem):
    start = {"drive.cogging_a": 0.1, "drive.cogging_per_m": 250.0}
    assert problem.strength("cogging") == ("drive.cogging_a",)
    assert scaled(problem, "cogging", start, 0.3) == pytest.approx(
        {"drive.cogging_a": 0.03, "drive.cogging_per_m": 250.0}
    )
    assert amplitudes(problem, "cogging", start)[0] == 0.0
    assert amplitudes(problem, "hardening", {"spring.cubic_n_m3": 5e5})[0] < 0.0


def test_trials_set_aside_are_judged_by_one_half_alone():
    data = [toy.recording("log", 3)]
    fitted, judged = split(toy.Toy(), data)
    a, b = (part.residual(part.prepare(data[0]), {}, "drive") for part in (fitted, judged))
    assert not np.any(np.isfinite(a) & np.isfinite(b))
    assert np.isfinite(b).sum() == len(b) // 4

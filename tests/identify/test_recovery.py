"""Known numbers come back: within 2 % from clean trials, inside their intervals from noisy ones."""

import numpy as np
import pytest

from epa_rt.identify.data import normalisation, pressures
from epa_rt.identify.gas import fit_gas
from epa_rt.identify.identify import Asked, identify_trials
from epa_rt.identify.linear import scaled, sums
from epa_rt.identify.models import BY_NAME, POLYNOMIAL
from epa_rt.identify.physical import MODELS, fit_physical, predicted
from epa_rt.identify.scores import score
from epa_rt.models.knobs import read_knob
from tests.identify.made import EQ8, SLIP, made, params

HELD = {
    "muscle0.braid_turns_ratio": 2.9,
    "muscle0.viscous_n_s_m": 20.0,
    "muscle0.slip_ratio": 0.05,
    "muscle0.end_length_m": 0.8e-3,
    "muscle0.bladder_stiffness_n_m": 300.0,
    "muscle0.lock_stiffness_n_m": 15e3,
    "muscle0.lock_length_m": 0.144,
}


def polynomial_of(trials):
    believed = params()
    norm = normalisation(believed)
    data = [scaled(trial, norm, 0.2078, 3.05) for trial in trials]
    return score(
        BY_NAME[POLYNOMIAL], sums(BY_NAME[POLYNOMIAL], data, 1e-3), pressures(trials), norm
    )[1]


def test_the_polynomial_comes_back_from_clean_trials():
    found = polynomial_of(made(params(EQ8)))
    for i, value in enumerate(found.coefficients.values(), start=1):
        assert value == pytest.approx(EQ8[f"muscle0.poly_c{i}_ratio"], rel=0.02)
    assert found.r2 > 0.9999 and found.rms_n < 0.1


@pytest.mark.parametrize(
    ("model", "truth"),
    [(MODELS[0], SLIP), (MODELS[1], HELD)],
    ids=lambda x: getattr(x, "name", "truth"),
)
def test_a_physical_muscle_comes_back_from_clean_trials(model, truth):
    trials = made(params(truth))
    fit = fit_physical(
        model,
        params({"muscle0.viscous_n_s_m": 5.0, "muscle0.braid_turns_ratio": 3.3}),
        trials,
        pressures(trials),
    )
    for key in model.keys:
        expected = truth.get(key, read_knob(params(), key))
        assert fit.score.coefficients[key] == pytest.approx(expected, rel=0.02), key
    assert fit.at_bound == () and fit.score.hysteresis == pytest.approx(1.0, abs=0.01)


def test_a_physical_model_left_out_in_its_linearisation_is_as_good_as_refitted():
    trials = made(params(SLIP | {"muscle0.dahl_ratio": 0.05, "muscle0.dahl_m": 3e-3}), noise_n=1.0)
    groups = pressures(trials)
    judged = fit_physical(MODELS[0], params(), trials, groups).score
    error = 0.0
    for _k, one in enumerate(trials):
        rest = [t for t in trials if t is not one]
        error += float(
            np.sum(
                (
                    one.force_n
                    - predicted(
                        fit_physical(MODELS[0], params(), rest, pressures(rest), "none").params, one
                    )
                )
                ** 2
            )
        )
    assert judged.rms_trial_n == pytest.approx(
        np.sqrt(error / sum(t.samples for t in trials)), rel=0.02
    )
    assert judged.rms_trial_n > judged.rms_n


def test_intervals_hold_the_truth_although_the_noise_has_memory():
    inside = []
    for seed in range(8):
        found = polynomial_of(made(params(EQ8), 2, 16.0, 2.4, 1.5, seed))
        inside += [
            low <= EQ8[f"muscle0.poly_c{i}_ratio"] <= high
            for i, (low, high) in enumerate(found.intervals.values(), start=1)
        ]
    assert np.mean(inside) > 0.8, "40 intervals of 95 %; 100 repeats are in docs/identification.md"


def test_white_noise_intervals_would_be_too_narrow():
    """What blocks are for: the same trials, judged as if every sample were its own."""
    trials = made(params(EQ8), 2, 16.0, 0.0, 3.0)
    found, norm = polynomial_of(trials), normalisation(params())
    data = sums(BY_NAME[POLYNOMIAL], [scaled(t, norm, 0.2078, 3.05) for t in trials], 1e-3)
    white = np.sqrt(np.diag(np.linalg.inv(data.matrix.sum(axis=0)))) * found.rms_n / norm.force_n
    wide = np.array([high - low for low, high in found.intervals.values()])
    assert np.all(wide > 3.0 * 2.0 * white)


def test_damping_and_loops_are_measured():
    trials = made(params(SLIP | {"muscle0.slip_ratio": 0.0}))
    answer, _ = identify_trials(trials, params(), Asked(physical=False, terms=False))
    by_name = {s.name: s for s in answer.scores}
    assert (
        by_name["polynomial"].damping_n_s_m == pytest.approx(25.0, rel=0.1)
        and by_name["polynomial"].has_hysteresis
    )
    assert (
        by_name["static, geometry"].damping_n_s_m == 0.0
        and not by_name["static, geometry"].has_hysteresis
    )
    assert by_name["Tang, geometric"].hysteresis == pytest.approx(1.0, abs=0.1)


def test_b_and_n_come_back_from_a_muscle_without_friction():
    trials = made(params({"muscle0.viscous_n_s_m": 0.0, "muscle0.braid_turns_ratio": 2.5}))
    answer, _ = identify_trials(trials, params(), Asked(physical=False, terms=False))
    assert answer.geometry == pytest.approx((0.2078, 2.5), rel=1e-3)


def test_the_gas_comes_back():
    gas = fit_gas(made(params()), 0.2078, 3.05, 0.0)
    assert (
        gas.polytropic_ratio == pytest.approx(1.2, rel=1e-3)
        and gas.r2 > 0.9999 > 0.99 > gas.r2_boyle
    )

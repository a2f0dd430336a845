"""What is said of a fit: held-out scores, loops, terms, remarks."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.identify.answer import as_json
from epa_rt.identify.data import (
    IdentifyError,
    closed_path,
    normalisation,
    pressures,
    remarks,
    renewed,
)
from epa_rt.identify.identify import Asked, identify_trials
from epa_rt.identify.linear import fit, predicted, scaled, sums
from epa_rt.identify.models import BY_NAME, MODELS, TANG_ALL
from epa_rt.identify.scores import score
from epa_rt.identify.selection import all_terms, effective_samples, select_terms
from tests.identify.made import EQ8, SLIP, made, params


@pytest.fixture(scope="module")
def trials():
    return made(params(SLIP), noise_n=2.4)


@pytest.fixture(scope="module")
def data(trials):
    return [scaled(trial, normalisation(params()), 0.2078, 3.05) for trial in trials]


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_scores_from_normal_equations_are_those_of_the_samples(model, trials, data):
    norm = normalisation(params())
    fitted, judged = score(model, sums(model, data, 1e-3), pressures(trials), norm)
    force, made_n = (
        np.concatenate([d.f for d in data]),
        np.concatenate([predicted(model, fitted, d) for d in data]),
    )
    assert judged.r2 == pytest.approx(
        1.0 - np.sum((force - made_n) ** 2) / np.sum((force - force.mean()) ** 2), abs=1e-9
    )
    assert judged.rms_n == pytest.approx(
        np.sqrt(np.mean((force - made_n) ** 2)) * norm.force_n, rel=1e-6
    )
    works = [(predicted(model, fitted, d) @ closed_path(d.l), d.f @ closed_path(d.l)) for d in data]
    assert np.array(judged.loop_work_j) == pytest.approx(
        np.array(works) * norm.force_n * norm.length_m, rel=1e-6, abs=1e-9
    )


def test_left_out_is_fitted_on_the_others_only(trials, data):
    model = BY_NAME["polynomial"]
    everything = sums(model, data, 1e-3)
    error = 0.0
    for k, one in enumerate(data):
        others = fit(model, everything, (everything.trial != k).astype(float))
        error += float(np.sum((one.f - predicted(model, others, one)) ** 2))
    norm = normalisation(params())
    judged = score(model, everything, pressures(trials), norm)[1]
    assert judged.rms_trial_n == pytest.approx(
        np.sqrt(error / sum(len(d.f) for d in data)) * norm.force_n, rel=1e-6
    )
    assert judged.rms_trial_n > judged.rms_n
    assert np.isnan(score(model, everything, pressures(trials), norm, "none")[1].r2_trial)


def test_tang_with_all_fitted_is_never_below_what_it_contains(trials, data):
    groups, norm = pressures(trials), normalisation(params())
    judged = {
        model.name: score(model, sums(model, data, 1e-3), groups, norm)[1].r2 for model in MODELS
    }
    assert (
        judged[TANG_ALL]
        > judged["static, quadratic"]
        >= judged["static, b and n fitted"] - 1e-9
        > judged["static, geometry"] - 1e-9
    )


def test_terms_of_eq8_are_found_where_they_are_the_truth():
    trials = made(params(EQ8), noise_n=0.5)
    data = [scaled(trial, normalisation(params()), 0.2078, 3.05) for trial in trials]
    ways = {way.name: way for way in select_terms(sums(all_terms(), data, 1e-3), 1000.0)}
    own, forward = ways["terms of eq. 8"].chosen, ways["forward: add the most R2"].chosen
    assert forward.r2 > own.r2 - 0.002 and len(forward.terms) == 5
    assert ways["backward: drop the least R2"].chosen.r2 > own.r2 - 0.005
    paper = ways["paper: drop the smallest coefficient"]
    assert [len(step.terms) for step in paper.path] == list(range(64, 4, -1)) and paper.path[
        0
    ].condition > 1e4 > own.condition


def test_effective_samples_count_memory():
    rng = np.random.default_rng(0)
    white = rng.standard_normal(400_000)
    held = np.repeat(rng.standard_normal(4_000), 100)
    assert effective_samples([white]) == pytest.approx(400_000, rel=0.3)
    assert effective_samples([held]) == pytest.approx(4_000, rel=0.3)


@settings(deadline=None, max_examples=30)
@given(st.floats(0.0, 5.0), st.integers(2, 9))
def test_work_of_whole_loops_does_not_count_elastic_energy(friction, turns):
    phase = np.linspace(0.3, 2.0 * np.pi * turns + 1.5, 20_000)
    length = 0.13 - 0.01 * np.cos(phase)
    force = 3000.0 * (length - 0.12) + friction * np.sign(np.gradient(length))
    loops = np.flatnonzero(closed_path(length))
    whole = np.round((phase[loops[-1]] - phase[loops[0]]) / (2.0 * np.pi))
    assert force @ closed_path(length) == pytest.approx(friction * 0.04 * whole, rel=0.01, abs=2e-3)


def test_a_held_encoder_is_read_where_it_is_fresh():
    true = 1e-3 * np.sin(np.arange(4000) * 2e-3)
    held = np.repeat(true[1::2], 2)[:3999]
    held = np.concatenate([true[:1], held])
    assert np.abs(renewed(held) - true)[2:-2].max() < 1e-8 < np.abs(held - true).max()
    assert renewed(true) is true


def test_what_the_trials_cannot_tell_is_said(trials):
    assert remarks(trials) == ()
    assert "one no-load pressure only" in remarks(trials[:1])[0]
    path = 0.12 + 0.02 * np.abs((np.arange(20_000) / 2000.0) % 2.0 - 1.0)
    even = replace(trials[0], length_m=path, speed_m_s=np.gradient(path, 1e-3))
    assert any("one speed only" in sentence for sentence in remarks([even]))


@pytest.mark.parametrize(
    ("asked", "words"),
    [(Asked("pressure"), "expected several to leave one out"), (Asked("trial"), "found one trial")],
)
def test_what_cannot_be_left_out_is_refused(asked, words, trials):
    with pytest.raises(IdentifyError, match=words):
        identify_trials(trials[:1], params(), asked)


def test_the_answer_is_json_with_null_for_no_number(trials):
    answer, _ = identify_trials(trials[:1], params(), Asked(physical=False, terms=False))
    text = json.loads(json.dumps(as_json(answer), allow_nan=False))
    assert text["models"][0]["r2_trial"] is None and text["normalisation"]["pressure_pa"] == 750e3

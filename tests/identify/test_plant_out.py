"""An identified muscle in a plant file is the one that was fitted."""

import numpy as np
import pytest

from epa_rt.identify.data import normalisation
from epa_rt.identify.identify import Asked, identify_trials
from epa_rt.identify.linear import predicted
from epa_rt.identify.physical import predicted as physical_force
from epa_rt.identify.plant_out import chosen_plant, plant_text
from epa_rt.models.plant_file import load_plant
from tests.identify.made import SLIP, bench, made, params


@pytest.fixture(scope="module")
def found():
    trials = made(params(SLIP), 2, 10.0)
    answer, data = identify_trials(trials, params(), Asked(terms=False))
    return trials, answer, data


@pytest.mark.parametrize(
    ("choice", "name"), [("polynomial", "polynomial"), ("tang", "Tang, all fitted")]
)
def test_the_plant_pulls_as_the_fitted_model(found, choice, name, tmp_path):
    trials, answer, data = found
    plant, score = chosen_plant(choice, bench(), answer, trials)
    assert score.name == name
    path = tmp_path / "plant.yaml"
    path.write_text(plant_text(plant, ("two\nlines",)), encoding="utf-8")
    read = load_plant(path)
    assert (
        path.read_text(encoding="utf-8").startswith("# two lines\n")
        and read.params.tobytes() == plant.params.tobytes()
    )
    model, fitted, _ = next(one for one in answer.linear if one[0].name == name)
    for trial, normal in zip(trials, data, strict=True):
        expected = predicted(model, fitted, normal) * normalisation(params()).force_n
        inside = expected > 0.0  # the plant's strap cannot push
        assert physical_force(read.params, trial)[inside] == pytest.approx(
            expected[inside], abs=0.02
        )


def test_the_best_is_the_physical_one_and_carries_the_gas(found):
    trials, answer, _ = found
    plant, score = chosen_plant("best", bench(), answer, trials)
    assert score.name.startswith("physical") and "braid_maxwell_slip" in plant.effects
    assert plant.params["muscle"]["slip_ratio"][0, 0] == pytest.approx(0.04, rel=0.02)
    assert plant.params["muscle"]["viscous_n_s_m"][0, 0] == pytest.approx(25.0, rel=0.02)
    assert 1.0 <= plant.params["gas"]["polytropic_ratio"][0, 0] <= 1.4


def test_what_the_trials_do_not_show_is_not_identified(found):
    trials, answer, _ = found
    held = next(fit for fit in answer.physical if fit.model.name == "physical, held")
    assert np.isnan([held.score.intervals[key] for key in held.unseen]).all()
    assert all(
        np.isfinite(held.score.intervals[key]).all()
        for key in held.model.keys
        if key not in held.unseen
    )
    if held.unseen:
        assert any("is not identified" in sentence for sentence in answer.remarks)

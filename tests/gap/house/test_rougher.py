"""A free run in half as many sub-steps, by the midpoint rule, is another run, but what a knob changes of it is the same."""

import numpy as np
import pytest

from epa_rt.gap.aside import Part
from epa_rt.gap.as_one import LINK, AsOne, floor, meters_of, twins_of
from epa_rt.gap.problem import Problem
from tests.gap.house.runs import recorded, subject

ALIKE = 0.09   # of a change's norm; the worst found over all starts of all effects is 0.08, all but a dozen are below 0.02
SHOWN = 0.1    # deviations of noise, below which a change is none


def whole(rig):
    house, logs = subject(rig), [recorded(rig, 1)]
    return Problem(AsOne(house, meters_of(logs, twins_of(house, logs, {}))), logs, floor())


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_every_effect_and_nominal_parameter_changes_the_rougher_run_as_it_changes_the_run(rig, every):
    problem = whole(rig)
    here, shown = problem.residual({}, LINK), 0
    asked = [dict(zip(effect.knobs, start, strict=True)) for effect in problem.subject.catalogue for start in effect.starts]
    asked += [{knob.key: knob.value + problem.step(knob.key, knob.value)} for knob in problem.subject.nominal]
    asked = asked[::every]
    for values in asked:
        wanted = problem.residual(values, LINK) - here
        found = problem.change(values, {}, LINK, here)
        shown += float(np.linalg.norm(wanted)) > SHOWN
        assert np.linalg.norm(found - wanted) < ALIKE * max(float(np.linalg.norm(wanted)), SHOWN), values
    assert shown > 0.6 * len(asked)


def test_the_rougher_rig_is_another_integration_of_the_same_plant():
    house = subject("bench")
    rough = house.rougher()
    assert rough.plant.substeps == house.plant.substeps // 2 and house.plant.substeps == 2
    assert np.array_equal(rough.plant.params, house.plant.params)
    log = recorded("bench", 1)
    column = house.channels["force_n"].column
    assert not np.array_equal(rough.free_run(log, {}, None).columns[column], house.free_run(log, {}, None).columns[column])
    assert rough.rougher() is None


@pytest.mark.parametrize("at_base", [False, True])
def test_a_rougher_run_that_is_no_number_leaves_the_change_to_the_whole_one(at_base):
    problem = whole("bench")
    here, values = problem.residual({}, LINK), {"drive.coulomb_nm": 0.02}
    wanted = problem.residual(values, LINK) - here
    rough, column = problem.subject._rough, subject("bench").channels["force_n"].column

    def broken(recording, asked, seed):
        made = rough(recording, asked, seed)
        if bool(asked) != at_base:
            made.columns[column] = np.full_like(made.columns[column], np.inf)
        return made

    problem.subject._rough = broken
    assert np.array_equal(problem.change(values, {}, LINK, here), wanted)


def test_a_subject_that_sets_trials_aside_runs_as_roughly():
    house, log = subject("knee"), recorded("knee", 1)
    part = Part(house, {log.name: [(0, log.samples)]})
    assert AsOne(part, {})._rough is not None and AsOne(house.rougher(), {})._rough is None

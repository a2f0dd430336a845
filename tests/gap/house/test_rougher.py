"""A free run in half as many sub-steps is another run, but what a knob changes of it is the same,
and by the midpoint rule nearly so.
"""

import numpy as np
import pytest

from epa_rt.gap.held_out.aside import Part
from epa_rt.gap.likelihood.as_one import LINK, AsOne, floor, meters_of, twins_of
from epa_rt.gap.likelihood.problem import Problem
from tests.gap.house.runs import recorded, subject

ALIKE = {
    False: 0.02,
    True: 0.09,
    # of a change's norm, far: the worst found over all starts of all effects are 0.01, and by the
    # midpoint rule 0.08, where all but a dozen are below 0.02
}
SHOWN = 0.1  # deviations of noise, below which a change is none


def whole(rig):
    house, logs = subject(rig), [recorded(rig, 1)]
    return Problem(AsOne(house, meters_of(logs, twins_of(house, logs, {}))), logs, floor())


SOME = [("bench", 4, False), ("bench", 4, True), ("knee", 8, False), ("knee", 8, True)]
ALL = [
    pytest.param(rig, 1, far, marks=pytest.mark.slow)
    for rig in ("bench", "knee")
    for far in (False, True)
]


@pytest.mark.parametrize(("rig", "every", "far"), (*SOME, *ALL))
def test_every_effect_and_nominal_parameter_changes_the_rougher_run_as_it_changes_the_run(
    rig, every, far
):
    problem = whole(rig)
    here, shown = problem.residual({}, LINK), 0
    asked = [
        dict(zip(effect.knobs, start, strict=True))
        for effect in problem.subject.catalogue
        for start in effect.starts
    ]
    asked += [
        {knob.key: knob.value + problem.step(knob.key, knob.value)}
        for knob in problem.subject.nominal
    ]
    asked = asked[::every]
    for values in asked:
        wanted = problem.residual(values, LINK) - here
        found = problem.change(values, {}, LINK, here, far)
        shown += float(np.linalg.norm(wanted)) > SHOWN
        assert np.linalg.norm(found - wanted) < ALIKE[far] * max(
            float(np.linalg.norm(wanted)), SHOWN
        ), values
    assert shown > 0.6 * len(asked)


def test_the_rougher_rig_is_another_integration_of_the_same_plant():
    house = subject("bench")
    rough = house.rougher()
    assert rough.plant.substeps == house.plant.substeps // 2 and house.plant.substeps == 2
    assert np.array_equal(rough.plant.params, house.plant.params)
    log = recorded("bench", 1)
    column = house.channels["force_n"].column
    assert not np.array_equal(
        rough.free_run(log, {}, None).columns[column], house.free_run(log, {}, None).columns[column]
    )
    assert rough.rougher() is None


@pytest.mark.parametrize("at_base", [False, True])
def test_a_rougher_run_that_is_no_number_leaves_the_change_to_the_whole_one(at_base):
    problem = whole("bench")
    here, values = problem.residual({}, LINK), {"drive.coulomb_nm": 0.02}
    wanted = problem.residual(values, LINK) - here
    rough, column = problem.subject._rough[False], subject("bench").channels["force_n"].column

    def broken(recording, asked, seed):
        made = rough(recording, asked, seed)
        if bool(asked) != at_base:
            made.columns[column] = np.full_like(made.columns[column], np.inf)
        return made

    problem.subject._rough[False] = broken
    assert np.array_equal(problem.change(values, {}, LINK, here), wanted)


def test_a_subject_that_sets_trials_aside_runs_as_roughly():
    house, log = subject("knee"), recorded("knee", 1)
    part = Part(house, {log.name: [(0, log.samples)]})
    assert set(AsOne(part, {})._rough) == {False, True} and not AsOne(house.rougher(), {})._rough


@pytest.mark.parametrize("rig", ["bench", "knee"])
def test_the_beginning_of_a_recording_runs_as_the_whole_one_does_up_to_there(rig):
    house, log = subject(rig), recorded(rig, 1)
    end = log.samples - 2345
    part = house.upto(log, end)
    assert part.samples == len(part.t_ns) == end and max(span.stop for span in part.spans) <= end
    whole, first = house.free_run(log, {}, None), house.free_run(part, {}, None)
    for channel in house.channels.values():
        assert np.array_equal(whole.columns[channel.column][:end], first.columns[channel.column])


def test_of_a_knee_nothing_is_run_behind_the_last_trial_and_what_is_judged_stays_to_the_last_bit():
    house, log = subject("knee"), recorded("knee", 1)
    meters = meters_of([log], twins_of(house, [log], {}))
    part, values = Problem(AsOne(house, meters), [log], floor()), {"load.mass_kg": 1.4}
    house_without = subject("knee").on_channels(house.channels)
    house_without.upto = lambda recording, samples: None
    entire = Problem(AsOne(house_without, meters), [log], floor())
    assert (
        part.prepared[log.name].recording.samples
        < log.samples
        == entire.prepared[log.name].recording.samples
    )
    assert np.array_equal(
        part.residual(values, LINK), entire.residual(values, LINK)
    ) and part.samples(LINK) == entire.samples(LINK)
    assert np.array_equal(part.edges[LINK], entire.edges[LINK])

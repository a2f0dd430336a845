"""Numbers that serve the blocks and the whole plant: what no block feels, free run does."""

import numpy as np
import pytest

from epa_rt.gap.likelihood.as_one import LINK, AsOne, floor, meters_of, twins_of
from epa_rt.gap.likelihood.point import costs, linearised
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.likelihood.together import ROUNDS, Together
from tests.gap.test_as_one import OFF, Chained, logs, without_gas

OFFSET = {"sensors.force_offset_n": 2.0}


def blocks_and_whole(truth) -> tuple[Problem, Problem]:
    subject, recordings = Chained(), logs(truth)
    problem = Problem(subject, recordings, without_gas(subject, recordings, {}))
    whole = Problem(
        AsOne(subject, meters_of(recordings, twins_of(subject, recordings, {}))),
        recordings,
        floor(),
    )
    return problem, whole


@pytest.fixture(scope="module")
def parts():
    return blocks_and_whole(OFFSET)


def test_what_no_block_feels_is_fitted_to_free_run_before_and_after(parts):
    problem, whole = parts
    base, final = settled(problem), settled(problem, ("force_offset",), OFFSET)
    assert (
        final.values.get("gas.flow_pa_s", problem.knobs["gas.flow_pa_s"].value)
        == problem.knobs["gas.flow_pa_s"].value
    )  # no block has felt it
    both = Together(problem, whole)
    before = settled(both, (), base.values, rounds=ROUNDS)
    after = settled(both, ("force_offset",), final.values, rounds=ROUNDS)
    for point in (before, after):
        assert point.values["gas.flow_pa_s"] == pytest.approx(OFF["gas.flow_pa_s"], rel=0.01)
    assert after.values["sensors.force_offset_n"] == pytest.approx(2.0, abs=0.1)
    assert "sensors.force_offset_n" not in before.values
    keys = after.normal.keys
    assert costs(both, keys, after.values) < costs(both, keys, final.values)
    on_blocks = linearised(problem, ("force_offset",), dict(after.values))
    assert on_blocks.normal.chi < 1.02 * final.normal.chi  # the blocks are none the worse


def test_every_link_counts_as_in_its_own_problem(parts):
    problem, whole = parts
    both = Together(problem, whole)
    assert both.links == (*problem.links, LINK)
    for link, own in [*((link, problem) for link in problem.links), (LINK, whole)]:
        assert both.samples(link) == own.samples(link) == both.edges[link][-1]
        np.testing.assert_array_equal(both.residual(OFF, link), own.residual(OFF, link))
        assert len(both.edges[link]) == both.blocks + 1

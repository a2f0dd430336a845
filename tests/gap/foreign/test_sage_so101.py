"""The SO-101 arm's servos: friction and the servo's dead zone look alike on the one channel, and
what would tell them apart.
"""

from functools import cache

import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.diagnosis import DECIDES
from epa_rt.gap.next.plan import next_experiment
from epa_rt.gap.next.rivals import answers, distance_between
from epa_rt.gap.rig.foreign import open_foreign
from epa_rt.gap.rig.foreign.next import items, simulated
from tests.gap.foreign.real import RIGS, recording


@pytest.fixture(scope="module")
def step_response(folder):
    return recording(
        folder,
        "sage_so101",
        "sage_so101/step_response/control.csv",
        "sage_so101/step_response/state_motor.csv",
    )


@pytest.fixture(scope="module")
def diagnosed(step_response):
    """The servo of a joint, and its diagnosis; made once."""

    @cache
    def made(joint):
        subject = open_foreign(RIGS / f"so101_{joint}.yaml")
        return subject, diagnose(subject, [step_response], how_far=False)

    return made


@pytest.mark.parametrize(
    "joint", ["wrist_roll", pytest.param("wrist_pitch", marks=pytest.mark.slow)]
)
def test_friction_and_dead_zone_cannot_be_told_apart_in_step_response(diagnosed, joint):
    subject, found = diagnosed(joint)
    first = found.effects[0]
    family = {effect.name: effect.family for effect in subject.catalogue}
    assert found.verdict == "not_separable"
    assert {family[name] for name in (first.name, *first.not_separable_from)} >= {
        "friction",
        "deadband",
    }


def test_the_experiment_that_would_tell(diagnosed, step_response):
    subject, diagnosis = diagnosed("wrist_roll")
    found = answers(subject, [step_response], diagnosis)
    few = [item for item in items(subject) if item.name in ("steps", "slow_triangle")]
    best = next_experiment(
        found.rivals,
        few,
        lambda item, plant: simulated(subject, item, plant, step_response),
        distance_between(subject, found),
    )
    assert best.expected_distance > DECIDES
    assert (
        best.settings["weight"] != "0 rad/s of the motor's speed"
        or best.settings["position_gain"] != "1 x"
    )
    assert "samples" in best.file

"""The printed piston: reruns and reconnections of one actuator against each other, and what its
friction is.
"""

import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.rig.foreign import open_foreign
from tests.gap.foreign.real import RIGS, families, recording


@pytest.fixture(scope="module")
def subject():
    return open_foreign(RIGS / "seal_piston.yaml")


def piston(folder, name):
    return recording(folder, "zillen_friction", f"zillen_pneumatic/{name}.csv")


def test_rerun_2_at_1_bar_against_the_other_runs_has_no_gap(folder, subject):
    names = [f"{kind}_{i}_O-ring257_1bar" for kind in ("rerun", "reconnected") for i in (1, 2, 3)]
    runs = {name: piston(folder, f"repeatability/{name}") for name in names}
    judged = runs.pop("rerun_2_O-ring257_1bar")
    found = diagnose(subject.against(*runs.values(), by="stroke"), [judged], how_far=False)
    assert found.verdict == "no_gap"


def test_rerun_3_at_7_bar_against_the_other_runs_has_no_gap(folder, subject):
    names = [f"{kind}_{i}_O-ring257_7bar" for kind in ("rerun", "reconnected") for i in (1, 2, 3)]
    runs = {name: piston(folder, f"repeatability/{name}") for name in names}
    judged = runs.pop("rerun_3_O-ring257_7bar")
    assert (
        diagnose(subject.against(*runs.values(), by="stroke"), [judged], how_far=False).verdict
        == "no_gap"
    )


@pytest.mark.parametrize("name", ["O-ring_1bar"])
def test_friction_is_named_first_for_an_o_ring(folder, subject, name):
    assert families(diagnose(subject, [piston(folder, f"friction/{name}")], how_far=False))[:1] == [
        "friction"
    ]

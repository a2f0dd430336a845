"""The printed piston: reruns and reconnections of one actuator against each other, and what its
friction is.
"""

import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.rig.foreign import open_foreign
from tests.gap.foreign.real import RIGS, recording


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


def test_an_o_ring_s_friction_is_named_at_one_pressure_by_one_law_or_another(folder, subject):
    """What it has from the gas and what it has without, one pressure does not tell apart."""
    found = diagnose(subject, [piston(folder, "friction/O-ring_1bar")], how_far=False)
    first = found.effects[0]
    assert {first.name, *first.not_separable_from} & {"coulomb", "dahl", "lugre"}, found.says
    assert first.family in ("friction", "seal_friction"), found.says

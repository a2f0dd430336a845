"""Machines of an outsider's simulators: they come again from their seed, and what they have is
looked for under families that there are.
"""

import numpy as np
import pytest

from epa_rt.gap.rig.foreign import open_foreign
from scripts.several_effects import KINDS


@pytest.mark.parametrize("kind", KINDS)
def test_a_machine_comes_again_from_its_seed_and_its_families_exist(kind, tmp_path):
    module = KINDS[kind]
    one, again, other = (module.made(np.random.default_rng(seed), 3) for seed in (1, 1, 2))
    assert (one.has, one.plant, one.rig) == (again.has, again.plant, again.rig)
    for a, b in zip(one.logs, again.logs, strict=True):
        for name, values in a.columns.items():
            assert np.isfinite(values).all() and np.array_equal(values, b.columns[name])
    assert one.plant != other.plant
    (tmp_path / "plant.yaml").write_text(one.plant, encoding="utf-8")
    (tmp_path / "rig.yaml").write_text(one.rig, encoding="utf-8")
    subject = open_foreign(tmp_path / "rig.yaml")
    known = {effect.family for effect in subject.catalogue}
    assert set(one.has) <= set(module.FAMILIES)
    assert module.EVERYWHERE.union(*module.FAMILIES.values()) <= known
    assert {link.channel for link in subject.links} <= set(one.logs[0].columns)

"""docs/foreign-effects.md is what the kinds of rigs say."""

from pathlib import Path

import pytest

from epa_rt.gap.rig.foreign.catalogue_page import page, rows
from epa_rt.gap.rig.foreign.kinds import KINDS

ROOT = Path(__file__).parents[3]


def test_the_page_is_the_code():
    assert (ROOT / "docs" / "foreign-effects.md").read_text(encoding="utf-8") == page()


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_kind_says_its_model_and_every_effect_its_equation_and_numbers(kind):
    component = KINDS[kind]
    assert component.equations and len(rows(component)) == len(component.effects)
    for row in rows(component):
        assert row["equation"] and row["source"] and row["knobs"], row["name"]
        assert all(
            one["low_scale"] != one["scale"] or one["low"] <= one["neutral"] <= one["high"]
            for one in row["knobs"]
        ), row["name"]

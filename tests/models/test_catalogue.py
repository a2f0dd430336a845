"""The catalogue of effects is complete, within bounds, and consistent with the tables and
docs/plant.md.
"""

from pathlib import Path

import pytest

from epa_rt.models import catalogue
from epa_rt.models.catalogue import CATALOGUE, NOMINAL, knob, read_knob, write_knob
from epa_rt.models.knobs import row_of
from epa_rt.models.parameters import BLOCKS, TWICE, effects, neutral_params

PAGE = (Path(__file__).parents[2] / "docs" / "plant.md").read_text(encoding="utf-8")
SWITCHES = effects()


def test_every_effect_of_the_tables_is_in_the_catalogue_once():
    names = [effect.name for effect in CATALOGUE]
    assert len(set(names)) == len(names)
    assert set(names) == set(SWITCHES)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda e: e.name)
def test_entry_is_well_formed(effect):
    assert effect.family and effect.says and effect.source
    assert f"\n## {effect.equation}\n" in PAGE and f" {effect.name} |" in PAGE
    switches = {f"{block}.{row.name}" for block, row in SWITCHES[effect.name]}
    assert switches <= set(effect.knobs)
    assert all(row_of(key)[0] == effect.block for key in effect.knobs)
    for start in effect.starts:
        assert len(start) == len(effect.knobs)
        for key, value in zip(effect.knobs, start, strict=True):
            _, row, _ = row_of(key)
            assert row.low <= value <= row.high, key
            assert row.effect in (None, effect.name), key
        assert any(
            value != row_of(key)[1].neutral
            for key, value in zip(effect.knobs, start, strict=True)
            if key in switches
        )
    assert len(set(effect.starts)) == len(effect.starts)


def test_every_knob_says_its_unit_bounds_and_spread():
    params = neutral_params()
    for key in [*(n.key for n in NOMINAL), *(key for effect in CATALOGUE for key in effect.knobs)]:
        given = knob(key, params)
        assert given.low <= given.value <= given.high and given.spread > 0.0, key
        assert given.unit == row_of(key)[1].unit
    assert all(knob(n.key, params).effect is None for n in NOMINAL)
    assert not {n.key for n in NOMINAL} & {key for effect in CATALOGUE for key in effect.knobs}


def test_keys_without_a_number_mean_both_muscles():
    params = neutral_params()
    write_knob(params, "muscle.viscous_n_s_m", 5.0)
    assert list(params["muscle"]["viscous_n_s_m"][0]) == [5.0, 5.0]
    write_knob(params, "muscle1.viscous_n_s_m", 7.0)
    assert list(params["muscle"]["viscous_n_s_m"][0]) == [5.0, 7.0]
    assert (
        read_knob(params, "muscle.viscous_n_s_m")
        == read_knob(params, "muscle0.viscous_n_s_m")
        == 5.0
    )
    assert read_knob(params, "muscle1.viscous_n_s_m") == 7.0
    write_knob(params, "drive.coulomb_nm", 1e-3)
    assert read_knob(params, "drive.coulomb_nm") == 1e-3


def test_both_muscles_read_as_the_one_that_is_there():
    params = neutral_params()
    params["muscle"]["present"][0, 0] = 0.0
    write_knob(params, "gas1.leak_per_s", 3e-4)
    assert read_knob(params, "gas.leak_per_s") == 3e-4


def test_a_knob_of_one_muscle_has_the_effect_of_both():
    assert catalogue.knob("gas1.leak_per_s", neutral_params()).effect == "leak"


@pytest.mark.parametrize(
    "key", ["muscle2.dahl_m", "drive0.coulomb_nm", "muscle.nothing", "viscous", "muscle.present"]
)
def test_unknown_keys_are_refused(key):
    with pytest.raises(KeyError):
        knob(key, neutral_params())


def test_rows_are_well_formed():
    for block, table in BLOCKS.items():
        names = [row.name for row in table]
        assert len(set(names)) == len(names), block
        for row in table:
            assert row.low <= row.neutral <= row.high, (block, row.name)
            assert row.meaning and row.source
    assert set(TWICE) <= set(BLOCKS)

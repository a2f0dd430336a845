"""A plant that is compiled without some groups of effects gives what the one with all of them
gives, to the bit.
"""

import numpy as np
import pytest
from catalogue_scenes import opened, switched_on
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.models import plant
from epa_rt.models.catalogue import CATALOGUE, write_knob
from epa_rt.models.groups import COMPILED, GAS, MUSCLE, OTHERS, groups_of, known_places
from epa_rt.models.parameters import PARAMS, TWICE, effects, neutral_params
from epa_rt.models.ports import SENSORS

ALL = OTHERS | GAS | MUSCLE
CYCLES = 400


def run(name: str, params: np.ndarray, groups: int, roughly: bool) -> tuple[bytes, bytes]:
    """Readings and last state of a log's start, by the plant compiled for these groups. Valves
    begin to move after a tenth of a second.
    """
    scene, out, state = opened(name), np.zeros(CYCLES, SENSORS), plant.new_state(params)
    commands = scene.commands[:CYCLES].copy()
    commands["inlet"][100:200], commands["exhaust"][300:350] = 1.0, 1.0
    plant.over_log(groups, roughly)(params, state, commands, 1e-3, scene.substeps, out)
    return out.tobytes(), state.tobytes()


@settings(max_examples=60)
@given(
    st.sampled_from(["bench", "knee", "mass"]),
    st.lists(st.sampled_from(CATALOGUE), max_size=4, unique=True),
    st.booleans(),
)
def test_what_is_left_out_changes_no_bit(name, chosen, roughly):
    params = opened(name).params
    for effect in chosen:
        params = switched_on(params, effect, effect.starts[0])
    needed = groups_of(params)
    whole = run(name, params, ALL, roughly)
    for groups in COMPILED:
        if needed & ~groups == 0:
            assert run(name, params, groups, roughly) == whole


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_an_effect_that_is_on_is_never_left_out(effect):
    params = switched_on(neutral_params(), effect, effect.starts[0])
    held = params.copy().view("f8")
    for place, neutral in known_places(groups_of(params)):
        held[place // 8] = neutral
    assert held.tobytes() == params.tobytes()


def test_without_groups_every_switch_is_known():
    switches = sum(len(rows) * (1 + (rows[0][0] in TWICE)) for rows in effects().values())
    assert len({place for place, _ in known_places(0)}) == switches
    assert known_places(ALL) == []
    assert neutral_params().view("f8").size * 8 == PARAMS.itemsize


@pytest.mark.parametrize("value", [-0.0, np.nan, 5e-324])
def test_only_the_neutral_value_itself_is_off(value):
    params = neutral_params()
    assert groups_of(params) == 0
    write_knob(params, "muscle1.creep_stiffness_n_m", value)
    assert groups_of(params) == OTHERS | MUSCLE
    write_knob(params, "gas0.leak_per_s", value)
    assert groups_of(params) == ALL

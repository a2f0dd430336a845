"""An effect that the plant file has and the rig has not, or not as strong: the answer says so."""

import pytest

from epa_rt.gap.answer.whose import who_has
from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.diagnosis import Number
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.report.head_words import which_words
from tests.gap import toy

SHAPE = {"spring.dahl_m": 3e-3}


class Believed(toy.Toy):
    """The toy with a plant file that says ``plant``, knob key to value."""

    def __init__(self, plant: dict[str, float]) -> None:
        super().__init__()
        self.plant = plant
        self.knobs = {
            key: knob._replace(value=plant[key], absent=knob.value) if key in plant else knob
            for key, knob in toy.KNOBS.items()
        }

    def residual(self, prepared, values, link):
        return super().residual(prepared, self.plant | dict(values), link)


def told(plant: dict[str, float], rig: dict[str, float]):
    return diagnose(
        Believed(plant), [toy.recording("log", 21, rig)], floors=toy.floors, how_far=False
    )


@pytest.mark.parametrize(
    "plant, rig, who, words",
    [
        (
            {"spring.dahl_n": 1.5} | SHAPE,
            {},
            "plant_file",
            ("Dahl", " is in the plant file, and not in the rig."),
        ),
        (
            {"spring.dahl_n": 3.0} | SHAPE,
            {"spring.dahl_n": 1.5} | SHAPE,
            "both",
            ("Dahl", " is in the plant file, at another strength than in the rig."),
        ),
        ({}, {"spring.dahl_n": 1.5} | SHAPE, "rig", ("Dahl", " is missing.")),
        (
            SHAPE,
            {"spring.dahl_n": 1.5} | SHAPE,
            "rig",
            ("Dahl", " is missing."),
        ),  # a shape alone is no effect
        (
            {"sensors.pressure_offset_pa": -1500.0},
            {},
            "plant_file",
            ("Pressure offset", " is in the plant file, and not in the rig."),
        ),  # gone, and no bound
    ],
)
def test_the_answer_says_who_has_the_effect(plant, rig, who, words):
    answer = told(plant, rig)
    assert [one.who for one in answer.effects] == [who], answer.effects
    name, of = words
    assert answer.says.startswith(f"{name} ({answer.effects[0].confidence:.2f}){of}"), answer.says
    assert answer.effects[0].confidence > 0.95


def test_a_value_on_its_upper_bound_is_not_gone_although_its_interval_is_the_whole_range():
    data = [toy.recording("log", 21, seconds=8.0)]
    problem = Problem(Believed({"spring.coulomb_n": 3.0}), data, toy.floors(None, data, {}))
    assert (
        who_has(problem, "coulomb", (Number("spring.coulomb_n", 20.0, "N", 0.0, 20.0, 3.0),))
        == "both"
    )
    assert (
        who_has(problem, "coulomb", (Number("spring.coulomb_n", 0.0, "N", 0.0, 20.0, 3.0),))
        == "plant_file"
    )


def test_the_words_for_people_say_it_too():
    alone, both = (
        told({"spring.dahl_n": 1.5} | SHAPE, {}),
        told({"spring.dahl_n": 3.0} | SHAPE, {"spring.dahl_n": 1.5} | SHAPE),
    )
    assert which_words(alone) == "dahl (in the plant file, not in the rig)"
    assert which_words(both) == "dahl (in both, at other strengths)"


def test_knobs_of_the_house_say_where_their_effect_is_not():
    from epa_rt.models.catalogue import CATALOGUE, knob
    from epa_rt.models.knobs import row_of, write_knob
    from epa_rt.models.parameters import neutral_params

    params = neutral_params()
    for effect in CATALOGUE:
        for key in effect.knobs:
            write_knob(params, key, effect.starts[0][effect.knobs.index(key)])
            one = knob(key, params)
            assert one.effect is None or one.absent == row_of(key)[1].neutral, key
    assert knob("muscle.slip_ratio", params).absent == 0.0 < knob("muscle.slip_ratio", params).value

"""Answers that could not be told apart: which sets, their refits, and how far new data would put
them apart.
"""

import pytest

from epa_rt.gap.diagnosis import Diagnosis, Named
from epa_rt.gap.next.rivals import answers, distance_between, sets_apart
from tests.gap import toy

TRUTH = {"spring.dahl_n": 2.0, "spring.dahl_m": 3e-3}


def answer(*named: tuple[str, tuple[str, ...]]) -> Diagnosis:
    family = {effect.name: effect.family for effect in toy.CATALOGUE}
    return Diagnosis(
        "not_separable",
        "",
        effects=tuple(
            Named(name, family[name], "spring", (), 0.5, 1.0, others) for name, others in named
        ),
    )


def test_laws_of_one_family_are_one_answer_unless_it_is_asked_for():
    alike = answer(("dahl", ("coulomb",)))
    assert sets_apart(alike, toy.Toy()) == ()
    assert sets_apart(alike, toy.Toy(), within_family=True) == (("dahl",), ("coulomb",))


def test_one_rival_of_each_family_and_what_is_beyond_doubt_in_every_set():
    two = answer(("leak", ()), ("dahl", ("coulomb", "hardening", "heat")))
    assert sets_apart(two, toy.Toy()) == (("leak", "dahl"), ("leak", "hardening"), ("leak", "heat"))
    assert sets_apart(answer(("leak", ())), toy.Toy()) == ()


def test_without_rivals_nothing_is_refitted():
    assert answers(toy.Toy(), [], answer(("leak", ())), floors=toy.floors).rivals == ()


@pytest.fixture(scope="module")
def found():
    logs = [toy.recording("a", 1, TRUTH, seconds=20.0)]
    return answers(toy.Toy(), logs, answer(("dahl", ("hardening",))), floors=toy.floors)


def test_the_rivals_carry_their_own_numbers_and_plants(found):
    assert [rival.names for rival in found.rivals] == [("dahl",), ("hardening",)]
    assert found.values[("dahl",)]["spring.dahl_n"] == pytest.approx(2.0, abs=0.1)
    assert (
        "spring.dahl_n" in found.rivals[0].plant_text
        and "spring.dahl_n" not in found.rivals[1].plant_text
    )


def test_data_that_excite_the_difference_put_rivals_apart_and_data_that_do_not_leave_them(found):
    distance = distance_between(toy.Toy(), found)
    moving, still = (
        toy.recording(name, 5, found.values[("dahl",)], seconds=20.0, still=flag)
        for name, flag in (("moving", False), ("still", True))
    )
    assert distance(moving, *found.rivals) > 1000.0
    assert distance(still, *found.rivals) < 25.0


def test_what_any_fit_takes_of_the_new_data_makes_no_experiment_worthless(found):
    """Data of the first rival's own plant that its numbers do not fit: both rivals take that, and
    the difference between them stays.
    """
    distance = distance_between(toy.Toy(), found)
    values = found.values[("dahl",)]
    apart = [
        distance(
            toy.recording(
                "moving",
                5,
                {**values, "gas.flow_pa_s": values.get("gas.flow_pa_s", 4e5) * wrong},
                seconds=20.0,
            ),
            *found.rivals,
        )
        for wrong in (1.0, 1.03)
    ]
    assert apart[1] == pytest.approx(apart[0], rel=0.1)

"""The posterior's answer in words."""

import pytest

from epa_rt.gap.posterior.words import set_words, told_of_names, told_of_sets


@pytest.mark.parametrize(
    ("names", "more", "words"),
    [
        ({"creep": 0.97}, False, "creep (0.97) is missing"),
        ({"creep": 0.97}, True, "creep (0.97) is missing, and something besides"),
        ({"creep": 0.97, "gauge_lag": 0.9}, False, "creep (0.97) and gauge lag (0.90) are missing"),
        (
            {"viscous_changed": 0.97, "spring": 0.9},
            False,
            "spring (0.90) is missing; viscous (0.97) is not that of the healthy runs",
        ),
    ],
)
def test_names_are_said_with_their_probability(names, more, words):
    assert told_of_names(names, dict.fromkeys(names, "rig"), more) == words


def test_laws_that_are_probable_as_well_are_said_beside_a_name():
    """The probability is that of all of them together."""
    told = told_of_names({"leak": 0.97}, {"leak": "rig"}, False, {"leak": ("creep", "gauge_lag")})
    assert told == "leak, creep or gauge lag (0.97) is missing"


def test_who_has_an_effect_is_said():
    who = {"creep": "plant_file", "gauge_lag": "rig", "leak": "both"}
    assert told_of_names(dict.fromkeys(who, 0.9), who, False) == (
        "gauge lag (0.90) is missing; creep (0.90) is in the plant file, and not in the rig;"
        " leak (0.90) is in the plant file, at another strength than in the rig"
    )


@pytest.mark.parametrize(
    ("sets", "names", "who", "words"),
    [
        (
            (("creep",), ("strap_compliance",)),
            {"creep": 0.5},
            "rig",
            "these logs do not tell which: creep (0.50); or strap compliance",
        ),
        (
            (("creep", "threshold_pressure"), ("creep",)),
            {"creep": 1.0, "threshold_pressure": 0.6},
            "rig",
            "creep (1.00) is missing; whether threshold pressure is a cause besides, these logs do"
            " not tell",
        ),
        (
            (("creep", "threshold_pressure"), ("creep",)),
            {"creep": 1.0, "threshold_pressure": 0.6},
            "plant_file",
            "creep (1.00) is in the plant file, and not in the rig; whether threshold pressure is"
            " a cause besides, these logs do not tell",
        ),
    ],
)
def test_what_all_probable_sets_have_is_said_as_sure(sets, names, who, words):
    assert told_of_sets(sets, names, dict.fromkeys(names, who)) == words


def test_three_names_are_a_list():
    assert set_words(("a_b", "c", "d")) == "a b, c and d"

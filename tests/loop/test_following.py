"""What a following error says of the air: only what motion and heat cannot have done."""

from types import SimpleNamespace

import pytest

from epa_rt.loop.following import of_the_air


def valve(held_pa, now_pa, drifting=True):
    return SimpleNamespace(drifting=drifting, target_pa=held_pa, estimate_pa=now_pa)


@pytest.mark.parametrize(
    ("held_pa", "now_pa", "words"),
    [
        (
            200e3,
            260e3,
            "muscle: inlet stuck open? It is at 260.0 kPa abs, with both valves closed since"
            " 200.0 kPa abs",
        ),
        (200e3, 150e3, "muscle: exhaust stuck open or leak? It is at 150.0 kPa abs"),
        (200e3, 215e3, ""),
        (200e3, float("nan"), ""),
    ],
)
def test_a_pressure_that_went_away_is_named(held_pa, now_pa, words):
    said = of_the_air(((valve(held_pa, now_pa), "muscle"),))
    assert words in said and bool(said) == bool(words)


def test_a_muscle_that_is_being_switched_is_not_suspected():
    assert of_the_air(((valve(200e3, 300e3, drifting=False), "muscle"),)) == ""

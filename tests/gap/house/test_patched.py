"""A patched plant is a file that loads to the numbers asked for."""

import numpy as np

from epa_rt.gap.rig.house import open_house
from epa_rt.models.plant_file import load_plant
from tests.gap.house.runs import ROOT, plant_of, plant_with, subject


def test_a_patched_plant_loads_to_the_same_numbers():
    house = subject("knee")
    values = {
        "muscle.dahl_ratio": 0.043,
        "muscle.dahl_m": 8e-4,
        "load.mass_kg": 1.31,
        "sensors.force_gain_ratio": 1.004,
    }
    plant = load_plant(
        plant_with(
            "knee", "patched", **{key.replace(".", "__"): value for key, value in values.items()}
        )
    )
    assert np.array_equal(plant.params, house.params(values))


def test_an_effect_of_no_strength_is_still_named():
    text = subject("bench").patched({"gas.leak_per_s": 0.0}, ("leak",))
    assert "leak:" in text


def test_what_is_left_out_is_not_in_the_catalogue():
    whole = {effect.name for effect in subject("bench").catalogue}
    less = open_house(
        ROOT / "config/rigs/bench.yaml", plant_of("bench"), frozenset({"leak", "creep"})
    ).catalogue
    assert whole - {effect.name for effect in less} >= {
        "leak",
        "creep",
        "valve_seat_leak",
    }  # the last by its family

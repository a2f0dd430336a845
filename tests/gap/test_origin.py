"""Where a gap comes from that no effect explains: told by what an error of each place moves, not by
where it shows most.
"""

from dataclasses import replace

import numpy as np
import pytest

from epa_rt.gap.diagnose import diagnose
from epa_rt.gap.diagnosis import Origin, Place
from epa_rt.gap.held_out.aside import Part
from epa_rt.gap.likelihood.problem import Problem
from epa_rt.gap.likelihood.refit import settled
from epa_rt.gap.where.origin import origin_first, origins
from epa_rt.models.effect import Effect, Knob
from tests.gap import toy

SHAPES = {  # place to its block and the shapes of its error, of measured columns
    "gauge": (
        "sensors",
        lambda c: [np.ones(len(c["pressure_pa"])), smooth(c) / 1e5, (smooth(c) / 1e5) ** 2],
    ),
    "spring": (
        "spring",
        lambda c: [
            np.tanh(c["speed_m_s"] / 0.01),
            c["position_m"] ** 2 * 1e3,
            smooth(c) * c["position_m"] * 1e-3,
        ],
    ),
    "gas": ("gas", lambda c: [smooth(c) * c["valve_ratio"] / 1e5, c["valve_ratio"]]),
    "drive": ("drive", lambda c: [np.sin(k * 100.0 * c["position_m"]) for k in range(1, 9)]),
}
SIZE = {"gauge": 500.0, "spring": 0.5, "gas": 500.0, "drive": 0.01}
LINKS = {"gauge": ("gas", "spring"), "spring": ("spring",), "gas": ("gas",), "drive": ("drive",)}


def smooth(columns):
    """The pressure without its noise."""
    return toy.predicted(columns, {}, "gas")


class Doubted(toy.Toy):
    """The made-up rig whose catalogue is its places."""

    def __init__(self, prepared):
        super().__init__()
        keys = {
            place: tuple(
                f"{place}:{k}" for k in range(len(shapes(next(iter(prepared.values())).columns)))
            )
            for place, (_, shapes) in SHAPES.items()
        }
        self.knobs = toy.KNOBS | {
            key: Knob(key, "", 0.0, -1e6, 1e6, SIZE[place], "place")
            for place, own in keys.items()
            for key in own
        }
        self.catalogue = tuple(
            Effect(
                place, place, SHAPES[place][0], own, ((0.0,) * len(own),), f"the {place}", "", ""
            )
            for place, own in keys.items()
        )

    def touched(self, key):
        return LINKS[key.split(":")[0]] if ":" in key else super().touched(key)

    def residual(self, prepared, values, link):
        c = prepared.columns
        error = {
            place: sum(values.get(f"{place}:{k}", 0.0) * shape for k, shape in enumerate(shapes(c)))
            for place, (_, shapes) in SHAPES.items()
        }
        told = replace(
            prepared,
            columns=c
            | {"pressure_pa": c["pressure_pa"] - (error["gauge"] if link == "spring" else 0.0)},
        )
        found = super().residual(
            told, {key: value for key, value in values.items() if ":" not in key}, link
        )
        return (
            found
            - {
                "gas": error["gauge"] + error["gas"],
                "spring": error["spring"],
                "drive": error["drive"],
            }[link]
        )


class Rig(toy.Toy):
    """The made-up rig that knows its places."""

    def doubted(self, prepared):
        return Doubted(prepared)


def found(extra, subject=None, count=2):
    rig = subject or Rig()
    logs = [
        toy.recording(f"log{i}", 10 + i, {"spring.stiffness_n_m": 915.0}, extra=extra)
        for i in range(count)
    ]
    problem = Problem(rig, logs, toy.floors(rig, logs, {}))
    return problem, origins(problem, settled(problem).values)


def reading(c):
    """A pressure reading with a bow: the gas says one thing, the force another."""
    return {"gas": 900.0 * (smooth(c) / 1e5) ** 2}


def test_a_reading_that_is_wrong_is_found_though_two_links_show_it():
    _, said = found(lambda c: reading(c) | {"spring": -5e-4 * reading(c)["gas"]})
    assert said[0].place == "gauge" and said[0].block == "sensors" and said[0].explained_share > 0.9
    assert min(one.behind for one in said[1:]) > 2.0


def test_a_wrong_gas_is_no_wrong_reading_though_its_own_link_shows_the_same():
    """The pressure is there: the force that is fed with it agrees."""
    _, said = found(lambda c: {"gas": 1500.0 * smooth(c) * c["valve_ratio"] / 1e5})
    assert said[0].place == "gas"


@pytest.mark.parametrize(
    ("place", "extra"),
    (
        ("spring", lambda c: {"spring": 2.0 * toy.stop(c["position_m"], 2e-3)}),
        ("drive", lambda c: {"drive": 0.05 * np.sin(200.0 * c["position_m"])}),
    ),
)
def test_an_error_of_another_law_is_still_its_place_s(place, extra):
    assert found(extra)[1][0].place == place


def test_where_nothing_is_missing_no_place_explains_anything():
    _, said = found(None)
    assert max(one.gain for one in said) < 100.0


def test_trials_set_aside_have_no_part_in_it():
    logs = [
        toy.recording(
            "log0",
            10,
            {},
            extra=lambda c: {
                "drive": np.where(
                    np.arange(len(c["position_m"])) < 1000,
                    0.5 * np.sin(200.0 * c["position_m"]),
                    0.0,
                )
            },
        )
    ]
    part = Part(Rig(), {"log0": [(1000, 4000)]})
    problem = Problem(part, logs, toy.floors(part, logs, {}))
    assert max(one.gain for one in origins(problem, {})) < 100.0
    asked = part.doubted(problem.prepared)
    assert np.isnan(
        asked.residual(problem.prepared["log0"], {"drive:0": 1.0}, "drive")[:1000]
    ).all()


def test_a_rig_without_places_says_nothing():
    assert found(reading, toy.Toy())[1] == ()
    assert Part(toy.Toy(), {}).doubted({}) is None


def test_a_diagnosis_without_a_name_places_the_gap_there():
    logs = [toy.recording(f"log{i}", 10 + i, {"spring.coulomb_n": 3.0}) for i in range(2)]
    said = diagnose(Rig(), logs, without=("coulomb", "dahl"), floors=toy.floors, how_far=False)
    assert said.verdict == "not_in_catalogue" and said.location[0].block == "spring"
    assert (
        said.origins[0].place == "spring" and said.as_json()["origins"][0]["says"] == "the spring"
    )


def test_a_named_effect_needs_no_places():
    logs = [
        toy.recording(
            f"log{i}", 10 + i, extra=lambda c: {"spring": 2.0 * np.tanh(c["speed_m_s"] / 0.01)}
        )
        for i in range(2)
    ]
    said = diagnose(Rig(), logs, floors=toy.floors, how_far=False)
    assert said.effects and said.origins == ()


def place(block, significance):
    return Place(block, block, block, "", 1.0, 1.0, 0.0, 1.0, significance, {}, {}, {})


def origin(block, behind, gain=None, share=0.9):
    return Origin(
        block, block, block, 10_000.0 - 500.0 * behind if gain is None else gain, share, behind
    )


PLACES = (place("drive", 900.0), place("muscle", 500.0), place("gas", 30.0), place("sensors", 1.0))


def blocks(*said):
    return [one.block for one in origin_first(PLACES, said)]


def test_the_place_that_explains_the_gap_comes_first_wherever_it_shows():
    assert blocks(origin("gas", 0.0), origin("drive", 5.0))[0] == "gas"


def test_a_place_whose_own_links_agree_shows_in_another_s_link():
    found = origin_first(PLACES, (origin("sensors", 0.0), origin("drive", 5.0)))
    assert (found[0].block, found[0].link) == ("sensors", "drive") and len(found) == 5


def test_of_places_that_explain_it_alike_the_one_that_shows_most_is_first():
    assert blocks(origin("gas", 0.0), origin("muscle", 1.0), origin("drive", 7.0))[0] == "muscle"
    assert blocks(origin("gas", 0.0), origin("gas", 1.0), origin("muscle", 7.0))[0] == "gas"


def test_places_are_alike_by_less_than_what_places_explain_of_a_rig_without_a_gap():
    assert (
        blocks(
            origin("sensors", 0.0, gain=979.0),
            origin("muscle", 3.8, gain=684.0),
            origin("gas", 5.6, gain=650.0),
            origin("drive", 9.0, gain=480.0),
        )[0]
        == "muscle"
    )
    assert blocks(origin("gas", 0.0, gain=979.0), origin("muscle", 3.8, gain=620.0))[0] == "gas"
    assert blocks(origin("gas", 0.0, gain=300.0), origin("drive", 2.5, gain=100.0))[0] == "gas"


def test_what_explains_no_more_than_noise_moves_no_place():
    assert blocks(origin("gas", 0.0, gain=50.0))[0] == "drive"
    assert blocks(origin("gas", 0.0, share=0.06))[0] == "gas"
    assert blocks()[0] == "drive"


def test_a_place_that_explains_next_to_nothing_is_not_near_because_one_block_holds_the_gap():
    assert blocks(origin("gas", 0.0), origin("muscle", 1.0, gain=10.0))[0] == "gas"


def test_no_link_is_said_twice_for_its_own_block():
    weak = (place("drive", 2.0), place("gas", 1.0))
    assert origin_first(weak, (origin("drive", 0.0),)) == weak

"""A wrong length is told from two wrong blocks: one error explains what both links show."""

import numpy as np
import pytest

from epa_rt.gap.diagnosis import Place
from epa_rt.gap.lengths import Line as LineOfLength
from epa_rt.gap.lengths import beyond_the_joint, length_first, share_a_length
from epa_rt.gap.stop_operator import stop_over_log
from tests.gap.toy import White

KNOB = "load.rest0_m"
LINKS = ("muscle0", "gas0")
RMS = {"muscle0": 0.1, "gas0": 200.0}
N = 3000
TIME = np.arange(N) / 100.0
PULL = 20.0 + 15.0 * np.sin(1.3 * TIME) * np.cos(0.11 * TIME)
ANGLE = 8.0 * np.sin(0.7 * TIME) + 3.0 * np.sin(1.9 * TIME)
SLOPE = {"muscle0": 3000.0 + 400.0 * np.sin(0.3 * TIME), "gas0": 4e6 * (1.0 + 0.2 * np.cos(0.5 * TIME))}   # N/m and Pa/m


class Line:
    """Two links fed with one line's length; ``hidden``: link to what its rig adds, (N,)."""

    lines = {KNOB: LineOfLength(LINKS, ("muscle0", "motor_angle_rad"), ("motor", "force_n"))}

    def __init__(self, hidden):
        self.hidden = hidden

    def number(self, key):
        return 0.12

    def residual(self, prepared, values, link):
        rng = np.random.default_rng(LINKS.index(link))
        return self.hidden[link] - SLOPE[link] * (values.get(KNOB, 0.12) - 0.12) + RMS[link] * rng.standard_normal(N)

    def features(self, prepared, link):
        return {"motor_angle_rad": ANGLE} if link == "muscle0" else {"force_n": PULL}


def play(size_m):
    return size_m * stop_over_log(ANGLE, 0.05) / 0.05


def shared(hidden):
    return share_a_length(Line(hidden), {"log": None}, {}, {link: White(link, RMS[link]) for link in LINKS}, Line.lines[KNOB], KNOB)


@pytest.mark.parametrize("size_m", (1e-4, 5e-4))
def test_play_moves_both_links_by_their_slopes(size_m):
    assert shared({link: SLOPE[link] * play(size_m) for link in LINKS}) == "transmission"


def test_a_spool_that_is_not_round_is_a_wrong_length():
    assert shared({link: SLOPE[link] * 2e-4 * np.sin(ANGLE + 0.4) for link in LINKS}) == "transmission"


def test_a_strap_that_gives_way_is_a_wrong_length_of_the_muscles_line():
    stretch = 1e-5 * (PULL + 0.004 * PULL**2)
    assert shared({link: SLOPE[link] * (stretch - stretch.mean()) for link in LINKS}) == "muscle"  # a fitted length has taken the mean


def test_friction_of_one_link_and_another_error_of_the_other_are_none():
    assert not shared({"muscle0": 1.5 * np.sign(np.gradient(ANGLE)), "gas0": 800.0 * np.sin(0.9 * TIME)})


def test_links_that_are_off_the_same_way_with_slopes_of_other_signs_share_none():
    assert not shared({"muscle0": SLOPE["muscle0"] * play(5e-4), "gas0": -SLOPE["gas0"] * play(5e-4)})


def test_noise_alone_is_none():
    assert not shared({link: np.zeros(N) for link in LINKS})


def test_what_makes_the_length_comes_first():
    places = tuple(Place(block, link, block, "N", 1.0, 1.0, 0.0, 1.0, 50.0, {}, {}, {}) for block, link in (("muscle", "muscle0"), ("gas", "gas0")))
    floors = {link: White(link, RMS[link]) for link in LINKS}
    found = length_first(Line({link: SLOPE[link] * play(5e-4) for link in LINKS}), {"log": None}, ({},), floors, places)
    assert [place.block for place in found] == ["transmission", "muscle", "gas"]
    assert length_first(object(), {"log": None}, ({},), floors, places) == places


def test_a_strap_puts_the_muscles_own_place_first():
    places = tuple(Place(block, link, block, "N", 1.0, 1.0, 0.0, 1.0, size, {}, {}, {}) for block, link, size in (("gas", "gas0", 80.0), ("muscle", "muscle0", 50.0)))
    stretch = 1e-5 * (PULL - PULL.mean())
    found = length_first(Line({link: SLOPE[link] * stretch for link in LINKS}), {"log": None}, ({},), {link: White(link, RMS[link]) for link in LINKS}, places)
    assert [place.link for place in found] == ["muscle0", "gas0"]


def test_an_error_that_shows_at_one_point_alone_is_found_there():
    places = tuple(Place(block, link, block, "N", 1.0, 1.0, 0.0, 1.0, 50.0, {}, {}, {}) for block, link in (("muscle", "muscle0"), ("gas", "gas0")))
    floors = {link: White(link, RMS[link]) for link in LINKS}
    line = Line({link: SLOPE[link] * play(5e-4) for link in LINKS})
    residual = line.residual
    # held back, the nominal parameters leave each link another error that no length explains
    line.residual = lambda prepared, values, link: residual(prepared, values, link) + values.get("held", 0.0) * RMS[link] * np.sign(np.sin((2.0 + LINKS.index(link)) * TIME))
    held, free = {"held": 40.0}, {}
    assert length_first(line, {"log": None}, (held,), floors, places) == places
    assert length_first(line, {"log": None}, (held, free), floors, places)[0].block == "transmission"


class Joint(Line):
    """A line whose length a joint makes as well."""

    joint = (KNOB, "load", "place_rad")
    angle = 0.2 + 0.1 * np.sin(1.1 * TIME)

    def features(self, prepared, link):
        return {"place_rad": self.angle}


def beyond(hidden):
    return beyond_the_joint(Joint({"muscle0": hidden}), {"log": None}, {}, White("muscle0", RMS["muscle0"]), "muscle0")


def test_what_a_lever_does_to_a_length_is_not_the_muscles():
    assert abs(beyond(np.zeros(N))) < 4.0
    assert abs(beyond(SLOPE["muscle0"] * 2e-3 * (Joint.angle**2 - 0.04))) < 4.0
    assert beyond(0.3 * np.sign(np.gradient(Joint.angle))) > 50.0

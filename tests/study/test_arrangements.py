"""Four wirings of one plant: lengths, who carries the load, and what a wiring cannot do."""

import dataclasses
from xml.etree import ElementTree

import numpy as np
import pytest

from epa_rt.models.plant_file import load_plant
from epa_rt.study import grid
from epa_rt.study.arrangements import NAMES_OF, at_setting, compare, load_arrangements, wired
from epa_rt.study.report.sketch import WIDTH, wirings
from tests.study.made import ATMOSPHERE_PA, ROOT, SERIAL


def at(name, p0, p1, omega=40.0):
    return at_setting(wired(load_plant(SERIAL), name), 0.0, 0.01, (p0, p1, omega))


def test_serial_is_the_plant_itself():
    from epa_rt.study.motion import point

    found = at("serial", 800e3, ATMOSPHERE_PA, 80.0)
    assert (
        found["stroke_m"]
        == point(load_plant(SERIAL).params, (800e3, ATMOSPHERE_PA), 0.0, 0.01, 80.0).stroke_m
    )


def test_a_parallel_muscle_carries_load_but_saves_no_way():
    none, some = at("parallel", ATMOSPHERE_PA, ATMOSPHERE_PA), at("parallel", ATMOSPHERE_PA, 400e3)
    assert none["tension_mean_n"] == pytest.approx(133.8, rel=0.01)
    assert some["tension_mean_n"] < 0.8 * none["tension_mean_n"]
    assert some["stroke_m"] == pytest.approx(some["motion_m"], rel=0.05)


def test_an_antagonist_adds_to_the_tension():
    assert (
        at("antagonistic", 900e3, 400e3)["tension_mean_n"]
        > at("antagonistic", 900e3, 150e3)["tension_mean_n"]
        > 133.8
    )


def test_the_comparison_covers_all(tmp_path):
    asked = load_arrangements(ROOT / "config/studies/arrangements.yaml")
    small = dataclasses.replace(
        asked, pressure_pa=np.array([300e3, 800e3]), frequency_rad_s=np.array([40.0])
    )
    found = compare(small, tmp_path, grid.How(jobs=1))
    assert {name: found.of[name]["stroke_m"].shape for name in NAMES_OF} == {
        "serial": (1, 2, 1),
        "parallel": (1, 1, 2),
        "both": (1, 2, 2),
        "antagonistic": (1, 2, 2),
    }
    value, p0, p1 = found.least("serial", "stroke_m")[0]
    assert value > 0.0 and p0 in (300e3, 800e3) and np.isnan(p1)


def test_the_sketch_has_the_four_wirings_inside_its_frame():
    drawing = wirings()
    svg = ElementTree.fromstring(drawing[drawing.index("<svg") : drawing.index("</svg>") + 6])
    places = [one for one in svg if one.tag == "g"]
    assert [place[0].text for place in places] == list(NAMES_OF)
    for place in places:
        words = [one.text for one in place.iter("text")]
        assert "load" in words and "frame" in words
        assert ("strap" in words) == (place[0].text == "parallel")
        for one in place.iter("circle"):
            x, r = float(one.get("cx")), float(one.get("r"))
            assert x - r > 0 and x + r < WIDTH

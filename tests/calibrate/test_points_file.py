"""Tables of references and readings, and what is said of damaged ones."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from epa_rt.calibrate.points_file import read_asked, read_taken
from epa_rt.calibrate.reference import STANDARD_GRAVITY, Reader
from epa_rt.config.rig import load_rig
from epa_rt.config.source import ConfigError
from epa_rt.config.units import UnitError
from tests.cli.shell import ROOT

RIG = load_rig(ROOT / "config/rigs/bench.yaml")
FORCE = Reader(RIG.row("muscle_force_n"), RIG.atmosphere_pa)
PRESSURE = Reader(RIG.row("muscle_pressure_pa"), RIG.atmosphere_pa)


def test_references_are_read_as_they_are_written():
    assert FORCE.read("49.05 N")[:2] == (49.05, pytest.approx(0.01 / 12**0.5))
    value, u, mass = FORCE.read("5.000 kg")
    assert mass and value == pytest.approx(5.0 * STANDARD_GRAVITY)
    assert u == pytest.approx(0.001 * STANDARD_GRAVITY / 12**0.5)
    assert FORCE.read("500 g")[0] == pytest.approx(0.5 * STANDARD_GRAVITY)
    assert PRESSURE.read("200.0 kPa")[0] == pytest.approx(200e3)
    assert PRESSURE.read("200.0 kPa gauge")[0] == pytest.approx(200e3)
    assert PRESSURE.read("301.325 kPa abs")[0] == pytest.approx(200e3)
    assert PRESSURE.read("2.0 bar")[1] == pytest.approx(0.1e5 / 12**0.5)


@pytest.mark.parametrize("text", ["nan N", "5", "5 V", "5 N gauge", "", "N", "1e999 N", "5 kPa"])
def test_what_is_no_reference_is_refused(text):
    with pytest.raises(UnitError, match="expected"):
        FORCE.read(text)


def test_tables_in_both_forms_give_the_same_points(tmp_path):
    (tmp_path / "a.csv").write_text("reference [N],reading [V]\n0.0,0.0\n\n# later\n50.0,1.0\n")
    (tmp_path / "b.csv").write_text("reading,reference\n0.0 V,0.0 N\n1000 mV,50.0 N\n")
    (tmp_path / "c.yaml").write_text(
        "points:\n  - {reference: 0.0 N, reading: 0.0 V}\n  - {reference: 50.0 N, reading: 1 V}\n"
    )
    found = [
        read_taken(tmp_path / name, FORCE, "V", 0.005) for name in ("a.csv", "b.csv", "c.yaml")
    ]
    for points, mass in found:
        assert not mass
        assert [(p.reference, p.reading) for p in points] == [(0.0, 0.0), (50.0, 1.0)]
        assert points[0].reading_u == pytest.approx(0.005 / 12**0.5)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("t.csv", "reference [N],reading [V]\n0,0\nnan,1\n", ":3: reference: found"),
        ("t.csv", "reference [N],reading [V]\n0,0\n1\n", ":3: found 1 cells, expected 2"),
        ("t.csv", "force,volt\n0,0\n", ":1: found the columns force, volt"),
        ("t.csv", "reference [N],reference [N]\n0,0\n", "twice"),
        ("t.csv", "reference [N]\n0\n", ":2: found a row without a reading"),
        ("t.csv", "reference [N],reading [kPa]\n0,0\n", ":2: reading: found"),
        ("t.csv", "", "found no point"),
        ("t.csv", "reference,reading,scatter\n0 N,0 V,-1 V\n", "below zero"),
        ("t.yaml", "points: 3\n", ":1: points: found no list"),
        ("t.yaml", "points: [{refrence: 3 N}]\n", "an unknown key 'refrence'"),
        ("t.yaml", "points: [{reference: [3]}]\n", "no value"),
        ("t.yaml", "point: []\n", "an unknown key 'point'"),
        ("t.yaml", "points: [{reading: 3 V}]\n", "a row without a reference"),
        ("absent.csv", None, "no such file"),
    ],
)
def test_damaged_tables_get_one_sentence(tmp_path, name, text, says):
    path = tmp_path / name
    if text is not None:
        path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_taken(path, FORCE, "V", 0.005)
    assert says in str(caught.value) and str(path) in str(caught.value)


@settings(max_examples=150, deadline=None)
@given(content=st.binary(max_size=300), is_yaml=st.booleans())
def test_any_bytes_get_points_or_one_sentence(tmp_path_factory, content, is_yaml):
    path = tmp_path_factory.mktemp("t") / ("t.yaml" if is_yaml else "t.csv")
    path.write_bytes(content)
    for read in (lambda: read_taken(path, FORCE, "V", 0.005), lambda: read_asked(path, FORCE)):
        try:
            read()
        except ConfigError as error:
            assert "\n" not in str(error)


def test_asked_references_keep_their_order_and_what_is_applied(tmp_path):
    path = tmp_path / "p.yaml"
    path.write_text("points: [{reference: 5 kg, applied: 50 N}, 0 N]\n")
    first, second = read_asked(path, FORCE)
    assert first.is_mass and first.applied == 50.0 and first.where == "p.yaml:1"
    assert second.reference == 0.0 and second.applied is None

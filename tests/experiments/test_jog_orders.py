"""Orders of a jog in words: what they mean, and what is refused."""

from pathlib import Path

import pytest

from epa_rt.config.rig import load_rig
from epa_rt.config.units import UnitError
from epa_rt.experiments.jogging import Fill, Move, Vent, Wait, parse_order

RIGS = Path(__file__).resolve().parents[2] / "config/rigs"
KNEE = load_rig(RIGS / "knee.yaml")


@pytest.mark.parametrize(
    ("text", "order"),
    [
        ("move -5 mm at 3 mm/s", Move(-0.005, 0.003)),
        ("  move 1cm", Move(0.01, 0.03)),
        ("fill spam 200 kPa", Fill("spam", 301_325.0)),
        ("fill ppam 200kPa abs", Fill("ppam", 200_000.0)),
        ("vent", Vent(("spam", "ppam"))),
        ("vent ppam", Vent(("ppam",))),
        ("wait 250 ms", Wait(0.25)),
    ],
)
def test_an_order_in_words(text, order):
    assert parse_order(text, KNEE) == order


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("jump", "found 'jump', expected 'move -5 mm"),
        ("move", "found 'move'"),
        ("move 5 N", "found '5 N'"),
        ("move 5 mm at 300 mm/s", "found '300 mm/s', expected above 0 and at most 30 mm/s"),
        ("move 5 mm at -1 mm/s", "expected above 0"),
        ("move 5 mm at 0 mm/s", "expected above 0"),
        ("fill arm 100 kPa", "found the muscle 'arm', expected one of spam, ppam"),
        ("fill spam 790 kPa", "expected 0 to below 780 kPa gauge"),
        ("fill spam -1 kPa", "expected 0 to below"),
        ("vent arm", "found the muscle 'arm'"),
        ("wait -1 s", "expected 0 s to 600 s"),
        ("wait nan s", "found"),
    ],
)
def test_what_is_no_order_is_said(text, found):
    with pytest.raises(UnitError) as error:
        parse_order(text, KNEE)
    assert found in str(error.value)

"""The rig file's rest place and let-down speed: their defaults, and refused where wrong."""

from pathlib import Path

import pytest

from epa_rt.config.rig import Motor, rig_from
from epa_rt.config.source import ConfigError, parse_yaml

RIGS = Path(__file__).resolve().parents[2] / "config" / "rigs"
PLACES = "  places: {no_load: 0 mm, stretched: 28 mm}\n"


def motor(lines: str = "", places: str = PLACES, target: str = "") -> Motor:
    text = (RIGS / "bench.yaml").read_text(encoding="utf-8")
    assert PLACES in text
    text = text.replace(PLACES, places + lines)
    if target:
        before, name, after = text.partition("name: cmd_motor_travel_m")
        old = after.split("limits: ")[1].split("\n")[0]
        text = before + name + after.replace(old, target, 1)
    return rig_from(parse_yaml(text, "rig.yaml")).motor


def test_the_rest_place_is_no_load_where_there_is_one():
    assert motor().rest_place_name == "no_load"
    assert motor("  rest_place: stretched\n").rest_place_name == "stretched"
    assert motor(places="  places: {stretched: 28 mm}\n").rest_place_name is None
    assert motor(places="").rest_place_name is None


def test_the_speed_is_that_of_a_jog_where_not_given():
    assert motor().let_down_speed_si == pytest.approx(0.007)
    assert motor("  jog_speed: 5 mm/s\n").let_down_speed_si == pytest.approx(0.005)
    lines = "  jog_speed: 5 mm/s\n  let_down_speed: 3 mm/s\n"
    assert motor(lines).let_down_speed_si == pytest.approx(0.003)
    assert motor("  let_down_speed: 70 mm/s\n").let_down_speed_si == pytest.approx(0.07)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"lines": "  rest_place: slack\n"}, "found 'slack', expected no_load, stretched"),
        ({"lines": "  rest_place: slack\n", "places": ""}, "motor.places, which has none"),
        ({"lines": "  let_down_speed: 71 mm/s\n"}, "expected at most speed_max, 70 mm/s"),
        ({"lines": "  let_down_speed: 0 mm/s\n"}, "expected a value above zero"),
        ({"lines": "  let_down_speed: 5\n"}, "let_down_speed"),
        (
            {"lines": "  rest_place: stretched\n", "target": "[-10 mm, 20 mm]"},
            "'stretched' at 28 mm, expected a place within -10 to 20 mm, the limits of cmd_motor",
        ),
    ],
)
def test_what_does_not_fit_is_refused_with_its_line(given, said):
    with pytest.raises(ConfigError) as refused:
        motor(**given)
    assert said in str(refused.value) and "rig.yaml:" in str(refused.value)

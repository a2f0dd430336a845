"""Where no free run can speak: blocks below their floor name nothing, and logs that no fit has seen
and numbers at their bounds count against names.
"""

from types import SimpleNamespace

import pytest

from epa_rt.gap.blocks_alone import at_bounds, doubted_by, nothing_shows
from epa_rt.gap.diagnosis import Named, Number, Shrinkage
from epa_rt.models.effect import Knob

SPEED = Knob("friction.stribeck_speed_m_s", "m/s", 0.05, 0.002, 0.3, 0.05, "stribeck", 0.05)
RISE = Knob("friction.stribeck_n", "N", 0.0, 0.0, 50.0, 2.0, "stribeck", 0.0)
PROBLEM = SimpleNamespace(knobs={knob.key: knob for knob in (SPEED, RISE)}, spread=lambda key: 1.0)


def named(rise: float, speed: float) -> Named:
    numbers = tuple(
        Number(knob.key, value, knob.unit, value, value, knob.value)
        for knob, value in ((RISE, rise), (SPEED, speed))
    )
    return Named("stribeck", "stribeck", "friction", numbers, 0.9, 500.0)


def kept(before: float, after: float, closed: float | None) -> Shrinkage:
    return Shrinkage(
        "force_n", "N", "teacher_forced", "all", before, after, 1.0, closed, None, after, "sensors"
    )


@pytest.mark.parametrize(
    ("left", "nothing"), [((0.45,), True), ((0.45, 0.62), False), ((1.3,), False)]
)
def test_only_links_far_below_their_floor_show_nothing(left, nothing):
    links = {f"link{i}": SimpleNamespace(before=one) for i, one in enumerate(left)}
    assert nothing_shows(SimpleNamespace(links=links)) is nothing


@pytest.mark.parametrize(
    ("rise", "speed", "ends"),
    [
        (10.0, 0.1, ()),
        (10.0, 0.3, (SPEED.key,)),
        (0.0, 0.05, ()),
        (50.0, 0.002, (RISE.key, SPEED.key)),
    ],
)
def test_numbers_at_their_bounds_are_found_unless_the_effect_is_absent_there(rise, speed, ends):
    assert at_bounds(PROBLEM, named(rise, speed)) == ends
    counts, words = doubted_by(PROBLEM, named(rise, speed), None)
    assert (counts, len(words)) == ((0.4, 1) if ends else (1.0, 0)) and all(
        key in words[0] for key in ends
    )


@pytest.mark.parametrize(
    ("row", "says"),
    [
        (kept(8.4, 17.0, -3.0), "makes worse force_n (8.4 x"),
        (kept(90.0, 89.0, 0.05), "closes less than half of force_n"),
        (kept(20.0, 9.0, 0.76), None),
        (None, None),
    ],
)
def test_logs_that_no_fit_has_seen_count_against_a_name_that_does_not_serve_them(row, says):
    counts, words = doubted_by(PROBLEM, named(10.0, 0.1), row)
    assert counts == (0.4 if says else 1.0) and [says in word for word in words] == (
        [True] if says else []
    )

"""A drive that seeks its index while travel stands: the way is bounded by its speed, too."""

import re

import pytest

from tests.safety.test_index_guard_bounds import SPEED, TRAVEL, Guarded


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_travel_that_stands_does_not_lead_further_than_the_way_by_speed(sign):
    guarded = Guarded()
    speed = sign * guarded.way.speed
    most = guarded.way.most + 2.0 * guarded.way.landing
    dt_s = guarded.guard._dt_s
    cycles = int(most / (abs(speed) * dt_s))
    for _ in range(cycles):
        assert guarded.cycle(**{SPEED: speed, TRAVEL: 0.0}) is None
    found = [guarded.cycle(**{SPEED: speed, TRAVEL: 0.0}) for _ in range(2)]
    cause, row, says = next(one for one in found if one)
    went = re.fullmatch(
        rf"by {SPEED} the motor went (\S+) mm since the start, more than (\S+) mm,"
        rf" and by {TRAVEL} 0 m",
        says,
    )
    assert (cause, row) == ("over-travel", SPEED)
    ways = (cycles, cycles + 1, cycles + 2)
    assert went[1] in {f"{n * speed * dt_s * 1e3:.4g}" for n in ways}
    assert went[2] == f"{most * 1e3:.4g}"


def test_the_way_that_travel_shows_is_said_beside_it():
    """Travel reads three tenths of the truth."""
    guarded = Guarded()
    speed, dt_s = guarded.way.speed, guarded.guard._dt_s
    travel, refusal = 0.0, None
    while refusal is None:
        travel += 0.3 * speed * dt_s
        refusal = guarded.cycle(**{SPEED: speed, TRAVEL: travel})
    shown, unit = refusal[2].rsplit(" ", 2)[1:]
    assert unit == "mm" and len(shown.lstrip("0.").replace(".", "")) <= 4
    assert 1e-3 * float(shown) == pytest.approx(travel - 0.3 * speed * dt_s, abs=2e-6)

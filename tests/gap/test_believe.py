"""A further effect that gains where the others explain nothing is a gap of its own; one that gains
beside them may only mend them.
"""

from types import SimpleNamespace as Thing

import numpy as np
import pytest

from epa_rt.gap import believe
from epa_rt.gap.believe import Rules, elsewhere, negligible
from epa_rt.gap.problem import Problem
from tests.gap import toy

LINKS = ("gas0", "motor")


def normal(*squares: float):
    return Thing(square=np.array([[square] for square in squares]))


def found(before, others_on, with_it) -> bool:
    """``before``, ``others_on``, ``with_it``: chi-square by link with no effect, with the others,
    with the further one too.
    """
    problem = Thing(
        links=LINKS, residual=lambda values, link: np.array([np.sqrt(before[LINKS.index(link)])])
    )
    role = Thing(point=Thing(normal=normal(*others_on)), best=Thing(normal=normal(*with_it)))
    return elsewhere(problem, role, Thing(point=Thing(values={})), Rules())


@pytest.mark.parametrize(
    ("before", "others_on", "with_it", "own_gap"),
    [
        (
            (9000.0, 4000.0),
            (1000.0, 4000.0),
            (1000.0, 1000.0),
            True,
        ),  # gas explained by the others, motor by the further one
        (
            (9000.0, 4000.0),
            (1000.0, 4000.0),
            (400.0, 1000.0),
            False,
        ),  # a sixth of what it gains lies where the others explain more
        ((9000.0, 4000.0), (3000.0, 4000.0), (1000.0, 4000.0), False),  # mends the gas' formula
        (
            (9000.0, 4000.0),
            (1000.0, 3000.0),
            (1000.0, 1000.0),
            False,
        ),  # the others explain half as much in the motor
        (
            (9000.0, 4000.0),
            (1000.0, 4100.0),
            (1000.0, 1000.0),
            True,
        ),  # the others made the motor worse: nothing explained
    ],
)
def test_what_gains_where_others_explain_nothing_stands_alone(before, others_on, with_it, own_gap):
    assert found(before, others_on, with_it) == own_gap


@pytest.mark.parametrize(
    ("offset_pa", "too_little"),
    [(0.0, True), (150.0, True), (-150.0, True), (400.0, False), (-400.0, False)],
)
def test_a_zero_that_nobody_would_set_right_is_not_named(offset_pa, too_little):
    """Of a typical 3 kPa."""
    log = toy.recording("log", 1)
    assert (
        negligible(
            Problem(toy.Toy(), [log], toy.floors(None, [log], {})),
            "pressure_offset",
            {"sensors.pressure_offset_pa": offset_pa},
        )
        is too_little
    )


@pytest.mark.parametrize(
    ("gain", "share", "believed_there"), [(2000.0, 1.0, False), (2e4, 0.5, False), (2e4, 1.0, True)]
)
def test_however_weak_what_is_plain_and_all_there_is_is_believed(
    gain, share, believed_there, monkeypatch
):
    """A twelfth of a millisecond of encoder age is little, and all that a drive's current shows."""
    monkeypatch.setattr(believe, "negligible", lambda *_: True)
    gains = np.full((1, 40), gain / 40) + np.resize([1.0, -1.0], 40)
    role = Thing(gains=gains, best=Thing(effect="encoder_skew", values={}), point=Thing(effects=()))
    left = Thing(amount=lambda scale: gain / share)
    assert (
        believe.believed(Thing(scale={}), role, role, lambda point: left, Rules()) is believed_there
    )

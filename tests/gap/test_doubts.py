"""What takes from every name's confidence is said."""

import pytest

from epa_rt.gap.doubts import doubted, doubts
from epa_rt.gap.heard import Heard


@pytest.mark.parametrize(
    ("gap", "left", "words"),
    [
        (272_000.0, 255.0, "keeps 255 of its 272,000"),
        (900.0, 899.0, "no better with the named effects"),
    ],
)
def test_free_run_that_speaks_against_names_is_said_with_its_figures(gap, left, words):
    there = Heard(gap, left, 0.0, {}, {})
    (said,) = doubts(there, ())
    assert doubted(there) and words in said and "counts 0.4 of itself" in said


@pytest.mark.parametrize("there", [None, Heard(900.0, 20.0, 0.0, {}, {})])
def test_where_nothing_speaks_against_names_nothing_is_said(there):
    assert not doubted(there) and doubts(there, ()) == ()


def test_a_link_that_names_do_not_reach_is_said_besides():
    assert len(doubts(Heard(900.0, 899.0, 0.0, {}, {}), ("torque",))) == 2
    assert "next to nothing of the gap in torque" in doubts(None, ("torque",))[0]

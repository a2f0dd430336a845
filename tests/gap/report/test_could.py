"""The posterior's answer in words."""

import pytest

from epa_rt.gap.diagnosis import Posterior
from epa_rt.gap.report.could import answer_words


def answer(verdict, names=None, instead=()):
    return answer_words(Posterior((), {}, 0.0, "blocks", verdict, names or {}, instead, 25))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("no_gap",), "nothing that the plant file, refitted, lacks"),
        (("not_in_catalogue",), "no law of the catalogue describes"),
        (("explained", {"creep": 0.97}), "creep (0.97) is missing."),
        (("partly_explained", {"creep": 0.97}), "creep (0.97) is missing, and something besides."),
        (
            ("not_separable", {"creep": 0.5}, (("strap_compliance",),)),
            "these logs do not tell which: creep (0.50); or strap compliance.",
        ),
        (
            ("not_separable", {"creep": 1.0, "threshold_pressure": 0.6}, (("creep",),)),
            "creep (1.00) is missing; whether threshold pressure is too is not told.",
        ),
    ],
)
def test_the_answer_is_one_sentence(given, words):
    assert words in answer(*given)

"""From what was found and what is left to a verdict."""

import pytest

from epa_rt.gap.generic import GenericFit
from epa_rt.gap.verdict import coverage, decided, gaps, untested
from epa_rt.gap.yardstick import Left


def left(**links: tuple[float, float]) -> Left:
    """Link to chi-square per sample, and what the generic model leaves of it; 5000 samples each."""
    return Left({name: GenericFit(name, 5000, before, after, 0.0, ()) for name, (before, after) in links.items()})


def verdict(before: Left, after: Left, effects=("leak",), ambiguous=False, silent=0.0):
    return decided(bool(gaps(before, after)), effects, coverage(before, after), ambiguous, silent)


def test_noise_is_no_gap_and_silence_of_logs_that_show_little_means_nothing():
    quiet = left(gas=(1.1, 1.1), motor=(1.3, 1.3))
    assert verdict(quiet, quiet, ()) == "no_gap"
    assert verdict(quiet, quiet, (), silent=0.9) == "not_excited"


def test_gap_that_only_the_generic_model_explains_is_in_no_catalogue():
    gap = left(gas=(9.0, 1.5))
    assert gaps(gap, gap) == ("gas",)
    assert verdict(gap, gap, ()) == "not_in_catalogue"
    assert verdict(gap, left(gas=(7.0, 1.5))) == "not_in_catalogue"


def test_effect_that_leaves_one_link_as_it_was_is_not_the_cause():
    before = left(gas=(9.0, 9.0), motor=(9.0, 9.0))
    assert verdict(before, left(gas=(1.0, 1.0), motor=(8.0, 8.0))) == "not_in_catalogue"
    assert verdict(before, left(gas=(1.0, 1.0), motor=(1.2, 1.2))) == "explained"


@pytest.mark.parametrize(("rest", "said"), [(1.2, "explained"), (2.2, "explained"), (10.0, "partly_explained"), (60.0, "not_in_catalogue")])
def test_what_stays_decides_between_whole_part_and_none(rest, said):
    assert verdict(left(gas=(40.0, 1.0)), left(gas=(rest, 1.0))) == said


def test_name_that_may_be_another_family_is_not_separable():
    assert verdict(left(gas=(9.0, 9.0)), left(gas=(1.0, 1.0)), ambiguous=True) == "not_separable"


def test_effect_without_a_signature_was_not_tested():
    assert untested({"leak": 1e4, "droop": 3.0}, ("leak", "droop", "backlash")) == ("droop", "backlash")

"""From what was found and what is left to a verdict."""

from types import SimpleNamespace

import numpy as np
import pytest

from epa_rt.gap.answer import NAMELESS
from epa_rt.gap.coverage import Coverage, broken, coverage, gaps, passed_over, trust
from epa_rt.gap.diagnosis import Number
from epa_rt.gap.generic import GenericFit
from epa_rt.gap.plausible import strained
from epa_rt.gap.verdict import Evidence, decided, informed, untested
from epa_rt.gap.weigh import groundless
from epa_rt.gap.wording import Wording, said_of_moved
from epa_rt.gap.yardstick import Left


def left(**links: tuple[float, float]) -> Left:
    """Link to chi-square per sample, and what the generic model leaves of it; 5000 samples each."""
    return Left(
        {
            name: GenericFit(name, 5000, before, after, 0.0, ())
            for name, (before, after) in links.items()
        }
    )


def verdict(before: Left, after: Left, effects=("leak",), ambiguous=False, silent=0.0, odd=False):
    return decided(
        Evidence(
            bool(gaps(before, after)), effects, coverage(before, after), ambiguous, silent, odd
        )
    )


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


@pytest.mark.parametrize(
    ("rest", "said"),
    [
        (1.2, "explained"),
        (2.2, "explained"),
        (10.0, "partly_explained"),
        (15.0, "not_in_catalogue"),
        (60.0, "not_in_catalogue"),
    ],
)
def test_what_stays_decides_between_whole_part_and_none(rest, said):
    assert verdict(left(gas=(40.0, 1.0)), left(gas=(rest, 1.0))) == said


def test_name_that_may_be_another_family_is_not_separable():
    assert verdict(left(gas=(9.0, 9.0)), left(gas=(1.0, 1.0)), ambiguous=True) == "not_separable"


def test_effect_without_a_signature_was_not_tested():
    assert untested({"leak": 1e4, "droop": 3.0}, ("leak", "droop", "backlash")) == (
        "droop",
        "backlash",
    )


@pytest.mark.parametrize(("rest", "said"), [(6.0, "explained"), (40.0, "partly_explained")])
def test_large_gap_is_explained_only_where_little_stays_in_multiples_of_the_floor(rest, said):
    assert verdict(left(gas=(1500.0, 20.0)), left(gas=(rest, rest))) == said


def test_nominal_parameter_that_hides_more_than_the_effects_explain_is_a_gap_in_no_catalogue():
    quiet = left(gas=(1.1, 1.1))
    assert verdict(quiet, quiet, (), odd=True) == "not_in_catalogue"
    assert verdict(left(gas=(9.0, 9.0)), quiet, odd=True) == "not_in_catalogue"


def test_noise_that_nothing_foresees_and_a_shape_within_the_methods_own_misfit_are_no_gap():
    assert not gaps(left(drive=(5.0, 4.7)), left(drive=(5.0, 4.7)))
    assert not gaps(left(load=(1.2, 1.0)), left(load=(1.2, 1.0)))
    assert gaps(left(load=(1.2, 1.2)), left(load=(1.0, 1.0))) == ("load",)


def test_link_of_whose_effects_few_were_tested_is_not_judged():
    assert informed(
        {"gas": ("leak", "droop"), "drive": ("cogging", "backlash")},
        ("cogging", "backlash", "leak"),
    ) == ("gas",)


def test_a_link_whose_effects_are_all_left_out_is_judged():
    assert informed({"gas": (), "drive": ("cogging",)}, ("cogging",)) == ("gas",)


def test_no_name_stands_beside_a_verdict_that_says_of_no_place_that_anything_is_wrong():
    assert {"no_gap", "not_excited", "not_in_catalogue"} == set(NAMELESS)


def test_a_name_is_trusted_less_the_more_its_law_leaves():
    gap = left(muscle0=(11.2, 1.0), gas=(1.0, 1.0))
    assert (
        trust(gap, left(muscle0=(1.1, 1.0), gas=(1.0, 1.0))) == 1.0
    )  # no more than rigs without a gap leave
    assert trust(gap, left(muscle0=(2.2, 1.0), gas=(1.0, 1.0))) == pytest.approx(
        0.7
    )  # a tenth stays
    assert trust(gap, left(muscle0=(6.2, 1.0), gas=(1.0, 1.0))) == 0.0
    assert trust(left(gas=(1.0, 1.0)), left(gas=(1.0, 1.0))) == 1.0


def test_a_link_that_keeps_a_trifle_does_not_undo_what_explains_the_rest():
    before, after = left(motor=(3.0, 1.5), gas=(1.6, 1.6)), left(motor=(1.0, 1.0), gas=(1.6, 1.6))
    assert coverage(before, after).least == 1.0
    assert verdict(before, after) == "explained"
    much = left(motor=(1.0, 1.0), gas=(9.0, 9.0))
    assert coverage(left(motor=(30.0, 1.5), gas=(9.0, 9.0)), much).least < 0.1


@pytest.mark.parametrize(
    ("whole", "verdict"), [(None, "explained"), (0.95, "explained"), (0.9, "not_in_catalogue")]
)
def test_free_run_may_take_a_name_away(whole, verdict):
    assert decided(Evidence(True, ["moment_arm"], Coverage(1.0, 1.0, 0.0), whole=whole)) == verdict


def test_a_name_in_which_nothing_is_left_to_trust_is_no_answer_where_the_whole_plant_shows_a_gap():
    rest = Coverage(
        0.3, 0.3, 0.4
    )  # of a knee: its acceleration kept two thirds of its gap, and free run was content
    assert (
        decided(Evidence(True, ["strap_compliance"], rest, whole=1.0, trust=0.0))
        == "not_in_catalogue"
    )
    assert decided(Evidence(True, ["strap_compliance"], rest, whole=1.0, trust=0.1)) == "explained"
    assert (
        decided(Evidence(True, ["strap_compliance"], rest, whole=1.0, trust=0.0, to_noise=True))
        == "explained"
    )  # the whole plant follows to the noise
    assert (
        decided(Evidence(True, ["leak"], Coverage(1.0, 1.0, 0.0), trust=0.0)) == "explained"
    )  # a trace, of which free run says nothing


def test_free_run_may_name_what_the_blocks_show_too_faintly():
    faint = Coverage(0.3, 0.3, 0.1)
    assert decided(Evidence(False, ["payload"], faint)) == "no_gap"
    assert decided(Evidence(False, ["payload"], faint, whole=0.99)) == "explained"
    assert (
        decided(Evidence(True, ["payload"], Coverage(0.3, 0.3, 3.0), whole=0.99))
        == "not_in_catalogue"
    )


def test_what_free_run_explains_is_named_where_no_block_has_a_gap():
    rest = Coverage(0.3, 0.3, 3.0)  # of links that have no gap to explain
    assert decided(Evidence(False, ["payload"], rest, whole=1.0)) == "partly_explained"
    assert decided(Evidence(True, ["payload"], rest, whole=1.0)) == "not_in_catalogue"
    assert decided(Evidence(False, ["payload"], rest, whole=0.5)) == "not_in_catalogue"


def test_a_faint_effect_on_which_blocks_and_free_run_agree_is_named():
    faint = Coverage(0.01, 0.01, 0.2)
    assert decided(Evidence(True, ["force_offset"], faint, helps=True)) == "explained"
    assert decided(Evidence(True, ["force_offset"], faint)) == "no_gap"
    assert (
        decided(Evidence(True, ["force_offset"], Coverage(0.01, 0.01, 3.0), helps=True))
        == "not_in_catalogue"
    )
    assert (
        decided(Evidence(True, ["force_offset"], faint, odd=True, helps=True)) == "not_in_catalogue"
    )
    assert (
        Wording("explained", ["force_offset"], [], ["motor"], 0.01, 0, 60, faint=(28.0, 9.0)).said()
        == "force_offset: faint, but the blocks' fits and free run agree on it (chi-square 28 to 9"
        " above its noise)."
    )


def test_a_plant_that_follows_its_commands_to_the_noise_is_named_whatever_a_block_still_shows():
    half = Coverage(0.54, 0.54, 9.0)
    assert decided(Evidence(True, ["knee_friction"], half, whole=1.0)) == "not_in_catalogue"
    assert (
        decided(Evidence(True, ["knee_friction"], half, whole=1.0, to_noise=True))
        == "partly_explained"
    )
    assert (
        decided(Evidence(True, ["knee_friction"], half, odd=True, whole=1.0, to_noise=True))
        == "not_in_catalogue"
    )


def test_the_sentence_then_speaks_of_free_run():
    text = Wording("explained", ["knee_friction"], [], ["load"], 0.47, 0, 60, whole=1.0).said()
    assert (
        text.startswith("knee_friction explains 100 % of the gap in free run") and "in load" in text
    )
    assert (
        Wording("explained", ["knee_friction"], [], ["load"], 0.95, 0, 60, whole=1.0).said()
        == "knee_friction explains 95 % of what can be explained in load."
    )


@pytest.mark.parametrize(
    ("lost", "verdict"),
    [
        (None, "no_gap"),
        (53.0, "no_gap"),
        (90.0, "no_gap"),
        (120.0, "not_in_catalogue"),
        (170.0, "not_in_catalogue"),
        (304.0, "not_in_catalogue"),
    ],
)
def test_what_only_free_run_shows_and_nothing_explains_is_missing(lost, verdict):
    assert decided(Evidence(False, [], Coverage(1.0, 1.0, 0.0), lost=lost)) == verdict


@pytest.mark.parametrize(("gap", "verdict"), [(False, "no_gap"), (True, "not_in_catalogue")])
def test_a_name_that_is_hardly_ever_first_and_helps_nothing_in_free_run_is_none(gap, verdict):
    """A bow of a force cell on a rig without a gap: first in 28 of 100 resamples, and free run
    shows nothing with it or without.
    """
    found = Coverage(1.0, 1.0, 0.0)
    assert decided(Evidence(gap, ["force_bow"], found, ambiguous=True, groundless=True)) == verdict
    assert decided(Evidence(gap, ["force_bow"], found)) == "explained"


@pytest.mark.parametrize(("confidence", "nothing"), [(0.0, True), (0.1, False), (0.6, False)])
def test_without_a_model_of_the_whole_a_name_without_any_confidence_is_none(confidence, nothing):
    """A rise towards standstill of a shaft without a gap that took its place between two bars: what
    it explained was above the one, its confidence below the other.
    """
    assert (
        groundless([SimpleNamespace(confidence=confidence), SimpleNamespace(confidence=0.0)], None)
        is nothing
    )


def test_a_name_counts_for_less_where_it_leaves_part_of_the_gap_in_free_run():
    assert trust(left(load=(3.0, 1.0)), left(load=(1.1, 1.0)), 1.0) == 1.0
    assert trust(left(load=(3.0, 1.0)), left(load=(1.1, 1.0)), 0.8) == pytest.approx(0.0)
    assert trust(left(load=(3.0, 1.0)), left(load=(1.1, 1.0)), 0.98) == pytest.approx(0.8)
    assert trust(left(load=(1.7, 1.0)), left(load=(1.6, 1.0))) == 0.0
    assert trust(left(load=(1.7, 1.0)), left(load=(1.6, 1.0)), 1.0) == 1.0


def at(**spreads: float):
    """Nominal parameters that far from the plant file; an effect's own number is none of them."""
    keys = (*spreads, "friction")
    return SimpleNamespace(
        keys=keys,
        z=np.array([*spreads.values(), 50.0]),
        prior=np.array([1.0] * len(spreads) + [0.0]),
    )


def test_nominal_parameters_that_an_effect_pushes_away_stand_for_something_else():
    assert strained(at(mass=0.5, lever=-0.3), at(mass=1.5, lever=-2.0)) == ()
    assert strained(at(mass=2.5, lever=2.5, volume=0.1), at(mass=4.5, lever=4.4, volume=1.0)) == (
        "mass",
        "lever",
        "volume",
    )
    assert strained(at(volume=3.0), at(volume=-7.6)) == ("volume",)


def test_a_plant_file_that_is_wrong_with_and_without_an_effect_does_not_speak_against_it():
    assert strained(at(length=10.0, mass=0.2), at(length=9.6, mass=1.0)) == ()
    assert strained(at(length=10.0), at(length=8.0)) == ("length",)


def test_a_right_law_breaks_no_link_that_agreed():
    """A late command taken for an encoder's age explained 96 % of a drive's current, and the
    motor's balances, which had agreed, no longer did.
    """
    before, after = (
        left(drive=(1200.0, 760.0), motor=(0.9, 0.9), torque=(0.95, 0.9)),
        left(drive=(46.0, 40.0), motor=(4.5, 3.0), torque=(8.2, 5.0)),
    )
    assert broken(before, after) == ("torque", "motor")
    found = coverage(before, after)
    assert decided(Evidence(True, ["encoder_skew"], found)) == "partly_explained"
    assert decided(Evidence(True, ["encoder_skew"], found, breaks=True)) == "not_in_catalogue"
    assert (
        decided(Evidence(True, ["encoder_skew"], found, breaks=True, to_noise=True))
        == "partly_explained"
    )
    assert (
        "torque, motor no longer agrees"
        in Wording(
            "not_in_catalogue",
            ["encoder_skew"],
            [[]],
            ["drive"],
            found.part,
            0,
            40,
            breaks=("torque", "motor"),
        ).said()
    )


def test_what_was_off_already_or_grows_by_noise_is_not_broken():
    assert (
        broken(left(drive=(50.0, 20.0), motor=(3.0, 2.0)), left(drive=(1.0, 1.0), motor=(5.0, 3.0)))
        == ()
    )
    assert (
        broken(left(drive=(50.0, 20.0), motor=(1.0, 1.0)), left(drive=(1.0, 1.0), motor=(1.6, 1.2)))
        == ()
    )


def test_a_gap_elsewhere_that_the_effects_do_not_touch_is_passed_over():
    """An encoder's age taken for a late command: the drive's current agrees, the balances are off
    as before.
    """
    before, after = (
        left(drive=(744.0, 331.0), motor=(4.6, 3.1), gas=(1.0, 1.0)),
        left(drive=(1.2, 1.2), motor=(4.6, 3.1), gas=(1.0, 1.0)),
    )
    assert passed_over(before, after) == ("motor",)
    found = coverage(before, after)
    assert decided(Evidence(True, ["transport_delay"], found)) == "explained"
    assert decided(Evidence(True, ["transport_delay"], found, elsewhere=True)) == "partly_explained"
    assert passed_over(before, left(drive=(1.2, 1.2), motor=(1.5, 1.5), gas=(1.0, 1.0))) == ()


def test_a_plant_file_that_was_far_off_is_said_where_nothing_else_is():
    moved = Number("chamber.stand_leak_per_s", 1.2e-4, "1/s", 1.1e-4, 1.3e-4, 2.2e-5)
    assert "chamber.stand_leak_per_s to 0.00012 1/s (plant file: 2.2e-05)" in said_of_moved([moved])
    ratio = Number("drive.torque_gain_ratio", 1.2, "1", 1.1, 1.3, 1.0)
    assert said_of_moved([ratio]).endswith("drive.torque_gain_ratio to 1.2 (plant file: 1).")


def test_names_that_have_one_form_leave_nothing_in_the_blocks_that_they_have_to_do_with():
    """An encoder's age for a late command: 0.92 of what the drive shows, and the whole plant
    follows to the noise.
    """
    some = Coverage(0.92, 0.92, 3.0)

    def skew(exact):
        return decided(
            Evidence(True, ["encoder_skew"], some, whole=1.0, to_noise=True, exact=exact)
        )

    assert skew(some) == "not_in_catalogue"
    assert skew(None) == "explained"  # one that may have another curve
    assert (
        skew(Coverage(0.995, 0.995, 3.0)) == "explained"
    )  # the rest is in links that it has nothing to do with
    assert skew(Coverage(0.5, 1.0, 0.3)) == "explained"  # nothing worth a word stays
    text = Wording(
        "not_in_catalogue",
        ["encoder_skew"],
        [[]],
        ["drive"],
        0.95,
        0,
        5,
        whole=1.0,
        other_form=some,
    ).said()
    assert "(encoder_skew) leaves 8 % of the gap" in text and "one formula" in text


def test_links_of_another_cause_are_not_what_a_name_is_held_to():
    before, after = left(a=(40.0, 1.2), b=(20.0, 1.2)), left(a=(1.2, 1.2), b=(20.0, 1.2))
    assert coverage(before, after).part < 0.7
    assert passed_over(before, after) == ("b",)
    assert coverage(before, after, but=("b",)).part == 1.0


def test_what_cannot_be_told_apart_is_said_of_each_name():
    one = Wording(
        "not_separable", ["leak"], [["gauge_drift", "fill_heat"]], ["gas"], 0.99, 0, 40
    ).said()
    assert one.endswith("this data cannot tell it from gauge_drift, fill_heat.")
    both = Wording(
        "not_separable",
        ["knee_spring", "payload", "leak"],
        [["tilt"], ["tilt"], []],
        ["load"],
        0.99,
        0,
        40,
    ).said()
    assert both.endswith("this data cannot tell knee_spring from tilt, nor payload from tilt.")
